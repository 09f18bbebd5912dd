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

CLOSED_S = 0.25
"""A reader sees that the watch is closed after this at the latest, s."""


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
    """An iterator over what the planner publishes, from now on; a context manager.

    The iteration ends once the watch or its client is closed, by whatever thread. A watch that nobody refers
    to any more hears nothing more.
    """

    def __init__(self, session: VehicleSession) -> None:
        self._lifetime = session.lifetime
        self._closed = False
        heard = self._heard = _Heard()  # The subscriptions' threads refer to this, not to the watch.
        self._subscriptions = [session.subscribe(topic, _receiver_of(kind, heard)) for topic, kind in _KINDS]
        self._subscriptions.append(
            session.subscribe_presence(lambda present: heard.put(PlannerPresence(present)), history=True)
        )

    @property
    def dropped(self) -> int:
        """Publications that gave way to newer ones before they were read."""
        return self._heard.dropped

    def next(self, timeout_s: float | None = None) -> Watched | None:
        """The next publication; None if none came within `timeout_s`, or the watch is closed.

        Raises `Closed` once the client is closed, and `Forked` in a process that was forked from its own.
        """
        item = self._next(timeout_s)
        if item is None and not self._closed:
            self._lifetime.require_open()
        return item

    def _next(self, timeout_s: float | None) -> Watched | None:
        until_s = None if timeout_s is None else time.monotonic() + timeout_s
        while not (self._closed or self._lifetime.closed):
            left_s = CLOSED_S if until_s is None else min(CLOSED_S, until_s - time.monotonic())
            if left_s <= 0.0:
                return None
            try:
                return self._heard.queue.get(timeout=left_s)
            except queue.Empty:
                continue
        return None

    def __iter__(self) -> Iterator[Watched]:
        while (item := self._next(None)) is not None:
            yield item
        if self._lifetime.forked:
            self._lifetime.require_open()

    def close(self) -> None:
        """Ends the iteration."""
        self._closed = True
        while self._subscriptions:
            self._subscriptions.pop().close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()


class _Heard:
    """What waits to be read; the oldest gives way."""

    def __init__(self) -> None:
        self.queue: queue.Queue[Watched] = queue.Queue(QUEUE_CAPACITY)
        self.dropped = 0

    def put(self, item: Watched) -> None:
        while True:
            try:
                self.queue.put_nowait(item)
            except queue.Full:
                self.dropped += 1
                try:
                    self.queue.get_nowait()
                except queue.Empty:
                    continue
            else:
                return


def _receiver_of(kind: type[Published], heard: _Heard) -> Callable[[zenoh.Sample], None]:
    return lambda sample: heard.put(_read(sample, kind))


def _read(sample: zenoh.Sample, kind: type[Published]) -> Watched:
    try:
        return decode_sample(sample, kind)
    except BadReply as error:
        return error
