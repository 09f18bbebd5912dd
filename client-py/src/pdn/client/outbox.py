"""The events that the planner has not yet confirmed, and which of them to send next.

Zenoh alone loses publications when a link breaks or a reader is slow, so that nothing is lost and nothing
counted twice is decided here: numbers without gaps, a window, and going back to the first number that did
not arrive (go-back-N). This file is that rule alone: no network, no clock, no thread.

    durable_seq <= applied_seq <= cursor <= next_seq        next_seq - durable_seq <= window
    |----------- kept: sent, perhaps again ------------|
                                |-- to send now --|
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from pdn.wire import limits

WINDOW = limits.EVENT_WINDOW
"""Events that may wait for confirmation at most."""


@dataclass(frozen=True, slots=True)
class Entry:
    """An event as it travels: number, key, bytes and the encoding that names them."""

    seq: int
    key: str
    payload: bytes
    encoding: str


class Outbox:
    """The window of events that are numbered but not known to be durable."""

    def __init__(self, next_seq: int = 0, window: int = WINDOW) -> None:
        """Begins at `next_seq`, the first number that the planner has not applied."""
        if not 1 <= window <= WINDOW:
            raise ValueError(f"the window must be 1 to {WINDOW} events, not {window}")
        self.window = window
        self.next_seq = next_seq
        self.durable_seq = next_seq
        self.applied_seq = next_seq
        self._cursor = next_seq
        self._entries: deque[Entry] = deque()

    @property
    def full(self) -> bool:
        """Whether the next event must wait."""
        return len(self._entries) >= self.window

    @property
    def empty(self) -> bool:
        """Whether every event is durable."""
        return not self._entries

    @property
    def unsent(self) -> int:
        """Events that `take` would hand out now."""
        return self.next_seq - self._cursor

    def awaits(self, seq: int) -> bool:
        """Whether that event is not yet known to be applied."""
        return self.applied_seq <= seq < self.next_seq

    def append(self, entry: Entry) -> None:
        """Keeps the next event. Its number must be `next_seq`, and the window must not be full."""
        if entry.seq != self.next_seq:
            raise ValueError(f"event {entry.seq} is not the next one, {self.next_seq}")
        if self.full:
            raise ValueError(f"the window of {self.window} events is full")
        self._entries.append(entry)
        self.next_seq += 1

    def take(self, limit: int) -> list[Entry]:
        """The next events to send, at most `limit`; they count as sent."""
        first = self._cursor - self.durable_seq
        taken = [self._entries[index] for index in range(first, min(first + limit, len(self._entries)))]
        self._cursor += len(taken)
        return taken

    def acknowledge(self, applied_seq: int, durable_seq: int) -> bool:
        """Takes in an acknowledgement and drops what is durable; True if it says anything new.

        Acknowledgements may be old or come twice: only the greatest counts. `resynchronise` is for news
        that may go back.
        """
        applied_seq = min(applied_seq, self.next_seq)
        durable_seq = min(durable_seq, applied_seq)
        if applied_seq <= self.applied_seq and durable_seq <= self.durable_seq:
            return False
        self.applied_seq = max(self.applied_seq, applied_seq)
        self._drop_below(durable_seq)
        self._cursor = max(self._cursor, self.applied_seq)
        return True

    def resynchronise(self, applied_seq: int, durable_seq: int) -> bool:
        """Goes back, or forth, to what the planner says it has now; True if that is progress.

        Where it has less than it had confirmed as durable, no resending helps: ask `lost` first.
        """
        progress = applied_seq > self.applied_seq or durable_seq > self.durable_seq
        self._drop_below(min(durable_seq, applied_seq, self.next_seq))
        self.applied_seq = min(max(applied_seq, self.durable_seq), self.next_seq)
        self._cursor = self.applied_seq
        return progress

    def lost(self, applied_seq: int) -> int:
        """How many events the planner would need again that are kept no longer: more than 0 is beyond
        repair.
        """
        return max(0, self.durable_seq - applied_seq)

    def _drop_below(self, durable_seq: int) -> None:
        while self._entries and self._entries[0].seq < durable_seq:
            self._entries.popleft()
        self.durable_seq = max(self.durable_seq, durable_seq)
