"""What can go wrong between a program and the planner.

Every error of this library is a `PdnError`, so that one `except` covers all of them:

    PdnError
    ├── ConnectionFailed      no session with the daemon
    ├── PlannerAbsent         a session, but no planner that answers for this vehicle
    ├── NotAllowed            the planner is there, but access rules keep this client from it
    ├── Timeout               the planner is there, but something did not come in time
    │   └── OutboxFull        an event found no room in the window in time
    ├── Refused               the planner said no: code, message, seq
    │   ├── Overloaded, Conflict, IllegalTransition, MissionUnknown
    │   ├── DeadlineMissed    also a Timeout
    │   └── EventsRefused     one or more events of a stream were refused
    ├── OutboxUnusable        the outbox on disk is damaged, another's, in use or cannot be written
    ├── StreamBroken          a mission's events cannot go on as they are
    │   ├── MissionLost       the planner no longer has events that it had confirmed
    │   ├── TwoPublishers     another program sends events of the mission under the same numbers
    │   └── MissionGap        the planner waits for events that this stream never had
    ├── Closed                the client, stream or watch was closed, here or by another thread
    ├── Forked                the process was forked from one that had connected
    └── BadReply              an answer that this version cannot read
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol


class ProblemLike(Protocol):
    """What a refusal carries on the wire: `pdn.wire.Problem`."""

    @property
    def code(self) -> str:
        """A code of `schemas/errors.md`."""

    @property
    def message(self) -> str:
        """What is wrong, where, and what to do."""

    @property
    def seq(self) -> int | None:
        """The event's number; None for a question."""


class PdnError(Exception):
    """Any failure of this library."""


class ConnectionFailed(PdnError):
    """There is no session with the daemon; the message says what is probably wrong."""


class PlannerAbsent(PdnError):
    """The session stands, but nobody answers for this vehicle: not ready, another vehicle, or no access."""


class NotAllowed(PdnError):
    """The planner is there, but access rules keep this client's question, command or events from it."""


class Timeout(PdnError):
    """Something did not come in time."""


class OutboxFull(Timeout):
    """An event found no room among those not yet durable; it was not taken and may be sent again."""


class OutboxUnusable(PdnError):
    """The outbox on disk is damaged, another's, in use, or cannot be written; the message says which."""


class StreamBroken(PdnError):
    """The events of a mission cannot go on as they are; the stream takes no more."""


class MissionLost(StreamBroken):
    """The planner no longer has events that it had confirmed as durable, or not the mission itself."""


class TwoPublishers(StreamBroken):
    """Another program sends events of this mission under the same numbers; one of the two must stop."""


class MissionGap(StreamBroken):
    """The planner waits for events that this stream never had; only their first sender can bring them."""


class Closed(PdnError):
    """The client, stream or watch was closed, by this program, before or during the call."""


class Forked(PdnError):
    """This process was forked from one that had connected; Zenoh's threads did not come along."""


class BadReply(PdnError):
    """An answer that this version cannot read."""


class Refused(PdnError):
    """The planner said no.

    `code` is one of the codes of `schemas/errors.md`, `message` says what to do, `seq` is the number of the
    event concerned or None.
    """

    def __init__(self, code: str, message: str, seq: int | None = None) -> None:
        super().__init__(message)
        self.code = code
        self.message = message
        self.seq = seq

    def __reduce__(self) -> tuple[type[Refused], tuple[str, str, int | None]]:
        return type(self), (self.code, self.message, self.seq)

    def __str__(self) -> str:
        where = "" if self.seq is None else f" (event {self.seq})"
        return f"{self.message} [{self.code}]{where}"


class Overloaded(Refused):
    """The planner had no room for the question, however often it was asked in the time there was."""


class DeadlineMissed(Refused, Timeout):
    """The deadline passed before there was an answer."""


class Conflict(Refused):
    """The same number, or the same mission, has come before with other content."""


class IllegalTransition(Refused):
    """The mission's phase does not allow the command; the message names what is legal."""


class MissionUnknown(Refused):
    """The planner has no such mission, or none at all."""


class EventsRefused(Refused):
    """Events of a stream were refused for their content; the others went on.

    `problems` are the refusals not reported before, oldest first; `code`, `message` and `seq` are the first
    one's.
    """

    def __init__(self, problems: Sequence[ProblemLike], unreported: int = 0) -> None:
        self.problems = tuple(problems)
        self.unreported = unreported
        if self.problems:
            first = self.problems[0]
            super().__init__(first.code, first.message, first.seq)
        else:
            super().__init__(
                "unreported", f"{unreported} events were refused while their reasons could not be received"
            )

    def __str__(self) -> str:
        more = len(self.problems) - 1 + (self.unreported if self.problems else 0)
        return super().__str__() + (f", and {more} more refused" if more > 0 else "")


_BY_CODE: dict[str, type[Refused]] = {
    "overloaded": Overloaded,
    "deadline": DeadlineMissed,
    "conflict": Conflict,
    "illegal_transition": IllegalTransition,
    "unknown_mission": MissionUnknown,
    "unknown_vehicle": MissionUnknown,
    "no_mission": MissionUnknown,
}


def refused(problem: ProblemLike) -> Refused:
    """The error of a refusal, by its code."""
    return _BY_CODE.get(problem.code, Refused)(problem.code, problem.message, problem.seq)
