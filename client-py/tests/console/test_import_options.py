"""What `pdn import` is told, and the sentence that it ends with."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import typer
from fake_planner import FakePlanner
from typer.testing import CliRunner, Result

from pdn.cli import build
from pdn.console import import_graph, import_options
from pdn.console.pose_graph import consistency
from pdn.wire import Phase

INFORMATION = "100 0 0 0 0 0 90 0 0 0 0 80 0 0 0 25 0 0 24 0 23"


def run(*arguments: str) -> Result:
    return CliRunner().invoke(build(), list(arguments))


@pytest.fixture
def file(tmp_path: Path) -> str:
    path = tmp_path / "graph.g2o"
    path.write_text(f"EDGE_SE3:QUAT 0 1 1 0 0 0 0 0 1 {INFORMATION}\n")
    return str(path)


def test_losses_and_gates_are_settings_of_the_mission() -> None:
    assert import_options.robust("none") == "none"
    assert import_options.robust("huber") == {"huber": 1.345}
    assert import_options.robust("cauchy:2.5") == {"cauchy": 2.5}
    assert import_options.gate("off") is None
    assert import_options.gate("35") == 35.0
    assert import_options.sigmas("0.5,0.25") == (0.5, 0.25)
    # Nothing is sent that the caller has not asked for.
    assert import_graph._settings(None, None) == {}
    assert import_graph._settings("huber:3", "off") == {
        "robust": {"relative": {"huber": 3.0}},
        "gate_sigmas": None,
    }


@pytest.mark.parametrize(
    ("option", "text"),
    [
        ("robust", "tukey"),
        ("robust", "cauchy:"),
        ("robust", "cauchy:-1"),
        ("robust", "huber:nan"),
        ("robust", "none:1"),
        ("gate", "on"),
        ("gate", "0"),
        ("gate", "inf"),
        ("sigmas", "0.1"),
        ("sigmas", "0,1"),
        ("sigmas", "0.1,0.1,0.1"),
    ],
)
def test_what_is_no_value_is_wrong_usage(option: str, text: str) -> None:
    with pytest.raises(typer.BadParameter) as caught:
        getattr(import_options, option)(text)
    assert repr(text) in str(caught.value)


@pytest.mark.parametrize(
    "arguments",
    [
        ["--robust", "tukey"],
        ["--gate", "on"],
        ["--default-sigmas", "0.1"],
        ["--plane-sigmas", "a,b"],
        ["--mission", "Not An Id"],
        ["--refused", "refused.g2o"],
        ["--keep-going", "--refused", "/no/such/folder/refused.g2o"],
    ],
    ids=" ".join,
)
def test_wrong_usage_is_found_before_anything_is_begun(file: str, arguments: list[str]) -> None:
    # There is no planner at that endpoint: looking for it would end with 3.
    assert run("import", file, "-e", "tcp/127.0.0.1:1", *arguments).exit_code == 2


def test_the_older_name_says_what_it_is() -> None:
    older, newer = run("import-g2o", "--help").output, run("import", "--help").output
    assert "The older name of `pdn import`" in older
    for option in ("--robust", "--gate", "--keep-going", "--refused", "--replace", "--default-sigmas"):
        assert option in older
        assert option in newer


def test_a_refused_keyframe_ends_the_import_even_when_it_keeps_going(planner: FakePlanner, file: str) -> None:
    planner.fate = lambda seq, copy: "refuse" if seq == 0 else "apply"
    result = run("import", file, "--keep-going", "--quiet", "-e", planner.endpoint, "--vehicle", "auv")
    assert result.exit_code == 1
    assert "Normalise it. [not_unit]" in result.stderr
    assert "is aborted" in result.stderr
    assert planner.phase is Phase.ABORTED


def test_a_refused_edge_is_told_with_its_line_whatever_the_reason(planner: FakePlanner, file: str) -> None:
    planner.fate = lambda seq, copy: "refuse" if seq == 3 else "apply"
    result = run("import", file, "--quiet", "-e", planner.endpoint, "--vehicle", "auv")
    assert result.exit_code == 1
    assert f"{file}:1: edge 0 -> 1 was refused: Normalise it." in result.stderr
    assert planner.phase is Phase.ABORTED


# --- the verdict ---


@pytest.mark.parametrize("freedom", [3, 6, 20, 1000, 38808])
def test_the_interval_is_that_of_the_chi_squared_distribution(freedom: int) -> None:
    stats = pytest.importorskip("scipy.stats", reason="needs the extra `oracles`")
    low, high = consistency.interval(freedom)
    # Wilson and Hilferty's approximation of a quantile, in units of the distribution's standard deviation.
    spread = (2.0 * freedom) ** 0.5
    assert low == pytest.approx(stats.chi2.ppf(0.025, freedom), abs=0.03 * spread)
    assert high == pytest.approx(stats.chi2.ppf(0.975, freedom), abs=0.03 * spread)


@pytest.mark.parametrize(
    ("chi2", "freedom", "says"),
    [
        (0.0, 0, "No loop is closed"),
        (1e-20, -6, "No loop is closed"),
        (1000.0, 1000, "Consistent: 95 of 100"),
        (77.0 * 1000, 1000, "Too large: 95 of 100 .* 8.8 times too small"),
        (250.0, 1000, "Too small: .* 2 times too large"),
        (1e-25, 6, "without noise"),
        (0.0, 6, "without noise"),
    ],
)
def test_the_verdict_names_the_factor(chi2: float, freedom: int, says: str) -> None:
    assert re.search(says, consistency.verdict(chi2, freedom))
