"""Run files, read for drawing."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

RUN_FORMAT = "pdn-run-1"


class RunError(ValueError):
    """A file that is no run, or runs that do not make the figure; the message says which and why."""


@dataclass(frozen=True)
class Run:
    """A flight, its course as arrays of one entry a keyframe."""

    result: dict[str, Any]
    """The figures of the mission, as in the simulator's record."""
    path_m: Array
    uncertainty: Array
    nees: Array
    remaining: Array
    """Share of the target not yet covered, as the service believes."""
    remaining_true: Array
    revisit: Flags
    salient: Flags
    links_registered: Array
    position_error_m: Array
    estimated: Array
    """n x 2, m, on the sheet."""
    true: Array
    """n x 2, m, on the sheet."""
    starts: list[int]
    """Number of the last keyframe before each revisit."""
    sheet: dict[str, Any]

    @property
    def policy(self) -> str:
        """open-loop, exhaustive or pdn."""
        return str(self.result["policy"])

    @property
    def alpha(self) -> float:
        """Weight of the uncertainty."""
        return float(self.result["alpha"])

    @property
    def label(self) -> str:
        """For a legend."""
        names = {"open-loop": "open loop", "exhaustive": "exhaustive"}
        return names.get(self.policy, f"PDN, \N{GREEK SMALL LETTER ALPHA} = {self.alpha:g}")


def load(path: Path) -> Run:
    """Read a run file; refuses anything else with its name."""
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise RunError(f"there is no run file {path}") from error
    except ValueError as error:
        raise RunError(f"{path} is not JSON") from error
    if not isinstance(document, dict) or document.get("format") != RUN_FORMAT:
        raise RunError(f"{path} is no run of the simulator; make one with: pdn sim hull40 --out {path}")
    course = document["course"]
    target = float(document["result"]["target_m2"])

    def column(name: str) -> Array:
        return np.asarray(course[name], dtype=float)

    return Run(
        result=document["result"],
        path_m=column("path_m"),
        uncertainty=column("uncertainty"),
        nees=column("nees"),
        remaining=1.0 - column("covered_believed_m2") / target,
        remaining_true=1.0 - column("covered_true_m2") / target,
        revisit=np.asarray(course["revisit"], dtype=bool),
        salient=column("local_saliency") >= 0.5,
        links_registered=column("links_registered"),
        position_error_m=column("position_error_m"),
        estimated=np.asarray(document["estimated"], dtype=float)[:, 3:],
        true=np.asarray(document["true"], dtype=float)[:, 3:],
        starts=[int(d["first"]) - 1 for d in document["detours"]],
        sheet=document["sheet"],
    )


def pick(runs: list[Run], policy: str, alpha: float | None = None) -> Run:
    """The run of a policy (and weight) among several; says what is missing."""
    for run in runs:
        if run.policy == policy and (alpha is None or abs(run.alpha - alpha) < 1e-9):
            return run
    wanted = policy if alpha is None else f"{policy} with alpha {alpha:g}"
    have = ", ".join(run.label for run in runs) or "none"
    raise RunError(f"the figure needs a run of {wanted}; given are: {have}")
