"""A mission's events on their way: typed methods on top, the sender below, Zenoh's callbacks between."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Literal, Self

import zenoh

from pdn import wire

from .errors import PdnError, ProblemLike
from .events import Event, Events, checked_stamp
from .mission_transport import MissionTransport, status_without_gaps
from .outbox import WINDOW, Entry
from .outbox_file import OutboxFile
from .sender import Sender
from .vehicle_session import Subscription, VehicleSession, decode_sample

OnRejected = Literal["raise", "collect"] | Callable[[ProblemLike], None]

POST_TIMEOUT_S = 30.0
"""Longest wait for room in the window, s."""

FLUSH_TIMEOUT_S = 60.0
"""Longest wait for the confirmation of everything that was sent, s."""


_log = logging.getLogger("pdn.client")


class MissionStream(Events):
    """Sends the events of one mission: each exactly once, in order, whatever breaks in between.

    A context manager: leaving it waits until every event is durable. Methods that send return the event's
    number, for `after=` of a question. They block while 512 events wait for confirmation, at most
    `timeout_s`, then raise `OutboxFull`. A refused event does not stop the others; by default the refusal
    is raised as `EventsRefused` by the next call (whose own event is then not taken) or by `flush`. Safe to
    use from several threads; numbers are given in the order of the calls.
    """

    def __init__(
        self,
        session: VehicleSession,
        mission: str,
        *,
        on_rejected: OnRejected = "raise",
        window: int = WINDOW,
        timeout_s: float = POST_TIMEOUT_S,
        outbox: str | Path | None = None,
    ) -> None:
        """Goes on where the mission's events stand, or where those kept in the folder `outbox` end.

        Raises `MissionUnknown`, `MissionGap`, `NotAllowed`, `OutboxUnusable`.
        """
        self.mission = mission
        self.timeout_s = timeout_s
        self.closed = False
        self._session = session
        transport = MissionTransport(session, mission)
        store = None if outbox is None else OutboxFile(outbox, session.vehicle, mission)
        try:
            # What an earlier program left on its way is in its file, and so no gap stays.
            is_new = store is None or store.next_seq is None
            status = (
                status_without_gaps(transport, mission, timeout_s) if is_new else transport.ingest(timeout_s)
            )
            session.require_subscriber(wire.Topic.IN_KEYFRAME)
            sender = Sender(
                mission,
                transport,
                status,
                window=window,
                on_rejected=on_rejected if callable(on_rejected) else None,
                raises=on_rejected == "raise",
                store=store,
            )
        except BaseException:
            if store is not None:
                store.release()
            raise
        self.resumed = 0 if store is None else len(store.entries)
        self._sender = sender
        self._declarations = self._declare(session)
        sender.start()  # Now that what comes of it can be heard.
        session.lifetime.streams.add(self)

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
        return self._sender.refusals

    def flush(self, timeout_s: float = FLUSH_TIMEOUT_S) -> None:
        """Waits until every event is durable and every refusal is known; raises `Timeout`,
        `EventsRefused`, `StreamBroken`, and `Closed` if not all were when the stream was closed.
        """
        if self._session.lifetime.forked:
            self._session.lifetime.require_open()
        self._sender.flush(timeout_s)

    def close(self) -> None:
        """Stops at once; what is not durable is sent no more. `flush` first, or use `with`.

        Calls that wait in other threads end with `Closed`.
        """
        self.closed = True
        if self._session.lifetime.forked:
            return  # The thread, the file and the events are the other process's.
        self._sender.close()
        while self._declarations:
            self._declarations.pop().close()

    def drain(self, timeout_s: float) -> None:
        """At the end of the program: waits for what is under way, tells what remains, and stops."""
        if self.closed:
            return
        try:
            self.flush(timeout_s)
        except PdnError as error:
            _log.warning("The program ended with the stream of mission %s open: %s", self.mission, error)
            if self.next_seq > self.durable_seq:
                _log.warning("%s", self._sender.fate)
        with contextlib.suppress(PdnError):
            self.close()

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

    def _declare(self, session: VehicleSession) -> list[Subscription]:
        sender = self._sender
        return [
            session.subscribe(
                wire.Topic.OUT_ACK, lambda sample: sender.enqueue(lambda: self._acknowledged(sample))
            ),
            session.subscribe(
                wire.Topic.OUT_REJECTED, lambda sample: sender.enqueue(lambda: self._rejected(sample))
            ),
            session.subscribe_presence(
                lambda present: sender.enqueue(
                    sender.planner_appeared if present else sender.planner_disappeared
                ),
                history=False,
            ),
        ]

    def _post(
        self,
        topic: wire.Topic,
        message: Callable[[int, int], Event],
        stamp_ns: int | None,
    ) -> int:
        self._session.lifetime.require_open()
        stamp = checked_stamp(stamp_ns)

        def encoded(seq: int) -> Entry:
            event = message(seq, stamp)
            form = self._session.form
            return Entry(
                seq,
                wire.key(self._session.vehicle, topic),
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
