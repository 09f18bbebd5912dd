"""A real daemon for the tests of this folder."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from running import Daemon

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture
def daemon(endpoint: str, tmp_path: Path) -> Iterator[Daemon]:
    """A daemon of its own for a test; skipped without a binary, unless PDND_BINARY promises one."""
    binary = Path(os.environ.get("PDND_BINARY", ROOT / "target/release/pdnd"))
    if not binary.exists() and "PDND_BINARY" not in os.environ:
        pytest.skip(f"needs the daemon: looked for {binary}; build it, or set PDND_BINARY")
    running = Daemon(binary, endpoint, tmp_path)
    try:
        running.start()
        yield running
    finally:
        running.kill()
