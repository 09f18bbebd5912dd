"""What the planner publishes about a vehicle, as an iterator: for consoles and recorders."""

from __future__ import annotations

import queue
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import TracebackType
from typing import Self

import zenoh

from pdn import wire

from .errors import BadReply
from .vehicle_session import VehicleSession, decode_sample

QUEUE_CAPACITY = 1024
"""Publications that may wait to be read; beyond, the oldest give way and are counted in `dropped`."""


@dataclass(frozen=True, slots=True)
class PlannerPresence:
    """The planner came or went."""

    present: bool


Published = wire.MissionState | wire.Decision | wire.Problem

Watched = Published | PlannerPresence | BadReply
"""A state, a decision taken, a refused event, the planner's coming and going, or a publication that
could not be read.
"""

_KINDS: tuple[tuple[wire.Topic, type[Published]], ...] = (
    (wire.Topic.OUT_STATE, wire.MissionState),
    (wire.Topic.OUT_DECIDED, wire.Decision),
    (wire.Topic.OUT_REJECTED, wire.Problem),
)


class Watch:
    """An iterator over what the planner publishes, from now on; a context manager."""

    def __init__(self, session: VehicleSession) -> None:
        self.dropped = 0
        self._closed = False
        self._queue: queue.Queue[Watched] = queue.Queue(QUEUE_CAPACITY)
        self._subscribers = [session.subscribe(topic, self._receiver_of(kind)) for topic, kind in _KINDS]
        self._subscribers.append(
            session.subscribe_presence(lambda present: self._put(PlannerPresence(present)), history=True)
        )

    def next(self, timeout_s: float | None = None) -> Watched | None:
        """The next publication; None if none came within `timeout_s`, or the watch is closed."""
        until_s = None if timeout_s is None else time.monotonic() + timeout_s
        while not self._closed:
            left_s = 0.25 if until_s is None else min(0.25, until_s - time.monotonic())
            if left_s <= 0.0:
                return None
            try:
                return self._queue.get(timeout=left_s)
            except queue.Empty:
                continue
        return None

    def __iter__(self) -> Iterator[Watched]:
        while (item := self.next()) is not None:
            yield item

    def close(self) -> None:
        """Ends the iteration."""
        self._closed = True
        while self._subscribers:
            self._subscribers.pop().undeclare()  # type: ignore[no-untyped-call]

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def _receiver_of(self, kind: type[Published]) -> Callable[[zenoh.Sample], None]:
        return lambda sample: self._put(_read(sample, kind))

    def _put(self, item: Watched) -> None:
        while True:
            try:
                self._queue.put_nowait(item)
            except queue.Full:
                self.dropped += 1
                try:
                    self._queue.get_nowait()
                except queue.Empty:
                    continue
            else:
                return


def _read(sample: zenoh.Sample, kind: type[Published]) -> Watched:
    try:
        return decode_sample(sample, kind)
    except BadReply as error:
        return error
