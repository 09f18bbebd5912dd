"""The events that the planner refused, and which of the refusals the caller has not been told of."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

from .errors import EventsRefused, ProblemLike
from .outbox import WINDOW

CAPACITY = 1000
"""Refusals that are remembered; of more only the last."""

TRANSIENT = frozenset({"overloaded", "not_ready"})
"""Codes that say nothing about the event: it was not looked at, keeps its number and will be sent again."""

FINAL = frozenset({"mission_ended", "unknown_mission", "no_mission", "unknown_vehicle"})
"""Codes that say that the mission takes no events: the stream ends, these numbers stay unused."""

OnRejected = Callable[[ProblemLike], None]


class Refusals:
    """What was refused so far. Not safe for threads; the sender guards it."""

    def __init__(self, counted: int, *, raises: bool) -> None:
        """Begins where the planner has counted `counted`; with `raises` refusals wait to be raised."""
        self.counted = counted
        self.all: deque[ProblemLike] = deque(maxlen=CAPACITY)
        self._recent: deque[tuple[str, int]] = deque()
        self._known: set[tuple[str, int]] = set()
        self._raises = raises
        self._unreported: deque[ProblemLike] = deque(maxlen=CAPACITY)

    def add(self, problem: ProblemLike) -> bool:
        """Takes in a refusal; True if it is a new one about an event's content."""
        if problem.code in TRANSIENT:
            return False
        if problem.code not in FINAL | {
            "conflict"
        }:  # Those consume no number, and the planner counts them not.
            self.counted += 1
        if problem.seq is not None and not self._is_new(problem.code, problem.seq):
            return False
        self.all.append(problem)
        if self._raises and problem.code not in FINAL:
            self._unreported.append(problem)
        return True

    def raise_new(self) -> None:
        """Raises what has not been raised before, if there is any."""
        if self._unreported:
            raise EventsRefused(self._take_unreported())

    def raise_unannounced(self, counted_by_planner: int) -> None:
        """Raises, whatever the caller chose, if the planner has refused more events than were heard of."""
        unannounced = counted_by_planner - self.counted
        if unannounced > 0:
            self.counted = counted_by_planner
            raise EventsRefused(self._take_unreported(), unannounced)

    def _take_unreported(self) -> list[ProblemLike]:
        problems = list(self._unreported)
        self._unreported.clear()
        return problems

    def _is_new(self, code: str, seq: int) -> bool:
        """Whether this is not among the last `WINDOW` refusals of numbered events; from now on it is."""
        if (code, seq) in self._known:
            return False
        self._known.add((code, seq))
        self._recent.append((code, seq))
        if len(self._recent) > WINDOW:
            self._known.discard(self._recent.popleft())
        return True
