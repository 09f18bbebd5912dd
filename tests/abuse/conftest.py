"""A daemon for one attack, and a vehicle on it that must go on."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from pdn.client import connect

from attack import BUDGET_MIB, VEHICLE, Good, descriptors, memory_mib
from conftest import Daemon, start_daemon


@pytest.fixture
def target(tmp_path: Path) -> Iterator[Daemon]:
    """A daemon for one attack; it must have kept to its memory and must end well."""
    running = start_daemon(tmp_path)
    yield running
    peak_mib = memory_mib(running, "VmHWM")
    print(f"greatest memory {peak_mib:.0f} MiB, {descriptors(running)} descriptors at the end")
    assert peak_mib < BUDGET_MIB
    assert running.stop() == 0, running.log.read_text()


@pytest.fixture
def bystander(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Good]:
    """A vehicle on a daemon of its own that nobody attacks."""
    running = start_daemon(tmp_path_factory.mktemp("bystander"))
    with connect(VEHICLE, running.endpoint, timeout_s=20.0) as client:
        yield Good(client)
    assert running.stop() == 0, running.log.read_text()


@pytest.fixture
def good(target: Daemon, bystander: Good) -> Iterator[Good]:
    """A vehicle on that daemon that must go on as if nothing were."""
    with connect(VEHICLE, target.endpoint, timeout_s=20.0) as client:
        yield Good(client, bystander)
