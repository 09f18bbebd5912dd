"""The commands `sim`, `plot` and `demo`, as far as they go without a daemon."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from pdn import demo
from pdn.plots import commands as plot_commands
from pdn.sim import commands as sim_commands

APP = typer.Typer()
APP.callback()(lambda: None)
for part in (sim_commands, plot_commands, demo):
    part.register(APP)


def run(*arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(APP, list(arguments), env={"COLUMNS": "200", "NO_COLOR": "1", "TERM": "dumb"})
    return result.exit_code, result.output


def test_help_names_what_matters() -> None:
    for command, words in (
        ("sim", ["--policy", "--seed", "--list", "--json"]),
        ("plot", ["--figure", "--json"]),
        ("demo", ["--daemon", "--json"]),
    ):
        code, text = run(command, "--help")
        assert code == 0
        assert all(word in text for word in words)


def test_scenarios_are_listed() -> None:
    code, text = run("sim", "--list", "--json")
    assert code == 0
    assert sorted(json.loads(text)) == ["gunnerus", "hull40", "seafloor"]


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["sim"], "name a scenario"),
        (["sim", "hull41"], "known are gunnerus, hull40, seafloor"),
        (["sim", "hull40", "--policy", "lucky"], "none of open-loop, exhaustive, pdn"),
        (["sim", "hull40", "--alpha", "1.5"], "less than or equal to 1"),
        (["plot", "nothing.json"], "there is no run file nothing.json"),
        (["plot", "nothing.json", "--figure", "7"], "none of 5, 6, mission"),
        (["demo", "--daemon", "nowhere/pdnd"], "there is no daemon"),
    ],
)
def test_wrong_usage_says_what_is_right(arguments: list[str], says: str) -> None:
    code, text = run(*arguments)
    assert code == 2
    assert says in " ".join(text.split())


def test_seeds() -> None:
    assert demo.parse_seeds("1-3,7") == [1, 2, 3, 7]
    for text in ("", "a", "3-1"):
        with pytest.raises(typer.BadParameter):
            demo.parse_seeds(text)


def test_the_table_is_aligned() -> None:
    record = dict.fromkeys(demo.COLUMNS, 1.0) | {
        "policy": "open-loop",
        "alpha": 1.0,
        "seed": 1,
        "decisions": 0,
    }
    lines = demo.table([record, record | {"policy": "pdn"}]).splitlines()
    assert len({len(line) for line in lines}) == 1
    assert lines[2].split("|")[2].strip() == "-"
    assert lines[3].split("|")[2].strip() == "1.00"


def test_a_daemon_that_does_not_start_is_reported(tmp_path: Path) -> None:
    program = tmp_path / "pdnd"
    program.write_text("#!/bin/sh\necho bad configuration >&2\nexit 4\n")
    program.chmod(0o755)
    with (
        pytest.raises(OSError, match="code 4: bad configuration"),
        demo.running_daemon(program, tmp_path / "log"),
    ):
        pass
