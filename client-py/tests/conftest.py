"""Fixtures of the client's tests."""

from __future__ import annotations

import signal
import socket
from collections.abc import Iterator

import pytest
from fake_planner import FakePlanner

# A run that a shell has started in the background ignores Ctrl-C, and so would the programs that it starts.
signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture
def endpoint() -> str:
    """A free endpoint on loopback."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


@pytest.fixture
def planner(endpoint: str) -> Iterator[FakePlanner]:
    """A fake planner that answers."""
    fake = FakePlanner(endpoint)
    fake.start()
    yield fake
    fake.stop()
