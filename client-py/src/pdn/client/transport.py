"""What the sender needs of the network: a way to send, and one question; tests bring their own."""

from __future__ import annotations

from typing import Protocol

from .outbox import Entry


class IngestStatus(Protocol):
    """What `rpc/ingest` answers: `pdn.wire.IngestStatus`."""

    @property
    def next_seq(self) -> int:
        """All events below are applied."""

    @property
    def durable_seq(self) -> int:
        """All events below are durable."""

    @property
    def rejected(self) -> int:
        """Events refused so far."""


class Transport(Protocol):
    """Carries one mission's events to the planner."""

    def send(self, entry: Entry) -> None:
        """Publishes an event; may block while the link is slow."""

    def ingest(self, timeout_s: float) -> IngestStatus:
        """Asks which events have arrived; raises a `PdnError`."""
