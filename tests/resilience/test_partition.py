"""A vehicle in a network of its own, and the cable between it and the daemon: cut, for a while, without a
word to either side (the packets vanish), and a daemon that stands still.
"""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest
from pdn.client import connect
from pdn.client.backoff import STALL_LAST_S
from pdn.client.session import RECONNECT_LAST_MS

from conftest import Daemon, free_port, outage, start_daemon, wait_until
from survey import config

TIMERS_S = STALL_LAST_S + 0.001 * RECONNECT_LAST_MS
"""The longest pauses of the client, before it asks which events have arrived and before it connects again, s.
They decide how long recovery takes, whatever the machine's load: it was 1.7 s at most.
"""

RATE = 20
"""Keyframes a second; with their odometry 40 events."""


@dataclass
class Cable:
    """A network namespace with one interface towards this one."""

    name: str
    outside: str
    here: str

    def cut_for(self, duration_s: float) -> None:
        run("ip", "link", "set", self.outside, "down")
        outage(duration_s)
        run("ip", "link", "set", self.outside, "up")


def run(*command: str) -> None:
    subprocess.run(command, check=True, capture_output=True)


@pytest.fixture
def cable() -> Iterator[Cable]:
    if os.geteuid() != 0 or subprocess.run(["ip", "netns"], capture_output=True, check=False).returncode != 0:
        pytest.skip("needs root and `ip netns`, for a network that can be cut")
    number = os.getpid() % 250
    cable = Cable(f"pdn-{os.getpid()}", f"pdnv{number}a", f"10.199.{number}.1")
    inside = f"pdnv{number}b"
    run("ip", "netns", "add", cable.name)
    try:
        run("ip", "link", "add", cable.outside, "type", "veth", "peer", "name", inside, "netns", cable.name)
        run("ip", "addr", "add", f"{cable.here}/24", "dev", cable.outside)
        run("ip", "link", "set", cable.outside, "up")
        within = ("ip", "-n", cable.name)
        run(*within, "addr", "add", f"10.199.{number}.2/24", "dev", inside)
        run(*within, "link", "set", inside, "up")
        yield cable
    finally:
        subprocess.run(["ip", "link", "del", cable.outside], capture_output=True, check=False)
        run("ip", "netns", "del", cable.name)


@dataclass
class Distant:
    """The vehicle's program at the other end, and what it has printed."""

    process: subprocess.Popen[str]
    lines: list[tuple[float, int, int]] = field(default_factory=list)

    def read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            at_s, told, durable = line.split()
            self.lines.append((float(at_s), int(told), int(durable)))

    def durable(self) -> int:
        return self.lines[-1][2] if self.lines else 0

    def end(self) -> None:
        assert self.process.stdin is not None
        self.process.stdin.close()
        assert self.process.wait(timeout=120) == 0


@pytest.fixture
def daemon(cable: Cable, tmp_path: Path) -> Iterator[Daemon]:
    running = start_daemon(tmp_path, "--listen", f"tcp/{cable.here}:{free_port()}")
    yield running
    assert running.stop() == 0


def begin(daemon: Daemon) -> None:
    with connect("auv", daemon.endpoint) as operator:
        operator.configure(config("m"))
        operator.start("the vehicle is at sea")


def distant(cable: Cable, daemon: Daemon) -> Distant:
    arguments = daemon.process.args
    assert isinstance(arguments, list)
    endpoint = next(word for word in arguments if cable.here in word)
    program = str(Path(__file__).with_name("distant_vehicle.py"))
    command = ["ip", "netns", "exec", cable.name, sys.executable, program, endpoint, str(RATE)]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    vehicle = Distant(process)
    threading.Thread(target=vehicle.read, daemon=True).start()
    wait_until(lambda: vehicle.durable() > 20, "the vehicle to be under way", 30.0)
    return vehicle


def recovery(vehicle: Distant, since_s: float, before: int) -> tuple[float, float]:
    """Times, s, until an event that was told during the break was durable, and until all of them were."""
    told_by_then = max(told for at_s, told, _ in vehicle.lines if at_s <= since_s)
    wait_until(lambda: vehicle.durable() >= told_by_then, "everything to arrive", 60.0)
    first = next(at_s for at_s, _, durable in vehicle.lines if at_s > since_s and durable > before)
    whole = next(at_s for at_s, _, durable in vehicle.lines if durable >= told_by_then)
    return first - since_s, whole - since_s


def judge_recovery(what: str, vehicle: Distant, before: int) -> None:
    """All that was told during an outage that ends now arrives before the timers have run out twice."""
    first_s, whole_s = recovery(vehicle, time.monotonic(), before)
    print(f"{what}: events go on after {first_s:.2f} s, all are there after {whole_s:.2f} s")
    assert whole_s < 2.0 * TIMERS_S


def judge(daemon: Daemon, vehicle: Distant) -> None:
    """Nothing is lost and nothing counted twice."""
    vehicle.end()
    told = vehicle.lines[-1][1]
    with connect("auv", daemon.endpoint) as operator:
        status = operator.ingest()
        assert (status.next_seq, status.buffered, status.rejected) == (told, 0, 0)
        assert operator.mission(after=told - 1).keyframes == (told + 1) // 2


@pytest.mark.timeout(240)
@pytest.mark.parametrize("duration_s", [2.0, 8.0, pytest.param(30.0, marks=pytest.mark.torture)])
def test_a_cable_that_is_cut(cable: Cable, daemon: Daemon, duration_s: float) -> None:
    begin(daemon)
    vehicle = distant(cable, daemon)
    before = vehicle.durable()
    cable.cut_for(duration_s)
    judge_recovery(f"a cable cut for {duration_s:g} s", vehicle, before)
    judge(daemon, vehicle)


@pytest.mark.timeout(240)
@pytest.mark.parametrize("duration_s", [2.0, pytest.param(30.0, marks=pytest.mark.torture)])
def test_a_daemon_that_stands_still(cable: Cable, daemon: Daemon, duration_s: float) -> None:
    begin(daemon)
    vehicle = distant(cable, daemon)
    daemon.process.send_signal(signal.SIGSTOP)
    before = vehicle.durable()
    outage(duration_s)
    daemon.process.send_signal(signal.SIGCONT)
    judge_recovery(f"a daemon still for {duration_s:g} s", vehicle, before)
    judge(daemon, vehicle)
