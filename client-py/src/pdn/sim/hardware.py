"""What a vehicle can do and measure: its hardware is all that stands between the vehicle and the world."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from pdn.sim.se3 import Array, Pose


@dataclass(frozen=True)
class Odometry:
    """Dead reckoning from the previous keyframe."""

    relative: Pose
    """Measured pose of this keyframe in the body frame of the previous one."""
    covariance: Array
    """6x6."""


@dataclass(frozen=True)
class Attitude:
    """Inclinometers and compass."""

    rotation: Array
    """3x3, measured ``world_from_body``."""
    tilt_variance_rad2: float
    heading_variance_rad2: float | None


@dataclass(frozen=True)
class Depth:
    """Pressure."""

    depth_m: float
    variance_m2: float


@dataclass(frozen=True)
class Image:
    """What the camera saw, as two scores."""

    local: float
    global_: float


@dataclass(frozen=True)
class Reading:
    """Everything that the sensors say at one keyframe; null where the vehicle has no such sensor."""

    odometry: Odometry | None
    """Null at the first keyframe."""
    attitude: Attitude | None
    depth: Depth | None
    image: Image


@dataclass(frozen=True)
class Registration:
    """Two images matched: the camera of the newer one seen from the camera of the older."""

    direction: Array
    """3, unit."""
    rotation: Array
    """3x3."""
    covariance: Array
    """5x5, rad: two direction components, then rotation."""


class Hardware(Protocol):
    """A vehicle's thrusters, tilting camera and sensors."""

    def begin(self, body_from_camera: Pose) -> tuple[Pose, Reading]:
        """Take keyframe 0 where the vehicle is; the pose is where it was told that it is, with the prior's
        error."""
        ...

    def move(self, displacement_in_body: Array, turn_rad: float, body_from_camera: Pose) -> Reading:
        """Go by a displacement (m, axes of the body as it now lies) and a change of heading, then take a
        keyframe.

        The vehicle's weight keeps it level; the camera has the commanded tilt when the image is taken.
        """
        ...

    def register(self, older: int, newer: int) -> Registration | None:
        """Try to match the images of two keyframes by number; null when they do not match."""
        ...
