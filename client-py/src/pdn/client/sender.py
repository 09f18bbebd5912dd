"""The thread that brings a mission's events to the planner: it owns the outbox, the acknowledgements and the resends.

Callers put events in and wait for room; callbacks of Zenoh put work in and never wait. Whatever went wrong on the way, one
question settles it: `rpc/ingest` says which events the planner has, and sending goes on from there. It is asked

- when nothing has moved for `STALL_S` though events are under way, and then ever more rarely up to `STALL_LAST_S`,
- when the planner's liveliness token comes back,
- when acknowledgements had to be thrown away because they came faster than they could be read.
"""

from __future__ import annotations

import logging
import queue
import threading
import time
from collections.abc import Callable
from typing import Protocol

from .errors import (
    BadReply,
    EventsRefused,
    MissionLost,
    MissionUnknown,
    OutboxFull,
    PdnError,
    ProblemLike,
    StreamBroken,
    Timeout,
)
from .outbox import WINDOW, Entry, Outbox

STALL_S = 0.75
"""Time without progress after which events are sent again, s (wire.md, section 2)."""

STALL_LAST_S = 6.0
"""The same after several vain attempts, s; it doubles from one to the other."""

BATCH = 64
"""Events sent between two looks at what came in."""

MAX_NEWS = 4096
"""Acknowledgements and refusals that may wait to be read; beyond, the planner is asked instead."""

LATE_REASONS_S = 1.0
"""How long `flush` waits for the reasons of refusals that the planner has counted, s."""

REFUSALS_KEPT = 1000
"""Refusals that a stream remembers."""

TRANSIENT = frozenset({"overloaded", "not_ready"})
"""Codes that say nothing about the event: it was not looked at, keeps its number and will be sent again."""

_log = logging.getLogger("pdn.client")


class Status(Protocol):
    """What `rpc/ingest` answers: `pdn.wire.IngestStatus`."""

    next_seq: int
    durable_seq: int
    rejected: int


class Link(Protocol):
    """The way to the planner."""

    def send(self, entry: Entry) -> None:
        """Publishes an event; may block while the link is slow."""

    def ingest(self, timeout_s: float) -> Status:
        """Asks which events have arrived; raises a `PdnError`."""


class Sender:
    """Sends events in order until they are durable, each counted once."""

    def __init__(
        self,
        mission: str,
        link: Link,
        status: Status,
        *,
        window: int = WINDOW,
        on_rejected: Callable[[ProblemLike], None] | None = None,
        raises: bool = True,
    ) -> None:
        """Goes on from `status`. `on_rejected` is called on the sender's thread; with `raises` a refusal is also raised
        by the caller's next call."""
        self.mission = mission
        self.refusals: list[ProblemLike] = []
        self._link = link
        self._on_rejected = on_rejected
        self._raises = raises
        self._outbox = Outbox(status.next_seq, window)
        self._refusals_counted = status.rejected
        self._unraised: list[ProblemLike] = []
        self._broken: PdnError | None = None
        self._planner_present = True
        self._resync_wanted = False
        self._closing = False
        self._patience_s = STALL_S
        self._last_progress_s = time.monotonic()
        self._changed = threading.Condition()
        self._news: queue.Queue[Callable[[], None]] = queue.Queue(MAX_NEWS)
        self._thread = threading.Thread(target=self._run, name=f"pdn-sender-{mission}", daemon=True)
        self._thread.start()

    # -- for callers -------------------------------------------------------------------------------------------------

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

        Blocks while the window is full, at most `timeout_s`, then raises `OutboxFull`. Raises `EventsRefused` for earlier
        events, `StreamBroken` if the mission cannot go on. Whenever it raises, this event was not taken.
        """
        with self._changed:
            self._raise_pending()
            if not self._changed.wait_for(lambda: self._broken or not self._outbox.full, timeout_s):
                self._raise_pending()
                raise OutboxFull(
                    f"{self._outbox.window} events of mission {self.mission} wait for the planner, and nothing moved for {timeout_s:g} s"
                )
            self._raise_pending()
            entry = encode(self._outbox.next_seq)
            if self._outbox.settled:
                self._last_progress_s = time.monotonic()
            self._outbox.append(entry)
        self._wake()
        return entry.seq

    def flush(self, timeout_s: float) -> None:
        """Waits until every event is durable and every refusal is known; raises `Timeout`, `EventsRefused` or
        `StreamBroken`."""
        deadline_s = time.monotonic() + timeout_s
        with self._changed:
            settled = self._changed.wait_for(lambda: self._broken or self._outbox.settled, timeout_s)
            self._raise_pending()
            if not settled:
                waiting = self._outbox.next_seq - self._outbox.durable_seq
                raise Timeout(
                    f"{waiting} events of mission {self.mission}, from {self._outbox.durable_seq} on, were not confirmed within {timeout_s:g} s"
                )
        status = self._link.ingest(max(0.1, deadline_s - time.monotonic()))
        with self._changed:
            self._changed.wait_for(lambda: self._refusals_counted >= status.rejected, LATE_REASONS_S)
            unreported = max(0, status.rejected - self._refusals_counted)
            self._refusals_counted += unreported
            if unreported:
                raise EventsRefused(self._take_unraised(), unreported)
            self._raise_pending()

    def close(self, timeout_s: float = 2.0) -> None:
        """Stops the thread; what is not durable is sent no more."""
        self._closing = True
        self._wake()
        if threading.current_thread() is not self._thread:
            self._thread.join(timeout_s)

    # -- for callbacks: never block ----------------------------------------------------------------------------------

    def hand_over(self, work: Callable[[], None]) -> None:
        """Has `work` done on the sender's thread."""
        try:
            self._news.put_nowait(work)
        except queue.Full:
            self._resync_wanted = True

    # -- on the sender's thread --------------------------------------------------------------------------------------

    def acknowledged(self, applied_seq: int, durable_seq: int) -> None:
        """An acknowledgement came."""
        with self._changed:
            if self._outbox.acknowledge(applied_seq, durable_seq):
                self._progressed()

    def rejected(self, problem: ProblemLike) -> None:
        """A refusal came."""
        if problem.code in TRANSIENT:
            return
        with self._changed:
            self._refusals_counted += 1
            known = any((seen.code, seen.seq) == (problem.code, problem.seq) for seen in self.refusals[-WINDOW:])
            if not (known and problem.seq is not None):
                self.refusals.append(problem)
                del self.refusals[:-REFUSALS_KEPT]
                if self._raises:
                    self._unraised.append(problem)
            self._changed.notify_all()
        if self._on_rejected is not None and not known:
            try:
                self._on_rejected(problem)
            except Exception:
                _log.exception("on_rejected failed for the refusal of event %s", problem.seq)

    def planner_came(self) -> None:
        """The planner's token is there: ask what it has."""
        self._resync_wanted = True

    def planner_went(self) -> None:
        """The planner's token is gone: what is sent now would vanish."""
        self._planner_present = False

    def _run(self) -> None:
        while not self._closing:
            self._read_news()
            if self._broken is None:
                self._transmit()
                if self._resync_wanted or self._stalled():
                    self._resynchronise()

    def _read_news(self) -> None:
        pause_s = self._pause_s()
        try:
            while True:
                work = self._news.get(timeout=pause_s)
                pause_s = 0.0
                try:
                    work()
                except BadReply as error:
                    _log.warning("mission %s: %s", self.mission, error)
                    self._resync_wanted = True
        except queue.Empty:
            pass

    def _pause_s(self) -> float:
        with self._changed:
            if self._resync_wanted or (self._planner_present and self._outbox.unsent and not self._broken):
                return 0.0
            if self._outbox.settled or self._broken:
                return STALL_LAST_S
            return max(0.0, self._last_progress_s + self._patience_s - time.monotonic())

    def _transmit(self) -> None:
        if not self._planner_present:
            return
        with self._changed:
            entries = self._outbox.take(BATCH)
        for entry in entries:
            self._link.send(entry)

    def _stalled(self) -> bool:
        with self._changed:
            waited_s = time.monotonic() - self._last_progress_s
            return not self._outbox.settled and waited_s >= self._patience_s

    def _resynchronise(self) -> None:
        self._resync_wanted = False
        try:
            status = self._link.ingest(STALL_S)
        except MissionUnknown as error:
            self._break(MissionLost(f"The planner no longer knows mission {self.mission}: {error}"))
            return
        except PdnError as error:
            _log.info("mission %s: cannot ask the planner which events it has: %s", self.mission, error)
            self._waited_in_vain()
            return
        lost = self._outbox.lost(status.next_seq)
        if lost:
            self._break(
                MissionLost(
                    f"The planner has lost {lost} events of mission {self.mission} that it had confirmed, from {status.next_seq} on. "
                    "Configure a new mission, or let the daemon keep a journal."
                )
            )
        elif status.next_seq > self._outbox.next_seq:
            self._break(
                StreamBroken(
                    f"Another program sends events of mission {self.mission}: the planner is at {status.next_seq}, this stream at {self._outbox.next_seq}."
                )
            )
        else:
            with self._changed:
                self._planner_present = True
                if self._outbox.resynchronise(status.next_seq, status.durable_seq):
                    self._progressed()
                else:
                    self._waited_in_vain()

    def _progressed(self) -> None:
        self._last_progress_s = time.monotonic()
        self._patience_s = STALL_S
        self._changed.notify_all()

    def _waited_in_vain(self) -> None:
        self._last_progress_s = time.monotonic()
        self._patience_s = min(2.0 * self._patience_s, STALL_LAST_S)

    def _break(self, error: PdnError) -> None:
        with self._changed:
            self._broken = error
            self._changed.notify_all()

    # -- small parts ---------------------------------------------------------------------------------------------------

    def _wake(self) -> None:
        if self._news.empty():
            self.hand_over(lambda: None)

    def _raise_pending(self) -> None:
        if self._unraised:
            raise EventsRefused(self._take_unraised())
        if self._broken is not None:
            raise self._broken

    def _take_unraised(self) -> list[ProblemLike]:
        problems, self._unraised = self._unraised, []
        return problems
