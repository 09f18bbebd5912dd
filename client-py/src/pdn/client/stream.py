"""A mission's events, typed: what a vehicle calls for each keyframe, measurement and registration."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from types import TracebackType
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray
import zenoh

from pdn import wire

from .errors import MissionGap
from .link import Link, decode_sample
from .outbox import WINDOW, Entry
from .sender import ProblemLike, Sender

Covariance = NDArray[np.float64] | Sequence[float] | Sequence[Sequence[float]]
"""A square matrix, or its numbers row by row."""

OnRejected = Literal["raise", "collect"] | Callable[[ProblemLike], None]

POST_TIMEOUT_S = 30.0
"""Longest wait for room in the window, s."""

FLUSH_TIMEOUT_S = 60.0
"""Longest wait for the confirmation of everything that was sent, s."""

SETTLE_S = 2.0
"""How long events of an earlier sender may still be on their way, s."""


class MissionStream:
    """Sends the events of one mission: each exactly once, in order, whatever breaks in between.

    A context manager: leaving it waits until every event is durable. Methods that send return the event's number,
    for `after=` of a question. They block while 512 events wait for confirmation, at most `timeout_s`, then raise
    `OutboxFull`. A refused event does not stop the others; by default the refusal is raised as `EventsRefused` by the next
    call (whose own event is then not taken) or by `flush`. Safe to use from several threads; numbers are given
    in the order of the calls.
    """

    def __init__(
        self,
        link: Link,
        mission: str,
        *,
        on_rejected: OnRejected = "raise",
        window: int = WINDOW,
        timeout_s: float = POST_TIMEOUT_S,
    ) -> None:
        """Goes on where the mission's events stand; raises `MissionUnknown` and `MissionGap`."""
        self.mission = mission
        self.timeout_s = timeout_s
        self.closed = False
        self._link = link
        sender_link = _SenderLink(link, mission)
        status = _settled_status(sender_link, mission, timeout_s)
        sender = Sender(
            mission,
            sender_link,
            status,
            window=window,
            on_rejected=on_rejected if callable(on_rejected) else None,
            raises=on_rejected == "raise",
        )
        self._sender = sender
        self._entities: list[zenoh.Subscriber[None] | zenoh.LivelinessToken] = [
            link.subscribe(wire.Topic.OUT_ACK, lambda sample: sender.hand_over(lambda: self._acknowledged(sample))),
            link.subscribe(wire.Topic.OUT_REJECTED, lambda sample: sender.hand_over(lambda: self._rejected(sample))),
            link.watch_planner(
                lambda present: sender.hand_over(sender.planner_came if present else sender.planner_went),
                history=False,
            ),
        ]

    @property
    def next_seq(self) -> int:
        """The number that the next event will get."""
        return self._sender.next_seq

    @property
    def durable_seq(self) -> int:
        """All events below survive what the daemon's durability promises to survive."""
        return self._sender.durable_seq

    @property
    def refusals(self) -> list[ProblemLike]:
        """The refusals so far, oldest first; of very many only the last."""
        return list(self._sender.refusals)

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

        `pose` is the vehicle's own estimate of `world_from_body`; without it the planner takes the one that the first factor
        with a known keyframe implies. What the image shows is `saliency` (local, global), or any `appearance`, or nothing.
        `camera` is `body_from_camera` where it differs from the mission's.
        """
        if saliency is not None and appearance is not None:
            raise ValueError("give saliency or appearance, not both")
        shown: wire.AnyAppearance = appearance if appearance is not None else wire.Appearance.None_()
        if saliency is not None:
            shown = wire.Appearance.Saliency(local=saliency[0], global_=saliency[1])
        return self._post(
            wire.Topic.IN_KEYFRAME,
            lambda seq, stamp: wire.Keyframe(
                mission=self.mission, seq=seq, stamp_ns=stamp, id=id, pose=pose, camera=camera, appearance=shown
            ),
            stamp_ns,
        )

    def prior(self, keyframe: int, pose: wire.Pose, covariance: Covariance) -> int:
        """A measured pose; 6x6 over [m; rad]."""
        return self.factor(
            wire.FactorKind.Prior(keyframe=keyframe, pose=pose, covariance=_row_major(covariance, 6))
        )

    def odometry(self, from_: int, to: int, relative: wire.Pose, covariance: Covariance) -> int:
        """The step between successive keyframes: the pose of `to` in the body frame of `from_`; 6x6 over [m; rad]."""
        return self.factor(
            wire.FactorKind.Odometry(from_=from_, to=to, relative=relative, covariance=_row_major(covariance, 6))
        )

    def relative(self, from_: int, to: int, relative: wire.Pose, covariance: Covariance) -> int:
        """The pose of `to` in the body frame of `from_`, for any two keyframes; 6x6 over [m; rad]."""
        return self.factor(
            wire.FactorKind.Relative(from_=from_, to=to, relative=relative, covariance=_row_major(covariance, 6))
        )

    def camera(
        self, from_: int, to: int, direction: Sequence[float], rotation: Sequence[float], covariance: Covariance
    ) -> int:
        """A monocular registration: unit baseline and rotation of the camera of `to` seen from that of `from_`; 5x5, rad."""
        return self.factor(
            wire.FactorKind.Camera(
                from_=from_,
                to=to,
                direction=_three(direction),
                rotation=_four(rotation),
                covariance=_row_major(covariance, 5),
            )
        )

    def attitude(
        self,
        keyframe: int,
        rotation: Sequence[float],
        tilt_variance_rad2: float,
        heading_variance_rad2: float | None = None,
    ) -> int:
        """The measured rotation of `world_from_body`, [x, y, z, w]; without a variance the heading is not observed."""
        return self.factor(
            wire.FactorKind.Attitude(
                keyframe=keyframe,
                rotation=_four(rotation),
                tilt_variance_rad2=tilt_variance_rad2,
                heading_variance_rad2=heading_variance_rad2,
            )
        )

    def depth(self, keyframe: int, depth_m: float, variance_m2: float) -> int:
        """The measured depth, positive down."""
        return self.factor(wire.FactorKind.Depth(keyframe=keyframe, depth_m=depth_m, variance_m2=variance_m2))

    def position(self, keyframe: int, position: Sequence[float], covariance: Covariance) -> int:
        """A measured position in the world; 3x3 in m^2, third row and column zero where the depth is not observed."""
        return self.factor(
            wire.FactorKind.Position(
                keyframe=keyframe, position=_three(position), covariance=_row_major(covariance, 3)
            )
        )

    def factor(self, factor: wire.AnyFactorKind, *, stamp_ns: int | None = None) -> int:
        """A measurement of any kind."""
        return self._post(
            wire.Topic.IN_FACTOR,
            lambda seq, stamp: wire.Factor(mission=self.mission, seq=seq, stamp_ns=stamp, factor=factor),
            stamp_ns,
        )

    def link(self, from_: int, to: int, registered: bool, *, stamp_ns: int | None = None) -> int:
        """Whether a registration that the vehicle tried has succeeded; the factor of a success is sent as well."""
        return self._post(
            wire.Topic.IN_LINK,
            lambda seq, stamp: wire.LinkOutcome(
                mission=self.mission, seq=seq, stamp_ns=stamp, from_=from_, to=to, registered=registered
            ),
            stamp_ns,
        )

    def flush(self, timeout_s: float = FLUSH_TIMEOUT_S) -> None:
        """Waits until every event is durable and every refusal is known; raises `Timeout`, `EventsRefused`, `StreamBroken`."""
        self._sender.flush(timeout_s)

    def close(self) -> None:
        """Stops at once; what is not durable is sent no more. `flush` first, or use `with`."""
        self.closed = True
        self._sender.close()
        while self._entities:
            self._entities.pop().undeclare()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        try:
            if kind is None:
                self.flush()
        finally:
            self.close()

    def _post(
        self,
        topic: wire.Topic,
        message: Callable[[int, int], wire.Keyframe | wire.Factor | wire.LinkOutcome],
        stamp_ns: int | None,
    ) -> int:
        stamp = time.time_ns() if stamp_ns is None else stamp_ns

        def encoded(seq: int) -> Entry:
            event = message(seq, stamp)
            form = self._link.form
            return Entry(
                seq,
                wire.key(self._link.vehicle, topic),
                wire.encode(event, form),
                wire.encoding(type(event), form),
            )

        return self._sender.post(encoded, self.timeout_s)

    def _acknowledged(self, sample: zenoh.Sample) -> None:
        ack = decode_sample(sample, wire.Ack)
        if ack.mission == self.mission:
            self._sender.acknowledged(ack.next_seq, ack.durable_seq)

    def _rejected(self, sample: zenoh.Sample) -> None:
        self._sender.rejected(decode_sample(sample, wire.Problem))


class _SenderLink:
    """The sender's view of the link: one mission's."""

    def __init__(self, link: Link, mission: str) -> None:
        self._link = link
        self._mission = mission

    def send(self, entry: Entry) -> None:
        self._link.send(entry)

    def ingest(self, timeout_s: float) -> wire.IngestStatus:
        return self._link.ask(
            wire.Topic.RPC_INGEST, wire.IngestStatus, timeout_s, parameters={"mission": self._mission}
        )


def _settled_status(link: _SenderLink, mission: str, timeout_s: float) -> wire.IngestStatus:
    """The status once nothing is on its way; a gap that stays can be closed by its first sender only."""
    give_up_s = time.monotonic() + SETTLE_S
    while (status := link.ingest(timeout_s)).buffered:
        if time.monotonic() > give_up_s:
            raise MissionGap(
                f"Mission {mission} has {status.buffered} events that wait for {_ranges(status.missing)}, which never arrived. "
                "Only their first sender can send them; otherwise abort the mission and configure a new one."
            )
        time.sleep(0.05)
    return status


def _ranges(missing: Sequence[tuple[int, int]]) -> str:
    return ", ".join(str(first) if first == last else f"{first} to {last}" for first, last in missing)


def _row_major(matrix: Covariance, size: int) -> tuple[float, ...]:
    numbers = np.asarray(matrix, dtype=np.float64)
    if numbers.shape not in ((size, size), (size * size,)):
        raise ValueError(f"the covariance must be {size}x{size} or {size * size} numbers, not of shape {numbers.shape}")
    return tuple(numbers.ravel().tolist())


def _three(vector: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in vector)
    return (x, y, z)


def _four(quaternion: Sequence[float]) -> tuple[float, float, float, float]:
    x, y, z, w = (float(value) for value in quaternion)
    return (x, y, z, w)


