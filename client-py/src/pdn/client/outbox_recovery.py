"""Recovers the outbox of an earlier program from its file and from what the planner has of it."""

from __future__ import annotations

from .errors import MissionLost, TwoPublishers
from .outbox import Outbox
from .outbox_file import OutboxFile
from .transport import IngestStatus


def recover_outbox(store: OutboxFile, status: IngestStatus, window: int) -> Outbox:
    """The outbox that continues where the file ends.

    What the file has kept is sent again whatever the planner has applied of it: a repeat counts for nothing,
    and one with other content tells of a second program.

    Raises `MissionLost` if the planner lacks events that it had confirmed, and `TwoPublishers` if it has
    events that the file never had.
    """
    if store.next_seq is None:
        store.begin(status.next_seq)
        return Outbox(status.next_seq, window)
    # Of older ones the planner had said that they are durable: no more than the window were ever under way.
    while len(store.entries) > window:
        store.trim(store.entries[0].seq + 1)
    first = store.entries[0].seq if store.entries else store.next_seq
    if status.next_seq < first:
        raise MissionLost(
            f"The planner has lost events of mission {store.mission} that it had confirmed, from "
            f"{status.next_seq} on; the outbox {store.path} begins at {first}. Configure a new mission."
        )
    if status.next_seq > store.next_seq:
        raise TwoPublishers(
            f"Another program sends events of mission {store.mission}: the planner is at {status.next_seq}, "
            f"the outbox {store.path} at {store.next_seq}. Stop it, or name another folder to go on there."
        )
    outbox = Outbox(first, window)
    for entry in store.entries:
        outbox.append(entry)
    return outbox
