"""What an operator reads: missions and decisions in words and bars, without colours."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence

from pdn import wire

BAR_CELLS = 24


def bar(value: float, full: float, mark: float | None = None) -> str:
    """A bar of `value` out of `full`, with a line at `mark`: `bar(0.5, 1.0)` is half filled."""
    cells = ["█" if (cell + 0.5) / BAR_CELLS * full <= value else "░" for cell in range(BAR_CELLS)]
    if mark is not None and 0.0 < mark < full:
        cells[min(BAR_CELLS - 1, round(mark / full * BAR_CELLS))] = "│"
    return "".join(cells)


def uncertainty(state: wire.MissionState) -> str:
    """The robot's uncertainty against the allowance, which is 1."""
    if state.uncertainty is None:
        return f"{bar(0.0, 1.5, 1.0)}  no keyframe yet"
    verdict = "within the allowance" if state.uncertainty < 1.0 else "OVER the allowance"
    return f"{bar(state.uncertainty, 1.5, 1.0)}  {state.uncertainty:.3f} of 1, {verdict}"


def coverage(state: wire.MissionState) -> str:
    """The photographed share of the target."""
    share = state.covered_m2 / state.target_m2 if state.target_m2 > 0.0 else 0.0
    ahead = state.estimated_remaining_m
    remaining = "" if ahead is None else f", {ahead:.0f} m of survey ahead"
    areas = f"{state.covered_m2:.0f} of {state.target_m2:.0f} m2"
    return f"{bar(share, 1.0)}  {100.0 * share:.1f} %, {areas}{remaining}"


def robot(state: wire.MissionState) -> str:
    """Where the vehicle believes to be, and how surely (one standard deviation)."""
    if state.robot is None:
        return "not known yet"
    north, east, depth = state.robot.pose.translation
    metres, degrees = sigmas(state.robot.covariance)
    return (
        f"keyframe {state.robot.keyframe} at N {north:.2f}  E {east:.2f}  D {depth:.2f} m"
        f"  ± {_joined(metres, 3)} m, {_joined(degrees, 2)} deg"
    )


def phase(state: wire.MissionState) -> str:
    """The phase, since when and why."""
    since = time.strftime("%H:%M:%S", time.localtime(state.since_ns / 1e9))
    because = f": {state.reason}" if state.reason else ""
    return f"{state.phase} since {since}{because}"


def counts(state: wire.MissionState) -> str:
    """The size of the graph and the decisions."""
    return (
        f"{state.keyframes} keyframes, {state.factors} factors, {state.next_seq} events; "
        f"{state.decisions} decisions, {state.revisits} of them revisits"
    )


def summary(state: wire.MissionState) -> list[tuple[str, str]]:
    """A mission as rows of a heading and a line."""
    rows = [
        ("mission", state.mission),
        ("phase", phase(state)),
        ("uncertainty", uncertainty(state)),
        ("covered", coverage(state)),
        ("position", robot(state)),
        ("graph", counts(state)),
    ]
    return rows + [("attention", finding) for finding in state.health.findings]


def one_line(state: wire.MissionState) -> str:
    """A mission for a log."""
    share = 100.0 * state.covered_m2 / state.target_m2 if state.target_m2 > 0.0 else 0.0
    ratio = "-" if state.uncertainty is None else f"{state.uncertainty:.3f}"
    return (
        f"{state.mission} {state.phase}  U {ratio}  covered {share:.1f} %  keyframes {state.keyframes}"
        f"  decisions {state.decisions}  revisits {state.revisits}"
    )


def decision(given: wire.Decision) -> str:
    """A decision in one line."""
    number = "what if" if given.decision is None else f"decision {given.decision}"
    match given.action:
        case wire.Action.Revisit(keyframe=keyframe):
            action = f"REVISIT keyframe {keyframe}"
        case _:
            action = "EXPLORE"
    return f"{number}: {action}. {given.reason}"


def refusal(problem: wire.Problem) -> str:
    """A refused event in one line."""
    which = "an event that could not be read" if problem.seq is None else f"event {problem.seq}"
    return f"{which} refused [{problem.code}]: {problem.message}"


def sigmas(covariance: Sequence[float]) -> tuple[list[float], list[float]]:
    """Standard deviations of a 6x6 row-major covariance: three in m, three in deg."""
    roots = [math.sqrt(max(0.0, covariance[7 * index])) for index in range(6)]
    return roots[:3], [math.degrees(root) for root in roots[3:]]


def _joined(values: Sequence[float], digits: int) -> str:
    return " ".join(f"{value:.{digits}f}" for value in values)
