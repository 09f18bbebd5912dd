"""When a vehicle leaves its survey for a revisit, and by which way."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from pdn.sim.planner import Decision, Fix, Planner
from pdn.sim.scenario import Scenario
from pdn.sim.se3 import Array, Pose, wrap_rad
from pdn.sim.survey import Survey, Viewpoint

POLICIES = ("open-loop", "exhaustive", "pdn")


@dataclass(frozen=True)
class Detour:
    """A round trip off the survey."""

    viewpoints: list[Viewpoint]
    """Where to take keyframes, out and back; empty to stay on the survey."""
    waypoint: int | None
    """The keyframe revisited, where the planner chose one."""


class Policy(Protocol):
    """Asked after each keyframe of the survey."""

    decisions: int
    """Decisions asked of the planner so far."""

    def detour(self, index: int, fix: Fix) -> Detour | None:
        """The detour to make from the survey's keyframe ``index``, or null to go on."""
        ...


def policy_of(name: str, scenario: Scenario, survey: Survey, planner: Planner) -> Policy:
    """The policy of that name."""
    if name == "open-loop":
        return OpenLoop()
    if name == "exhaustive":
        return Exhaustive(survey)
    if name == "pdn":
        return PerceptionDriven(scenario, survey, planner)
    raise ValueError(f"there is no policy {name!r}; known are {', '.join(POLICIES)}")


class OpenLoop:
    """Never leaves the survey."""

    decisions = 0

    def detour(self, index: int, fix: Fix) -> Detour | None:  # noqa: ARG002
        """See ``Policy``."""
        return None


class Exhaustive:
    """At the end of every other trackline, straight to the first one and back."""

    decisions = 0

    def __init__(self, survey: Survey) -> None:
        self._survey = survey

    def detour(self, index: int, fix: Fix) -> Detour | None:  # noqa: ARG002
        """See ``Policy``."""
        point = self._survey.points[index]
        if not point.ends_line or point.line % 2 == 0:
            return None
        return Detour(self._survey.to_first_line(point.line), None)


class PerceptionDriven:
    """Asks the planner at each so many keyframes and does what it says [PDN12, III]."""

    def __init__(self, scenario: Scenario, survey: Survey, planner: Planner) -> None:
        self._every = scenario.survey.decision_every
        self._spacing = scenario.survey.keyframe_spacing_m
        self._points = survey.points
        self._planner = planner
        self.decisions = 0

    def detour(self, index: int, fix: Fix) -> Detour | None:
        """See ``Policy``.

        Keyframes count from the beginning of each trackline, so that none is asked right after a turn: the
        step just made stands for the next one there, and a turn's is longer. Nor at the survey's last
        keyframe, where no choice is left.
        """
        number = self._points[index].number_on_line
        if not number or number % self._every != 0 or index + 1 == len(self._points):
            return None
        decision: Decision = self._planner.decide()
        self.decisions += 1
        if decision.revisit is None:
            return None
        return Detour(viewpoints_along(fix.pose, decision.route, self._spacing), decision.revisit)


def viewpoints_along(start: Pose, route: tuple[Pose, ...], spacing_m: float) -> list[Viewpoint]:
    """Places of equal distance, at most ``spacing_m``, along a polyline of poses; the last is the route's
    end.

    Headings turn evenly between the poses.
    """
    places: Array = np.array([start.translation, *(pose.translation for pose in route)])
    headings = [start.heading_rad(), *(pose.heading_rad() for pose in route)]
    unrolled = [headings[0]]
    for heading in headings[1:]:
        unrolled.append(unrolled[-1] + wrap_rad(heading - unrolled[-1]))
    gone = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])
    pieces = max(1, math.ceil(float(gone[-1]) / spacing_m - 1e-9))
    wanted = np.linspace(0.0, float(gone[-1]), pieces + 1)[1:]
    columns = [np.interp(wanted, gone, places[:, axis]) for axis in range(3)]
    turned = np.interp(wanted, gone, np.array(unrolled))
    return [
        Viewpoint(np.array([x, y, z]), wrap_rad(float(h)), spacing_m)
        for x, y, z, h in zip(*columns, turned, strict=True)
    ]
