"""What a vehicle tells and asks the planning service, as the simulator sees it.

``remote`` speaks it over Zenoh; tests fly against a filter of their own.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from pdn.sim.hardware import Attitude, Depth, Image, Odometry, Registration
from pdn.sim.se3 import Array, Pose


@dataclass(frozen=True)
class Fix:
    """Where the service believes the newest keyframe to be."""

    keyframe: int
    pose: Pose
    covariance: Array
    """6x6."""
    uncertainty: float
    """(|Sigma| / |Sigma_allow|)^(1/6)."""
    covered_m2: float


@dataclass(frozen=True)
class Decision:
    """A decision."""

    revisit: int | None
    """The waypoint's keyframe; null to go on."""
    route: tuple[Pose, ...]
    """World poses of the round trip, the last one where the vehicle is now; empty to go on."""
    uncertainty: float
    """U^0 of going on."""
    candidates: int


class Planner(Protocol):
    """The service, for one mission that runs."""

    def keyframe(self, number: int, pose: Pose | None, body_from_camera: Pose, image: Image) -> None:
        """Announce a keyframe; the pose is null where the odometry will tell it."""
        ...

    def odometry(self, older: int, newer: int, measured: Odometry) -> None:
        """Send a step of dead reckoning."""
        ...

    def attitude(self, number: int, measured: Attitude) -> None:
        """Send an attitude."""
        ...

    def depth(self, number: int, measured: Depth) -> None:
        """Send a depth."""
        ...

    def registration(self, older: int, newer: int, measured: Registration | None) -> None:
        """Send the outcome of a try, and its measurement if it succeeded."""
        ...

    def fix(self) -> Fix:
        """The newest keyframe's estimate once all that was sent is applied."""
        ...

    def estimates(self) -> list[Pose]:
        """Estimates of all keyframes, by number."""
        ...

    def decide(self) -> Decision:
        """Explore or revisit."""
        ...

    def refused(self) -> list[str]:
        """What the service refused of what was sent, one line each."""
        ...
