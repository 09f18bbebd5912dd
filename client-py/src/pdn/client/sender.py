"""The thread that brings a mission's events to the planner: it owns the outbox, the acknowledgements and
the resends.

Callers put events in and wait for room; callbacks of Zenoh put work in and never wait. Whatever went wrong
on the way, one question decides it: `rpc/ingest` says which events the planner has, and sending goes on
from there. It is asked

- when nothing has moved for `STALL_S` though events are under way, then ever more rarely up to
  `STALL_LAST_S`,
- when the planner's liveliness token comes back,
- when acknowledgements had to be thrown away because they came faster than they could be read.
"""

from __future__ import annotations

import logging
import queue
import threading
import time
from collections.abc import Callable

from .backoff import STALL_LAST_S, STALL_S, Backoff
from .errors import (
    BadReply,
    Closed,
    MissionLost,
    MissionUnknown,
    OutboxFull,
    OutboxUnusable,
    PdnError,
    ProblemLike,
    StreamBroken,
    Timeout,
    TwoPublishers,
)
from .outbox import WINDOW, Entry, Outbox
from .outbox_file import OutboxFile
from .outbox_recovery import recover_outbox
from .refusals import FINAL, OnRejected, Refusals
from .transport import IngestStatus, Transport

SEND_BATCH = 64
"""Events sent between two looks at what came in."""

INBOX_BATCH = 64
"""Acknowledgements and refusals read between two looks at what is to be sent: a flood of refusals, which
anyone can cause by sending rubbish under this vehicle's keys, must not keep events from going out."""

INBOX_CAPACITY = 4096
"""Acknowledgements and refusals that may wait to be read; beyond, the planner is asked instead."""

LATE_REASONS_S = 1.0
"""How long `flush` waits for the reasons of refusals that the planner has counted, s."""

_log = logging.getLogger("pdn.client")


class Sender:
    """Sends events in order until they are durable, each counted once."""

    def __init__(
        self,
        mission: str,
        transport: Transport,
        status: IngestStatus,
        *,
        window: int = WINDOW,
        on_rejected: OnRejected | None = None,
        raises: bool = True,
        store: OutboxFile | None = None,
    ) -> None:
        """Goes on from `status`, or from what `store` has kept of an earlier program.

        `on_rejected` is called on the sender's thread; with `raises` a refusal is also raised by the
        caller's next call.
        """
        self.mission = mission
        self._transport = transport
        self._on_rejected = on_rejected
        self._store = store
        self._outbox = (
            Outbox(status.next_seq, window) if store is None else recover_outbox(store, status, window)
        )
        self._first_seq = self._outbox.durable_seq
        self._refusals = Refusals(status.rejected, raises=raises)
        self._broken: PdnError | None = None
        self._planner_present = True
        self._resync_requested = False
        self._closing = False
        self._backoff = Backoff(time.monotonic())
        self._changed = threading.Condition()
        self._inbox: queue.Queue[Callable[[], None]] = queue.Queue(INBOX_CAPACITY)
        self._thread = threading.Thread(target=self._run, name=f"pdn-sender-{mission}", daemon=True)

    def start(self) -> None:
        """Starts the thread."""
        self._thread.start()

    # --- for callers ---

    @property
    def refusals(self) -> list[ProblemLike]:
        """The refusals so far, oldest first."""
        with self._changed:
            return list(self._refusals.all)

    @property
    def next_seq(self) -> int:
        """The number that the next event will get."""
        return self._outbox.next_seq

    @property
    def durable_seq(self) -> int:
        """All events below are durable."""
        return self._outbox.durable_seq

    def post(self, encode: Callable[[int], Entry], timeout_s: float) -> int:
        """Numbers an event, keeps and sends it; returns its number.

        Blocks while the window is full, at most `timeout_s`, then raises `OutboxFull`. Raises
        `EventsRefused` for earlier events, `StreamBroken` if the mission cannot go on. Whenever it raises,
        this event was not taken.
        """
        with self._changed:
            self._raise_pending()
            if not self._changed.wait_for(lambda: self._broken or not self._outbox.full, timeout_s):
                self._raise_pending()
                raise OutboxFull(
                    f"{self._outbox.window} events of mission {self.mission} wait for the planner, "
                    f"and nothing moved for {timeout_s:g} s"
                )
            self._raise_pending()
            entry = encode(self._outbox.next_seq)
            if self._store is not None:
                self._store.append(entry)
            if self._outbox.empty:
                self._backoff.start(time.monotonic())
            self._outbox.append(entry)
        self._wake()
        return entry.seq

    def flush(self, timeout_s: float) -> None:
        """Waits until every event is durable and every refusal is known; raises `Timeout`, `EventsRefused` or
        `StreamBroken`."""
        deadline_s = time.monotonic() + timeout_s
        with self._changed:
            if self._closing and self._outbox.empty:
                self._refusals.raise_new()
                return
            emptied = self._changed.wait_for(lambda: self._broken or self._outbox.empty, timeout_s)
            self._raise_pending()
            if not emptied:
                waiting = self._outbox.next_seq - self._outbox.durable_seq
                raise Timeout(
                    f"{waiting} events of mission {self.mission}, from {self._outbox.durable_seq} on, "
                    f"were not confirmed within {timeout_s:g} s"
                )
        status = self._transport.ingest(max(0.1, deadline_s - time.monotonic()))
        with self._changed:
            self._changed.wait_for(lambda: self._refusals.counted >= status.rejected, LATE_REASONS_S)
            self._refusals.raise_unannounced(status.rejected)
            self._raise_pending()

    @property
    def fate(self) -> str:
        """What becomes of the events that are not durable when nobody sends them any more."""
        first, last = self._outbox.durable_seq, self._outbox.next_seq - 1
        if self._store is not None:
            return (
                f"Events {first} to {last} are kept in {self._store.path}, for the next program that opens "
                "the stream."
            )
        return (
            f"Events {first} to {last} may not have reached the planner. Use `with`, or flush() at the end; "
            "an outbox keeps them."
        )

    def close(self, timeout_s: float = 2.0) -> None:
        """Stops the thread; what is not durable is sent no more."""
        self._closing = True
        with self._changed:
            if self._broken is None:
                self._broken = Closed(
                    f"The stream of mission {self.mission} is closed; open another with mission_stream()."
                )
            self._changed.notify_all()
        self._wake()
        if self._thread.is_alive() and threading.current_thread() is not self._thread:
            self._thread.join(timeout_s)
        with self._changed:
            store, self._store = self._store, None
            if store is not None:
                store.close()

    # --- for callbacks: never block ---

    def enqueue(self, work: Callable[[], None]) -> None:
        """Has the sender's thread do `work`."""
        try:
            self._inbox.put_nowait(work)
        except queue.Full:
            self._resync_requested = True

    # --- on the sender's thread ---

    def acknowledged(self, applied_seq: int, durable_seq: int) -> None:
        """An acknowledgement came."""
        with self._changed:
            if self._outbox.acknowledge(applied_seq, durable_seq):
                self._progressed()
                self._trim()

    def rejected(self, problem: ProblemLike) -> None:
        """A refusal came."""
        with self._changed:
            new = self._refusals.add(problem)
            if problem.code == "conflict" and problem.seq is not None and problem.seq >= self._first_seq:
                self._broken = TwoPublishers(
                    f"Another program sends events of mission {self.mission} under the same numbers: event "
                    f"{problem.seq} came with two contents, and the planner has kept the first. Stop one of "
                    "the two programs. Whose events the planner has from there on is not known to either, so "
                    "configure a new mission if it matters."
                )
            if problem.code in FINAL and problem.seq is not None and self._outbox.awaits(problem.seq):
                ended = problem.code == "mission_ended"
                kind = StreamBroken if ended else MissionLost
                self._broken = kind(f"Mission {self.mission} takes no more events: {problem.message}")
            self._changed.notify_all()
        if new and self._on_rejected is not None:
            try:
                self._on_rejected(problem)
            except Exception:
                _log.exception("on_rejected failed for the refusal of event %s", problem.seq)

    def planner_appeared(self) -> None:
        """The planner's token is there: ask what it has."""
        self._resync_requested = True

    def planner_disappeared(self) -> None:
        """The planner's token is gone: what is sent now would vanish."""
        self._planner_present = False

    def _run(self) -> None:
        try:
            for entry in self._outbox.take(self._outbox.window):  # All that an earlier program has left.
                self._transport.send(entry)
            while not self._closing:
                self._process_inbox()
                if self._broken is None:
                    self._transmit()
                    if self._resync_requested or self._stalled():
                        self._resynchronise()
        except PdnError as error:
            self._break(error)
        except OSError as error:  # Of the outbox on disk.
            self._break(OutboxUnusable(f"The outbox of mission {self.mission} cannot be written: {error}"))

    def _process_inbox(self) -> None:
        pause_s = self._pause_s()
        try:
            for _ in range(INBOX_BATCH):
                work = self._inbox.get(timeout=pause_s)
                pause_s = 0.0
                try:
                    work()
                except BadReply as error:
                    _log.warning("mission %s: %s", self.mission, error)
                    self._resync_requested = True
        except queue.Empty:
            pass

    def _pause_s(self) -> float:
        with self._changed:
            if self._resync_requested or (self._planner_present and self._outbox.unsent and not self._broken):
                return 0.0
            if self._outbox.empty or self._broken:
                return STALL_LAST_S
            return self._backoff.remaining_s(time.monotonic())

    def _transmit(self) -> None:
        if not self._planner_present:
            return
        with self._changed:
            entries = self._outbox.take(SEND_BATCH)
            store = self._store
        if entries and store is not None:
            store.sync()
        for entry in entries:
            self._transport.send(entry)

    def _stalled(self) -> bool:
        with self._changed:
            return not self._outbox.empty and self._backoff.remaining_s(time.monotonic()) == 0.0

    def _resynchronise(self) -> None:
        self._resync_requested = False
        try:
            status = self._transport.ingest(STALL_S)
        except MissionUnknown as error:
            self._break(MissionLost(f"The planner no longer knows mission {self.mission}: {error}"))
            return
        except PdnError as error:
            _log.info("mission %s: cannot ask the planner which events it has: %s", self.mission, error)
            self._backoff.failed(time.monotonic())
            return
        lost = self._outbox.lost(status.next_seq)
        if lost:
            self._break(
                MissionLost(
                    f"The planner has lost {lost} events of mission {self.mission} that it had confirmed, "
                    f"from {status.next_seq} on. "
                    "Configure a new mission, or let the daemon keep a journal."
                )
            )
        elif status.next_seq > self._outbox.next_seq:
            self._break(
                TwoPublishers(
                    f"Another program sends events of mission {self.mission}: the planner is at "
                    f"{status.next_seq}, this stream at {self._outbox.next_seq}. Stop one of the two."
                )
            )
        else:
            with self._changed:
                self._planner_present = True
                if self._outbox.resynchronise(status.next_seq, status.durable_seq):
                    self._progressed()
                    self._trim()
                else:
                    self._backoff.failed(time.monotonic())

    def _progressed(self) -> None:
        self._backoff.succeeded(time.monotonic())
        self._changed.notify_all()

    def _break(self, error: PdnError) -> None:
        with self._changed:
            self._broken = self._broken or error
            self._changed.notify_all()

    # --- small parts ---

    def _trim(self) -> None:
        if self._store is not None:
            self._store.trim(self._outbox.durable_seq)

    def _wake(self) -> None:
        if self._inbox.empty():
            self.enqueue(lambda: None)

    def _raise_pending(self) -> None:
        self._refusals.raise_new()
        if self._broken is not None:
            raise self._broken
