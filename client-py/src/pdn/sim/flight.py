"""A whole mission: the vehicle flies its survey under a policy while the truth is kept beside it and
scored."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np

from pdn.sim.coverage import Raster
from pdn.sim.planner import Fix, Planner
from pdn.sim.policies import policy_of
from pdn.sim.record import Course, Result, Run, nees, places, position_rmse_m, sheet_of
from pdn.sim.scenario import Scenario, Table
from pdn.sim.survey import Survey
from pdn.sim.vehicle import Vehicle, body_from_camera
from pdn.sim.world import World, start_pose

Progress = Callable[[int, int], None]
"""Told after each keyframe of the survey: how many are flown, of how many."""


def mission_config(scenario: Scenario, mission: str, alpha: float) -> Table:
    """The configuration of a mission over this scenario, in the contract's JSON form."""
    survey = Survey(scenario)
    camera = body_from_camera(scenario, survey.points[0].viewpoint)
    config = dict(scenario.config)
    config["camera"] = {
        **config["camera"],
        "body_from_camera": {"translation": [0.0, 0.0, 0.0], "rotation": camera.quaternion()},
    }
    config["mission"] = mission
    config["alpha"] = alpha
    config["survey"] = [vertex.tolist() for vertex in survey.vertices]
    return config


def fly(
    scenario: Scenario,
    policy_name: str,
    alpha: float,
    seed: int,
    planner: Planner,
    progress: Progress | None = None,
) -> Run:
    """Fly one mission that is configured and running, to the end of the survey."""
    began = time.monotonic()
    survey = Survey(scenario)
    first = survey.points[0].viewpoint
    world = World(scenario, start_pose(first.position, first.heading_rad), seed)
    scorer = _Scorer(scenario, world)
    vehicle = Vehicle(scenario, world, planner, scorer.add)
    policy = policy_of(policy_name, scenario, survey, planner)
    for index, point in enumerate(survey.points):
        if index == 0:
            vehicle.begin(point.viewpoint)
        else:
            vehicle.go_to(point.viewpoint)
        detour = policy.detour(index, vehicle.fix)
        if detour is not None:
            with scorer.detour(detour.waypoint):
                for viewpoint in detour.viewpoints:
                    vehicle.go_to(viewpoint)
        if progress is not None:
            progress(index + 1, len(survey.points))
    estimates = planner.estimates()
    course = scorer.course
    result = Result(
        scenario=scenario.name,
        policy=policy_name,
        alpha=alpha,
        seed=seed,
        revisits=len(scorer.detours),
        path_m=world.path_m[-1],
        max_uncertainty=max(course.uncertainty),
        final_uncertainty=course.uncertainty[-1],
        position_rmse_m=position_rmse_m(estimates, world.poses),
        nees=course.nees[-1],
        covered_believed_m2=course.covered_believed_m2[-1],
        covered_true_m2=course.covered_true_m2[-1],
        target_m2=scenario.config["target"]["area_m2"] or scenario.surface.area_m2,
        decisions=policy.decisions,
        wall_s=time.monotonic() - began,
    )
    return Run(
        result,
        course,
        scorer.detours,
        sheet_of(scenario, survey),
        places(scenario, estimates),
        places(scenario, world.poses),
        planner.refused(),
    )


class _Scorer:
    """Compares each fix with the truth when it comes."""

    def __init__(self, scenario: Scenario, world: World) -> None:
        self._world = world
        self._raster = Raster(scenario)
        self._off_survey = False
        self.course = Course()
        self.detours: list[Table] = []

    def add(self, fix: Fix) -> None:
        world, course, number = self._world, self.course, fix.keyframe
        truth = world.poses[number]
        self._raster.add(world.cameras[number])
        course.path_m.append(round(world.path_m[number], 4))
        course.uncertainty.append(fix.uncertainty)
        course.nees.append(nees(fix.pose, fix.covariance, truth))
        course.covered_believed_m2.append(fix.covered_m2)
        course.covered_true_m2.append(round(self._raster.covered_m2(), 4))
        course.revisit.append(self._off_survey)
        course.local_saliency.append(world.images[number].local)
        course.links_tried.append(world.tried[number])
        course.links_registered.append(world.registered[number])
        course.position_error_m.append(float(np.linalg.norm(fix.pose.translation - truth.translation)))

    @contextmanager
    def detour(self, waypoint: int | None) -> Iterator[None]:
        """Marks the keyframes taken inside as off the survey."""
        course = self.course
        first, before = len(course.path_m), course.uncertainty[-1]
        self._off_survey = True
        yield
        self._off_survey = False
        self.detours.append(
            {
                "first": first,
                "last": len(course.path_m) - 1,
                "waypoint": waypoint,
                "uncertainty_before": before,
                "uncertainty_after": course.uncertainty[-1],
            }
        )
