"""The transport of one mission's events: sending them, and asking which have arrived."""

from __future__ import annotations

import time
from collections.abc import Sequence

from pdn import wire

from .errors import MissionGap
from .outbox import Entry
from .vehicle_session import VehicleSession

GAP_TIMEOUT_S = 2.0
"""How long events of an earlier sender may still be on their way, s."""


class MissionTransport:
    """See `Transport`."""

    def __init__(self, session: VehicleSession, mission: str) -> None:
        self._session = session
        self._mission = mission

    def send(self, entry: Entry) -> None:
        """Publishes an event."""
        self._session.send(entry)

    def ingest(self, timeout_s: float) -> wire.IngestStatus:
        """Asks which events have arrived."""
        parameters = {"mission": self._mission}
        return self._session.ask(wire.Topic.RPC_INGEST, wire.IngestStatus, timeout_s, parameters=parameters)


def status_without_gaps(transport: MissionTransport, mission: str, timeout_s: float) -> wire.IngestStatus:
    """The status once nothing is on its way; a gap that stays can be closed by its first sender only."""
    give_up_s = time.monotonic() + GAP_TIMEOUT_S
    while (status := transport.ingest(timeout_s)).buffered:
        if time.monotonic() > give_up_s:
            raise MissionGap(
                f"Mission {mission} has {status.buffered} events that wait for {_ranges(status.missing)}, "
                "which never arrived. "
                "Only their first sender can send them; otherwise abort the mission and configure a new one."
            )
        time.sleep(0.05)
    return status


def _ranges(missing: Sequence[tuple[int, int]]) -> str:
    return ", ".join(str(first) if first == last else f"{first} to {last}" for first, last in missing)
