"""A vehicle that goes on under attack (our client, which sends again what was not taken), programs that
attack, and what the daemon is measured by.
"""

import os
import select
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from pdn import wire
from pdn.client import Client

from conftest import Daemon
from survey import config

BUDGET_MIB = 512
"""What the daemon may take up under any of these attacks, with the default limits (deploy/README.md)."""

STEP = wire.Pose(translation=(0.1, 0.0, 0.0), rotation=(0.0, 0.0, 0.0, 1.0))
START = wire.Pose(translation=(0.0, 0.0, 8.0), rotation=(0.0, 0.0, 0.0, 1.0))
COVARIANCE = 1e-4 * np.eye(6)
VEHICLE, MISSION = "good", "good-1"


class Good:
    """A vehicle that tells a keyframe at a time and asks where it is.

    Beside each step a bystander takes one as well: a vehicle of the same kind on a daemon of its own, which
    nobody attacks. What makes the machine slow, makes both slow.
    """

    def __init__(self, client: Client, bystander: "Good | None" = None) -> None:
        self.bystander = bystander
        self.client = client
        self.keyframes = 0
        self.last = -1
        client.configure(config(MISSION))
        client.start("the attack begins")
        # What others send under this vehicle's keys is refused on its topic too.
        self.events = client.mission_stream(on_rejected="collect")

    def step(self) -> float:
        """One keyframe with its odometry, applied and asked for; the time that took, s."""
        began = time.monotonic()
        number = self.keyframes
        self.last = self.events.keyframe(number, START if number == 0 else None, saliency=(0.5, 0.5))
        if number:
            self.last = self.events.odometry(number - 1, number, STEP, COVARIANCE)
        self.keyframes += 1
        assert self.client.mission(after=self.last).keyframes == self.keyframes
        return time.monotonic() - began

    def step_beside(self) -> tuple[float, float]:
        """A step and one of the bystander; the times that both took, s."""
        assert self.bystander is not None
        return self.step(), self.bystander.step()

    def steps_until(self, ended: "Hostile", bound_s: float = 60.0) -> list[tuple[float, float]]:
        """Steps beside the bystander's until the other program has ended."""
        times, give_up_s = [], time.monotonic() + bound_s
        while ended.process.poll() is None:
            assert time.monotonic() < give_up_s, f"{ended.name} has not ended within {bound_s} s"
            times.append(self.step_beside())
        return times


class Hostile:
    """A running program of `hostile.py`."""

    def __init__(self, name: str, *arguments: str) -> None:
        self.name = name
        command = [sys.executable, str(Path(__file__).with_name("hostile.py")), name, *arguments]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, bufsize=0)

    def says(self) -> str:
        """The next line that it prints."""
        assert self.process.stdout is not None
        line = self.process.stdout.readline()
        assert line, f"{self.name} ended with {self.process.wait()}"
        return line.decode().strip()

    def has_spoken(self) -> bool:
        """Whether a line that it has printed waits to be read."""
        return bool(select.select([self.process.stdout], [], [], 0.0)[0])


@contextmanager
def hostile(name: str, *arguments: str) -> Iterator[Hostile]:
    """A hostile client that has begun; killed at the end."""
    running = Hostile(name, *arguments)
    try:
        running.says()
        yield running
    finally:
        running.process.kill()
        running.process.wait()


def memory_mib(daemon: Daemon, what: str = "VmRSS") -> float:
    """What the daemon takes up (`VmRSS`), or took up at most (`VmHWM`)."""
    for line in Path(f"/proc/{daemon.process.pid}/status").read_text().splitlines():
        if line.startswith(f"{what}:"):
            return int(line.split()[1]) / 1024
    raise AssertionError(f"no {what}")


def descriptors(daemon: Daemon) -> int:
    """Open files and sockets of the daemon."""
    return len(os.listdir(f"/proc/{daemon.process.pid}/fd"))
