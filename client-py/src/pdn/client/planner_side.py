"""What the sender needs of the planner: a way to send, and one question; tests bring their own."""

from __future__ import annotations

from typing import Protocol

from .outbox import Entry


class Status(Protocol):
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


class Link(Protocol):
    """The way to the planner."""

    def send(self, entry: Entry) -> None:
        """Publishes an event; may block while the link is slow."""

    def ingest(self, timeout_s: float) -> Status:
        """Asks which events have arrived; raises a `PdnError`."""
