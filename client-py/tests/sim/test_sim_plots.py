"""Figures from run files: drawn whole, and refused with what is missing."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
import typer
from filter_planner import FilterPlanner
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.text import Text
from typer.testing import CliRunner

from pdn.plots import commands, figures, runs, style
from pdn.sim import flight, record, scenario_file

FLOOR = scenario_file.load("seafloor")
SHORT = dataclasses.replace(FLOOR, survey=dataclasses.replace(FLOOR.survey, lines=2))


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("runs")
    paths = []
    for policy, alpha in [
        ("open-loop", 1.0),
        ("exhaustive", 1.0),
        *(("pdn", a) for a in (1.0, 0.75, 0.5, 0.25, 0.0)),
    ]:
        paths.append(folder / f"{policy}-{alpha}.json")
        record.save(flight.fly(SHORT, policy, alpha, 1, FilterPlanner(SHORT)), paths[-1])
    return paths


@pytest.mark.parametrize("name", ["5", "6", "mission"])
def test_every_label_lies_on_the_page(flown: list[Path], tmp_path: Path, name: str) -> None:
    figure = figures.draw(name, [runs.load(path) for path in flown])
    style.save(figure, tmp_path / "figure.png")
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined]
    page = figure.bbox
    texts = [text for text in _texts(figure) if text.get_text()]
    assert len(texts) > 30
    for text in texts:
        box = text.get_window_extent(renderer)
        inside = box.x0 >= -1 and box.y0 >= -1 and box.x1 <= page.x1 + 1 and box.y1 <= page.y1 + 1
        assert inside, text
    assert (tmp_path / "figure.png").stat().st_size > 50_000


@pytest.mark.parametrize("name", scenario_file.packaged())
def test_the_legend_of_a_mission_covers_no_label(name: str) -> None:
    scenario = scenario_file.load(name)
    short = dataclasses.replace(scenario, survey=dataclasses.replace(scenario.survey, lines=2))
    flown = flight.fly(short, "open-loop", 1.0, 1, FilterPlanner(short))
    figure = figures.mission(_through_a_file(flown))
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()  # type: ignore[attr-defined]
    for axes in figure.axes:
        legend = axes.get_legend()
        if legend is not None:
            label = axes.xaxis.label.get_window_extent(renderer)
            assert not legend.get_window_extent(renderer).overlaps(label)


def test_the_command_tells_programs_what_it_drew(flown: list[Path], tmp_path: Path) -> None:
    app = typer.Typer()
    commands.register(app)
    file = tmp_path / "figure.png"
    done = CliRunner().invoke(app, [str(flown[0]), "--out", str(file), "--json"])
    assert done.exit_code == 0, done.output
    assert json.loads(done.output) == {"figure": "mission", "file": str(file), "runs": [str(flown[0])]}
    assert file.exists()


def test_a_missing_run_is_named(flown: list[Path]) -> None:
    some = [runs.load(path) for path in flown[:2]]
    with pytest.raises(runs.RunError, match="pdn with alpha 1; given are: open loop, exhaustive"):
        figures.draw("5", some)


def test_other_files_are_refused(tmp_path: Path) -> None:
    for text, says in (("{}", "is no run"), ("not json", "is not JSON")):
        (tmp_path / "x.json").write_text(text)
        with pytest.raises(runs.RunError, match=says):
            runs.load(tmp_path / "x.json")
    with pytest.raises(runs.RunError, match="there is no run file"):
        runs.load(tmp_path / "y.json")


def _through_a_file(run: record.Run) -> runs.Run:
    with TemporaryDirectory() as folder:
        record.save(run, Path(folder) / "run.json")
        return runs.load(Path(folder) / "run.json")


def _texts(figure: Figure) -> Iterator[Text]:
    """Titles, labels, legends, and the marks of axes that are in view."""
    for axes in figure.axes:
        yield from (axes.title, axes.xaxis.label, axes.yaxis.label, *axes.texts)
        yield axes._left_title  # type: ignore[attr-defined]
        for axis in (axes.xaxis, axes.yaxis):
            low, high = sorted(axis.get_view_interval())
            yield from (tick.label1 for tick in axis.get_major_ticks() if low <= tick.get_loc() <= high)
    for legend in figure.findobj(match=Legend):
        yield from legend.get_texts()  # type: ignore[attr-defined]
