"""What a flight leaves: the figures of a mission, and its course keyframe by keyframe, as one JSON file."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from pdn import files
from pdn.sim.scenario import Scenario
from pdn.sim.se3 import Array, Pose, log
from pdn.sim.survey import Survey

RUN_FORMAT = "pdn-run-1"


@dataclass(frozen=True)
class Result:
    """The figures of a mission."""

    scenario: str
    policy: str
    alpha: float
    seed: int
    revisits: int
    path_m: float
    """True length of the way."""
    max_uncertainty: float
    """Greatest (|Sigma| / |Sigma_allow|)^(1/6) of the robot over the keyframes."""
    final_uncertainty: float
    position_rmse_m: float
    """Of the final estimates of all keyframes against the truth, over three axes."""
    nees: float
    """Error of the last pose squared in its own covariance; 6 on the average if that is true."""
    covered_believed_m2: float
    covered_true_m2: float
    target_m2: float
    decisions: int
    wall_s: float


@dataclass
class Course:
    """One entry a keyframe, in order."""

    path_m: list[float] = field(default_factory=list)
    uncertainty: list[float] = field(default_factory=list)
    nees: list[float] = field(default_factory=list)
    """Of the newest keyframe at its time."""
    covered_believed_m2: list[float] = field(default_factory=list)
    covered_true_m2: list[float] = field(default_factory=list)
    revisit: list[bool] = field(default_factory=list)
    """Whether the keyframe was taken off the survey."""
    local_saliency: list[float] = field(default_factory=list)
    links_tried: list[int] = field(default_factory=list)
    links_registered: list[int] = field(default_factory=list)
    position_error_m: list[float] = field(default_factory=list)
    """Of the newest keyframe at its time."""


@dataclass(frozen=True)
class Run:
    """A flight."""

    result: Result
    course: Course
    detours: list[dict[str, Any]]
    """For each revisit: its first and last keyframe, the waypoint's keyframe or null, and U before and
    after."""
    sheet: dict[str, Any]
    """The unwrapped surface: facets, regions and tracklines, m."""
    estimated: list[list[float]]
    """Final estimates of the keyframes: x, y, z in the world, then u, v on the sheet, m."""
    true: list[list[float]]
    """The truth, likewise."""
    refused: list[str]
    """Events that the planner refused, one line each."""


def save(run: Run, path: Path) -> None:
    """Write a run; the file is small enough (about 1 MB) to keep one for each flight."""
    document = {"format": RUN_FORMAT, **asdict(run)}
    files.make_folder(path.parent)
    files.write_text(path, json.dumps(document, separators=(",", ":"), allow_nan=False) + "\n")


def nees(estimate: Pose, covariance: Array, truth: Pose) -> float:
    """``e' Sigma^-1 e`` with ``truth = estimate Exp(e)``: chi-squared with 6 degrees of freedom if Sigma is
    true."""
    error = log(estimate.inverse() @ truth)
    return float(error @ np.linalg.solve(covariance, error))


def position_rmse_m(estimates: Sequence[Pose], truth: Sequence[Pose]) -> float:
    """Root mean square distance of the estimated places from the true ones."""
    difference = np.array([e.translation - t.translation for e, t in zip(estimates, truth, strict=True)])
    return float(np.sqrt(np.mean(np.sum(difference**2, axis=1))))


def sheet_of(scenario: Scenario, survey: Survey) -> dict[str, Any]:
    """The unwrapped surface for drawing."""
    return {
        "facets": [
            {"name": f.name, "u_m": list(f.unwrapped_u_m), "v_m": list(f.unwrapped_v_m)}
            for f in scenario.surface.facets
        ],
        "regions": [
            {"centre_m": list(r.centre_m), "half_axes_m": list(r.half_axes_m)} for r in scenario.regions
        ],
        "lines_v_m": survey.lines_v_m,
    }


def places(scenario: Scenario, poses: Sequence[Pose]) -> list[list[float]]:
    """World position and place on the sheet of each pose, to a millimetre."""
    points = np.array([pose.translation for pose in poses])
    projection = scenario.surface.nearest(points)
    rows: list[list[float]] = np.round(np.concatenate([points, projection.unwrapped], axis=1), 3).tolist()
    return rows
