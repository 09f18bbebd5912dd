"""The events of a mission, typed: what a vehicle calls for each keyframe, measurement and registration."""

from __future__ import annotations

import operator
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from pdn import wire

Covariance = NDArray[np.float64] | Sequence[float] | Sequence[Sequence[float]]
"""A square matrix, or its numbers row by row."""

STAMPS = 1 << 64
"""Times that an event can carry, ns since 1970."""

Event = wire.Keyframe | wire.Factor | wire.LinkOutcome


class Events(ABC):
    """Methods that make events of what a vehicle knows; each returns the event's number.

    `stamp_ns` is when it was measured, in nanoseconds since 1970, UTC; without it, now. It is for whoever
    reads the record (journal, exports), for instance of a log that is replayed: no estimate and no decision
    depends on it.
    """

    mission: str

    @abstractmethod
    def _post(self, topic: wire.Topic, message: Callable[[int, int], Event], stamp_ns: int | None) -> int:
        """Sends the event that `message` makes of its number and time."""

    def keyframe(
        self,
        id: int,
        pose: wire.Pose | None = None,
        *,
        saliency: tuple[float, float] | None = None,
        appearance: wire.AnyAppearance | None = None,
        camera: wire.Pose | None = None,
        stamp_ns: int | None = None,
    ) -> int:
        """A place where an image was taken.

        `pose` is the vehicle's own estimate of `world_from_body`; without it the planner takes the one that
        the first factor with a known keyframe implies. What the image shows is `saliency` (local, global),
        or any `appearance`, or nothing. `camera` is `body_from_camera` where it differs from the mission's.
        """
        if saliency is not None and appearance is not None:
            raise ValueError("give saliency or appearance, not both")
        content: wire.AnyAppearance = appearance if appearance is not None else wire.Appearance.None_()
        if saliency is not None:
            content = wire.Appearance.Saliency(local=saliency[0], global_=saliency[1])
        return self._post(
            wire.Topic.IN_KEYFRAME,
            lambda seq, stamp: wire.Keyframe(
                mission=self.mission,
                seq=seq,
                stamp_ns=stamp,
                id=id,
                pose=pose,
                camera=camera,
                appearance=content,
            ),
            stamp_ns,
        )

    def prior(
        self, keyframe: int, pose: wire.Pose, covariance: Covariance, *, stamp_ns: int | None = None
    ) -> int:
        """A measured pose; 6x6 over [m; rad]."""
        return self.factor(
            wire.FactorKind.Prior(keyframe=keyframe, pose=pose, covariance=_row_major(covariance, 6)),
            stamp_ns=stamp_ns,
        )

    def odometry(
        self,
        from_: int,
        to: int,
        relative: wire.Pose,
        covariance: Covariance,
        *,
        stamp_ns: int | None = None,
    ) -> int:
        """The step between successive keyframes: the pose of `to` in the body frame of `from_`; 6x6 over
        [m; rad].
        """
        return self.factor(
            wire.FactorKind.Odometry(
                from_=from_, to=to, relative=relative, covariance=_row_major(covariance, 6)
            ),
            stamp_ns=stamp_ns,
        )

    def relative(
        self,
        from_: int,
        to: int,
        relative: wire.Pose,
        covariance: Covariance,
        *,
        stamp_ns: int | None = None,
    ) -> int:
        """The pose of `to` in the body frame of `from_`, for any two keyframes; 6x6 over [m; rad]."""
        return self.factor(
            wire.FactorKind.Relative(
                from_=from_, to=to, relative=relative, covariance=_row_major(covariance, 6)
            ),
            stamp_ns=stamp_ns,
        )

    def camera(
        self,
        from_: int,
        to: int,
        direction: Sequence[float],
        rotation: Sequence[float],
        covariance: Covariance,
        *,
        stamp_ns: int | None = None,
    ) -> int:
        """A monocular registration: unit baseline and rotation of the camera of `to` seen from that of
        `from_`; 5x5, rad.
        """
        return self.factor(
            wire.FactorKind.Camera(
                from_=from_,
                to=to,
                direction=_vector(direction),
                rotation=_quaternion(rotation),
                covariance=_row_major(covariance, 5),
            ),
            stamp_ns=stamp_ns,
        )

    def attitude(
        self,
        keyframe: int,
        rotation: Sequence[float],
        tilt_variance_rad2: float,
        heading_variance_rad2: float | None = None,
        *,
        stamp_ns: int | None = None,
    ) -> int:
        """The measured rotation of `world_from_body`, [x, y, z, w].

        Without a variance the heading is not observed. The rotation should then have the heading that the
        vehicle believes: one that is far off distorts the two tilts.
        """
        return self.factor(
            wire.FactorKind.Attitude(
                keyframe=keyframe,
                rotation=_quaternion(rotation),
                tilt_variance_rad2=tilt_variance_rad2,
                heading_variance_rad2=heading_variance_rad2,
            ),
            stamp_ns=stamp_ns,
        )

    def depth(self, keyframe: int, depth_m: float, variance_m2: float, *, stamp_ns: int | None = None) -> int:
        """The measured depth, positive down."""
        return self.factor(
            wire.FactorKind.Depth(keyframe=keyframe, depth_m=depth_m, variance_m2=variance_m2),
            stamp_ns=stamp_ns,
        )

    def position(
        self,
        keyframe: int,
        position: Sequence[float],
        covariance: Covariance,
        *,
        stamp_ns: int | None = None,
    ) -> int:
        """A measured position in the world; 3x3 in m^2, third row and column zero where the depth is not
        observed.
        """
        return self.factor(
            wire.FactorKind.Position(
                keyframe=keyframe, position=_vector(position), covariance=_row_major(covariance, 3)
            ),
            stamp_ns=stamp_ns,
        )

    def factor(self, factor: wire.AnyFactorKind, *, stamp_ns: int | None = None) -> int:
        """A measurement of any kind."""
        return self._post(
            wire.Topic.IN_FACTOR,
            lambda seq, stamp: wire.Factor(mission=self.mission, seq=seq, stamp_ns=stamp, factor=factor),
            stamp_ns,
        )

    def link(self, from_: int, to: int, registered: bool, *, stamp_ns: int | None = None) -> int:
        """Whether a registration that the vehicle tried has succeeded; the factor of a success is sent
        as well.
        """
        return self._post(
            wire.Topic.IN_LINK,
            lambda seq, stamp: wire.LinkOutcome(
                mission=self.mission, seq=seq, stamp_ns=stamp, from_=from_, to=to, registered=registered
            ),
            stamp_ns,
        )


def checked_stamp(stamp_ns: int | None) -> int:
    """The time of an event, ns: the given one, or the clock's; raises `WireError`, and no number is taken."""
    if stamp_ns is None:
        return time.time_ns()
    try:
        stamp = operator.index(stamp_ns)
    except TypeError:
        stamp = -1
    if isinstance(stamp_ns, bool) or not 0 <= stamp < STAMPS:
        raise wire.WireError(
            wire.Code.INVALID,
            f"stamp_ns must be nanoseconds since 1970 as a whole number, 0 to 2^64 - 1, not {stamp_ns!r}; "
            "from seconds: round(seconds * 1e9)",
        )
    return stamp


def _row_major(matrix: Covariance, size: int) -> tuple[float, ...]:
    numbers = np.asarray(matrix, dtype=np.float64)
    if numbers.shape not in ((size, size), (size * size,)):
        raise ValueError(
            f"the covariance must be {size}x{size} or {size * size} numbers, not {numbers.shape}"
        )
    return tuple(numbers.ravel().tolist())


def _vector(vector: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in vector)
    return (x, y, z)


def _quaternion(quaternion: Sequence[float]) -> tuple[float, float, float, float]:
    x, y, z, w = (float(value) for value in quaternion)
    return (x, y, z, w)
