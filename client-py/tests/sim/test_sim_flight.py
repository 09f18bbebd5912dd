"""Whole flights against a filter instead of the service."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from filter_planner import FilterPlanner

from pdn.sim import flight, record, scenario_file
from pdn.sim.planner import Decision
from pdn.sim.record import Run
from pdn.sim.scenario import Scenario

FLOOR = scenario_file.load("seafloor")
SHORT = dataclasses.replace(FLOOR, survey=dataclasses.replace(FLOOR.survey, lines=4))


def fly(seed: int, policy: str = "open-loop", scenario: Scenario = SHORT, **options: object) -> Run:
    return flight.fly(scenario, policy, 1.0, seed, FilterPlanner(scenario, **options))


def comparable(run: Run) -> str:
    document = dataclasses.asdict(run)
    document["result"]["wall_s"] = 0.0
    return json.dumps(document)


def test_the_same_seed_is_the_same_mission() -> None:
    assert comparable(fly(1)) == comparable(fly(1))
    assert comparable(fly(1)) != comparable(fly(2))


def test_exploring_always_is_open_loop() -> None:
    never, asked = fly(1), fly(1, "pdn")
    assert never.course == asked.course
    # 4 lines of 50 steps: every 4th keyframe of each.
    assert (never.result.decisions, asked.result.decisions) == (0, 48)


def test_the_estimate_s_covariance_is_true() -> None:
    """The NEES of the last pose over the seeds lies in its 99.9 % interval, and so does the drift."""
    runs = [fly(seed) for seed in range(1, 13)]
    total = sum(run.result.nees for run in runs)
    # Chi-squared with 6 * 12 degrees of freedom: mean 72, deviation 12; 3.3 deviations.
    assert abs(total - 72.0) < 3.3 * 12.0
    drift = np.sqrt(np.mean([run.course.position_error_m[-1] ** 2 for run in runs]))
    # 0.012 m per square root of metre on two axes over 125 m is 0.19 m; 24 squares vary by a third.
    assert 0.11 < drift < 0.27


def test_the_true_track_drifts_while_the_believed_one_stays_on_the_plan() -> None:
    run = fly(3)
    nominal = np.array([p.viewpoint.position for p in flight.Survey(SHORT).points])
    estimated, true = np.array(run.estimated)[:, :3], np.array(run.true)[:, :3]
    assert np.abs(estimated - nominal).max() < 0.06
    assert np.linalg.norm(true - nominal, axis=1)[-40:].max() > 2 * np.abs(estimated - nominal).max()


def test_a_revisit_follows_the_route_and_comes_back() -> None:
    class Once(FilterPlanner):
        asked = 0

        def decide(self) -> Decision:
            self.asked += 1
            if self.asked != 10:
                return Decision(None, (), 0.0, 1)
            out = self._poses[20:-1][::-1]
            return Decision(20, (*out, *out[::-1], self._poses[-1]), 1.2, 1)

    run = flight.fly(SHORT, "pdn", 1.0, 1, Once(SHORT))
    (detour,) = run.detours
    assert (run.result.revisits, detour["waypoint"]) == (1, 20)
    revisit = np.array(run.course.revisit)
    assert revisit.sum() == detour["last"] - detour["first"] + 1
    assert revisit[detour["first"] : detour["last"] + 1].all()
    places = np.array(run.estimated)[:, :3]
    assert np.linalg.norm(places[revisit] - places[20], axis=1).min() < 0.3
    assert np.linalg.norm(places[detour["last"]] - places[detour["first"] - 1]) < 0.1
    # 20 keyframes back and as many forth, 0.6 m each.
    assert run.result.path_m - fly(1).result.path_m == pytest.approx(2 * 20 * 0.6, rel=0.03)


def test_every_try_is_told_and_every_success_measured() -> None:
    planner = FilterPlanner(SHORT)
    run = flight.fly(SHORT, "open-loop", 1.0, 1, planner)
    told = [what for kind, what in planner.told if kind == "registration"]
    assert len(told) == sum(run.course.links_tried)
    assert sum(measured is not None for *_, measured in told) == sum(run.course.links_registered)
    assert sum(run.course.links_registered) > 10
    assert all(older < newer for older, newer, _ in told)  # type: ignore[misc]


def test_proposals_keep_the_scenario_s_bounds() -> None:
    planner = FilterPlanner(SHORT)
    flight.fly(SHORT, "exhaustive", 1.0, 1, planner)
    per_keyframe: dict[int, int] = {}
    for kind, what in planner.told:
        if kind != "registration":
            continue
        older, newer, _ = what  # type: ignore[misc]
        per_keyframe[newer] = per_keyframe.get(newer, 0) + 1
        baseline = np.linalg.norm(
            planner.estimates()[older].translation - planner.estimates()[newer].translation
        )
        # The proposal was made by dead reckoning, before attitude and depth moved the pose by centimetres.
        assert 0.3 - 0.06 <= baseline <= 1.1 + 0.06
    assert max(per_keyframe.values()) == SHORT.links.max_links


def test_a_run_file_holds_the_figures(tmp_path: Path) -> None:
    run = fly(1)
    record.save(run, tmp_path / "a" / "run.json")
    document = json.loads((tmp_path / "a" / "run.json").read_text())
    assert document["format"] == "pdn-run-1"
    assert set(document["result"]) >= {
        "scenario",
        "policy",
        "alpha",
        "seed",
        "revisits",
        "path_m",
        "nees",
        "wall_s",
    }
    count = len(document["course"]["path_m"])
    assert all(len(column) == count for column in document["course"].values())
    assert len(document["estimated"]) == len(document["true"]) == count


def test_the_mission_s_configuration_states_the_noise_that_is_drawn() -> None:
    hull = scenario_file.load("hull40")
    config = flight.mission_config(hull, "m", 0.5)
    assert (config["mission"], config["alpha"]) == ("m", 0.5)
    assert config["odometry"]["translation_sigma_m_per_sqrt_m"] == hull.noise.odometry[:3].tolist()
    assert len(config["target"]["facets"]) == 2
    assert config["survey"][0] == [0.0, -1.5, 0.6]
    assert "config" not in config
