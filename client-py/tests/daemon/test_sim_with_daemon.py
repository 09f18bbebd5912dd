"""Simulated vehicles against the real daemon."""

from __future__ import annotations

import dataclasses
import json
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from running import Daemon
from typer.testing import CliRunner

from pdn.cli import build
from pdn.client import connect
from pdn.sim import flight, remote, scenario_file
from pdn.sim.record import Run
from pdn.sim.scenario import Scenario

sys.path.insert(0, str(Path(__file__).parents[1] / "sim"))
from filter_planner import FilterPlanner

FLOOR = scenario_file.load("seafloor")
SHORT = dataclasses.replace(FLOOR, survey=dataclasses.replace(FLOOR.survey, lines=4))
STRICT = dataclasses.replace(
    SHORT, config={**SHORT.config, "allowable": {**SHORT.config["allowable"], "x_m": 0.11, "y_m": 0.11}}
)
NO_LINKS = dataclasses.replace(SHORT.links, rate_both=0.0, rate_one=0.0, rate_none=0.0)
BLIND = dataclasses.replace(SHORT, links=NO_LINKS)


def fly(daemon: Daemon, scenario: Scenario, mission: str, policy: str, alpha: float = 1.0) -> Run:
    with (
        connect("sim", daemon.endpoint) as client,
        remote.mission(client, scenario, mission, alpha) as planner,
    ):
        run = flight.fly(scenario, policy, alpha, 1, planner)
    with connect("sim", daemon.endpoint) as client:
        assert client.mission(mission=mission).phase == "completed"
    assert run.refused == []
    return run


def comparable(run: Run) -> str:
    document = dataclasses.asdict(run)
    for name in ("wall_s", "policy", "alpha", "decisions"):
        document["result"].pop(name)
    return json.dumps(document)


@pytest.mark.timeout(300)
def test_without_registrations_the_daemon_agrees_with_a_filter(daemon: Daemon) -> None:
    """Odometry, attitude and depth alone make a chain, for which a Kalman filter is the exact solution."""
    run = fly(daemon, BLIND, "blind", "open-loop")
    filtered = flight.fly(BLIND, "open-loop", 1.0, 1, FilterPlanner(BLIND))
    # The two linearise at places up to a centimetre and a tenth of a degree apart.
    np.testing.assert_allclose(run.course.uncertainty, filtered.course.uncertainty, rtol=1e-3)
    np.testing.assert_allclose(run.course.nees[-1], filtered.course.nees[-1], rtol=0.05)
    assert run.result.path_m == pytest.approx(filtered.result.path_m, rel=1e-4)


@pytest.mark.timeout(300)
def test_the_same_seed_is_the_same_mission_and_alpha_0_is_open_loop(daemon: Daemon) -> None:
    first, again = (fly(daemon, SHORT, name, "open-loop") for name in ("first", "again"))
    exploring = fly(daemon, SHORT, "exploring", "pdn", alpha=0.0)
    assert comparable(first) == comparable(again) == comparable(exploring)
    assert exploring.result.decisions == 48


@pytest.mark.timeout(300)
def test_a_strict_allowance_brings_the_vehicle_back_to_what_it_knows(daemon: Daemon) -> None:
    run = fly(daemon, STRICT, "strict", "pdn")
    assert run.detours
    for detour in run.detours:
        taken = slice(detour["first"], detour["last"] + 1)
        assert run.course.local_saliency[detour["waypoint"]] > 0.5
        assert sum(run.course.links_registered[taken]) > 0
    # Registrations are drawn: a single detour may find few, all of them together must pay.
    gains = [detour["uncertainty_before"] - detour["uncertainty_after"] for detour in run.detours]
    assert sum(gains) > 0
    open_loop = fly(daemon, STRICT, "plain", "open-loop")
    assert run.result.max_uncertainty < open_loop.result.max_uncertainty
    assert run.result.path_m > open_loop.result.path_m
    # The raster and the truth differ by the drift only: centimetres along the edge of 125 m of swath.
    assert run.result.covered_believed_m2 == pytest.approx(run.result.covered_true_m2, rel=0.05)


@pytest.mark.timeout(300)
def test_the_command_leaves_a_run(daemon: Daemon, tmp_path: Path) -> None:
    text = (Path(scenario_file.__file__).parent / "scenarios" / "seafloor.toml").read_text(encoding="utf-8")
    (tmp_path / "two-lines.toml").write_text(text.replace("lines = 12", "lines = 2"), encoding="utf-8")
    out = tmp_path / "run.json"
    arguments = ["sim", str(tmp_path / "two-lines.toml"), "--out", str(out), "--json", "-e", daemon.endpoint]
    done = CliRunner().invoke(build(), arguments)
    assert done.exit_code == 0, done.output
    result = json.loads(done.output)
    assert result == json.loads(out.read_text())["result"]
    assert (result["scenario"], result["policy"], result["seed"]) == ("seafloor", "pdn", 1)


@pytest.mark.timeout(300)
def test_a_vehicle_waits_while_its_mission_is_held_and_flies_on_as_if_nothing_had_been(
    daemon: Daemon,
) -> None:
    """The daemon is killed in the middle of a mission, comes back with it held, and an operator resumes."""
    expected = fly(daemon, STRICT, "calm", "pdn")
    flown: list[Run] = []
    vehicle = threading.Thread(target=lambda: flown.append(fly(daemon, STRICT, "disturbed", "pdn")))
    vehicle.start()
    with connect("sim", daemon.endpoint) as operator:
        end = time.monotonic() + 60.0
        while operator.mission().mission != "disturbed" or operator.mission().keyframes < 60:
            assert time.monotonic() < end
    daemon.kill()
    daemon.start()
    with connect("sim", daemon.endpoint) as operator:
        state = operator.mission()
        assert (state.mission, state.phase) == ("disturbed", "held")
        operator.resume("the power is back")
    vehicle.join(120.0)
    assert flown, "the vehicle has not landed"
    assert comparable(flown[0]) == comparable(expected)
    assert flown[0].result.decisions == expected.result.decisions
