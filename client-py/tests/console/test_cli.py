"""The command line, run in-process: usage, answers, exit codes."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from fake_planner import FakePlanner
from typer.testing import CliRunner, Result

from pdn import __version__, wire
from pdn.cli import build

FACET = {"origin": [0, 0, 0], "u": [1, 0, 0], "v": [0, 1, 0], "length_u_m": 10, "length_v_m": 10}
TOML = """
mission = "m"
alpha = 0.5
[[target.facets]]
origin = [0, 0, 0]
u = [1, 0, 0]
v = [0, 1, 0]
length_u_m = 10
length_v_m = 10
"""
INFORMATION = "100 0 0 0 0 0 90 0 0 0 0 80 0 0 0 25 0 0 24 0 23"


def run(*arguments: str) -> Result:
    return CliRunner().invoke(build(), list(arguments))


def ask(planner: FakePlanner, *arguments: str) -> Result:
    return run(*arguments, "-e", planner.endpoint, "--vehicle", "auv")


@pytest.fixture
def mission_file(tmp_path: Path) -> str:
    path = tmp_path / "mission.toml"
    path.write_text(TOML)
    return str(path)


# --- help and usage ---


def test_help_lists_the_commands_and_the_exit_codes() -> None:
    result = run("--help")
    assert result.exit_code == 0
    for word in ("mission", "watch", "import", "import-g2o", "sim", "plot", "3 no connection"):
        assert word in result.output


@pytest.mark.parametrize(
    "command",
    [
        ["mission", name]
        for name in (
            "configure", "start", "pause", "resume", "hold", "complete", "abort", "show",
            "decision", "graph", "waypoints", "coverage", "link-model",
        )
    ]
    + [["watch"], ["import"], ["import-g2o"], ["sim"], ["plot"]],
    ids=" ".join,
)  # fmt: skip
def test_each_command_has_help(command: list[str]) -> None:
    result = run(*command, "--help")
    assert result.exit_code == 0
    assert "Usage" in result.output


def test_version() -> None:
    assert run("--version").output == f"pdn {__version__}\n"


def test_the_program_itself_runs() -> None:
    program = Path(sys.executable).parent / "pdn"
    called = subprocess.run([program, "--version"], capture_output=True, check=True, text=True)
    assert called.stdout == f"pdn {__version__}\n"


@pytest.mark.parametrize(
    "arguments",
    [
        ["no-such-command"],
        ["mission", "configure", "/no/such/file"],
        ["mission", "decision", "--alpha", "2"],
        ["mission", "decision", "--after", "-1"],
        ["mission", "show", "--vehicle", "Not An Id"],
        ["import-g2o"],
        ["watch", "--timeout", "0"],
    ],
    ids=" ".join,
)
def test_wrong_usage_ends_with_2(arguments: list[str]) -> None:
    assert run(*arguments).exit_code == 2


# --- failures ---


def test_no_daemon_ends_with_3_in_one_sentence(endpoint: str) -> None:
    result = run("mission", "show", "-e", endpoint, "--timeout", "0.3")
    assert result.exit_code == 3
    assert result.stderr.startswith("Error: No connection to tcp/127.0.0.1:")
    assert "Traceback" not in result.stderr
    assert result.stdout == ""


def test_debug_keeps_the_traceback(endpoint: str) -> None:
    result = run("--debug", "mission", "show", "-e", endpoint, "--timeout", "0.3")
    assert type(result.exception).__name__ == "ConnectionFailed"


def test_a_refusal_ends_with_1(planner: FakePlanner) -> None:
    result = ask(planner, "mission", "show")
    assert (result.exit_code, result.stderr) == (1, "Error: Configure one with op/configure. [no_mission]\n")


def test_no_answer_ends_with_4(planner: FakePlanner, mission_file: str) -> None:
    assert ask(planner, "mission", "configure", mission_file).exit_code == 0
    planner.frozen.set()
    result = ask(planner, "mission", "show", "--timeout", "0.3")
    planner.frozen.clear()
    assert result.exit_code == 4
    assert "did not answer" in result.stderr


@pytest.mark.parametrize(
    ("name", "text"),
    [("bad.toml", "mission = "), ("bad.json", "{"), ("list.json", "[1]"), ("nan.toml", "alpha = nan")],
)
def test_a_configuration_that_cannot_be_read_ends_with_1(tmp_path: Path, name: str, text: str) -> None:
    path = tmp_path / name
    path.write_text(text)
    result = run("mission", "configure", str(path))
    assert result.exit_code == 1
    assert name in result.stderr


# --- missions ---


def test_a_mission_from_file_to_end(planner: FakePlanner, mission_file: str) -> None:
    assert "running" in ask(planner, "mission", "configure", mission_file, "--mission", "n", "--start").stdout
    shown = ask(planner, "mission", "show", "--json").stdout
    state = wire.from_json(wire.MissionState, shown)
    assert (state.mission, state.phase, state.config.alpha) == ("n", wire.Phase.RUNNING, 0.5)
    commands = (("pause", "paused"), ("resume", "running"), ("hold", "held"), ("complete", "completed"))
    for command, phase in commands:
        result = ask(planner, "mission", command, "--reason", "the test")
        assert result.exit_code == 0, result.stderr
        assert phase in result.stdout
    assert "25.0 %, 25 of 100 m2" in ask(planner, "mission", "show").stdout


def test_json_configurations_do_as_well(planner: FakePlanner, tmp_path: Path) -> None:
    path = tmp_path / "mission.json"
    path.write_text(json.dumps({"mission": "j", "target": {"facets": [FACET]}}))
    assert ask(planner, "mission", "configure", str(path)).exit_code == 0
    assert planner.config is not None
    assert planner.config.mission == "j"


def test_watch_prints_a_line_for_each_change(planner: FakePlanner, mission_file: str) -> None:
    ask(planner, "mission", "configure", mission_file)
    lines = ask(planner, "watch", "--for", "0.5").stdout.splitlines()
    assert lines[0].endswith("m configured  U 0.500  covered 25.0 %  keyframes 0  decisions 0  revisits 0")
    first = json.loads(ask(planner, "watch", "--for", "0.5", "--json").stdout.splitlines()[0])
    assert first["state"]["mission"] == "m"


def test_watch_ends_with_the_mission(planner: FakePlanner, mission_file: str) -> None:
    ask(planner, "mission", "configure", mission_file)
    ask(planner, "mission", "complete")
    assert ask(planner, "watch", "--until-ended").exit_code == 0
    ask(planner, "mission", "abort")
    result = ask(planner, "watch", "--until-ended")
    assert result.exit_code == 1
    assert "was aborted" in result.stderr


# --- importing ---


def test_a_pose_graph_arrives_as_a_vehicle_would_send_it(planner: FakePlanner, tmp_path: Path) -> None:
    path = tmp_path / "loop.g2o"
    path.write_text(
        "VERTEX_SE3:QUAT 3 1 2 3 0 0 0.6 0.8\n"
        f"EDGE_SE3:QUAT 3 4 1 0 0 0 0 0 1 {INFORMATION}\n"
        f"EDGE_SE3:QUAT 5 3 0 0 0 0 0 0.6 0.8 {INFORMATION}\n"
        f"EDGE_SE3:QUAT 4 5 1 0 0 0 0 0 1 {INFORMATION}\n"
    )
    result = ask(planner, "import-g2o", str(path), "--mission", "loop", "--json", "--anchor-sigma", "0.01")
    assert result.exit_code == 0, result.stderr
    report = json.loads(result.stdout)
    assert (report["mission"], report["keyframes"], report["edges"], report["last_keyframe"]) == (
        "loop",
        3,
        3,
        5,
    )
    events = planner.applied.events
    names = [e.id if isinstance(e, wire.Keyframe) else type(getattr(e, "factor", e)).__name__ for e in events]
    assert names == [3, "Prior", 4, "Relative", 5, "Relative", "Relative"]
    first, prior, _, _, _, step, closure = events
    assert first == wire.Keyframe(
        mission="loop", seq=0, stamp_ns=first.stamp_ns, id=3, appearance=wire.Appearance.None_()
    )
    assert isinstance(prior, wire.Factor)
    assert isinstance(step, wire.Factor)
    assert isinstance(closure, wire.Factor)
    anchor = wire.Pose(translation=(1.0, 2.0, 3.0), rotation=(0.0, 0.0, 0.6, 0.8))
    assert prior.factor == wire.FactorKind.Prior(3, anchor, wire.row_major(1e-4 * np.eye(6)))
    assert isinstance(step.factor, wire.FactorKind.Relative)
    assert (step.factor.from_, step.factor.to) == (4, 5)
    variances = 1.0 / np.array([100, 90, 80, 25, 24, 23])
    np.testing.assert_allclose(np.reshape(step.factor.covariance, (6, 6)), np.diag(variances), rtol=1e-14)
    assert isinstance(closure.factor, wire.FactorKind.Relative)
    assert (closure.factor.from_, closure.factor.to) == (5, 3)
    assert planner.phase is wire.Phase.COMPLETED
    assert planner.config is not None
    assert planner.config.first_keyframe_sigmas is None


def test_a_pose_graph_that_is_none_ends_with_1(tmp_path: Path) -> None:
    path = tmp_path / "landmarks.g2o"
    path.write_text("VERTEX_XY 0 1 2\n")
    result = run("import", str(path))
    assert result.exit_code == 1
    assert "landmarks.g2o:1: the file ends here, and there is no edge in it" in result.stderr


# --- several endpoints ---


@pytest.mark.parametrize("given", ["twice", "commas", "environment"])
def test_endpoints_are_tried_in_turn_and_the_second_is_told(
    planner: FakePlanner, monkeypatch: pytest.MonkeyPatch, given: str
) -> None:
    dead = "tcp/127.0.0.1:9"
    ask(planner, "mission", "show")
    options = {
        "twice": ["-e", dead, "-e", planner.endpoint],
        "commas": ["-e", f"{dead}, {planner.endpoint}"],
        "environment": [],
    }[given]
    if given == "environment":
        monkeypatch.setenv("PDN_CONNECT", f"{dead},{planner.endpoint}")
    result = run("mission", "show", "--vehicle", "auv", "--timeout", "1", *options)
    assert f"connected to {planner.endpoint}; {dead} does not serve" in result.stderr
    assert "no_mission" in result.stderr
    none = run("mission", "show", "--vehicle", "auv", "--timeout", "0.5", "-e", dead, "-e", "tcp/127.0.0.1:1")
    assert none.exit_code == 3
    assert none.stderr.count("nothing listens there") == 2
