"""Questions beyond the bound are refused at once, while events and status on the same link go on; and a
backlog neither hides the state of things nor delays the end.

Times are those that a Python client sees, on a machine that may be busy with other things. They are compared
with what the same session sees at the same moment: of a vehicle that has nothing to do, and of the decisions
that are waited for. `make torture` asks for the figures of a quiet machine as well; tests/README.md has them.
"""

import json
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from statistics import median

import pytest
import zenoh

from conftest import Daemon, start_daemon
from json_zenoh import JsonVehicle, open_session
from survey import config, fly

FLOOD = 1000
TRIVIAL_EVERY = 10
"""Decisions of a flood between two trivial questions."""

REFUSED_LATER = 3.0
"""How much longer than an answer to a trivial question a refusal may take, in the median. Neither waits for
anything and both take as long (0.7 to 0.95 was measured); what waits for a decision takes 50 times as long.
"""

WAITED = 0.8
"""Share of the time that decisions are waited for, in the median, within which refusals (in the median) and
each status come. 0.02 and 0.3 at most were measured; what waits behind decisions takes as long as they
do.
"""

DRAIN_S = 0.4
ENDS_LATER = 20.0
"""How much longer than without a backlog the daemon may take to end, beyond `DRAIN_S`: it finishes what it is
at.
"""

REFUSED_S = 0.010
STATUS_S = 0.250
ENDED_S = 0.3
"""On a quiet machine: the median of refusals, each status, and the end beyond `DRAIN_S`, s."""


@pytest.fixture
def vehicle(target: Daemon) -> Iterator[JsonVehicle]:
    with open_session(target.endpoint) as session:
        yield begun(session)


def begun(session: zenoh.Session) -> JsonVehicle:
    """A vehicle with a mission that has something to decide about."""
    vehicle = JsonVehicle(session, "busy", "m")
    vehicle.ask("op/configure", config("m"))
    vehicle.ask("op/start", {"reason": "test"})
    fly(vehicle, lanes=6)
    vehicle.wait_applied()
    return vehicle


class Flood:
    """Decisions asked for all at once, and trivial questions among them; the time of each answer."""

    def __init__(self, vehicle: JsonVehicle, count: int) -> None:
        self.answers: list[tuple[str, float]] = []
        self._open = threading.Semaphore(0)
        self._count = 0
        idle = JsonVehicle(vehicle.session, "idle", "idle")
        idle.ask("op/configure", config("idle"))
        for number in range(count):
            self._ask(vehicle, "rpc/decision?detail=full")
            if number % TRIVIAL_EVERY == 0:
                self._ask(idle, "rpc/ingest", "trivial")

    def _ask(self, vehicle: JsonVehicle, question: str, kind: str = "decided") -> None:
        asked_s = time.monotonic()
        self._count += 1
        vehicle.session.get(
            f"{vehicle.root}/{question}", lambda reply: self._hear(reply, kind, asked_s), timeout=60.0
        )

    def _hear(self, reply: zenoh.Reply, kind: str, asked_s: float) -> None:
        took_s = time.monotonic() - asked_s
        code = kind if reply.ok is not None else json.loads(reply.err.payload.to_bytes())["code"]
        self.answers.append((code, took_s))
        self._open.release()

    def times(self) -> dict[str, list[float]]:
        """Times of the answers by code, once all are there."""
        for _ in range(self._count):
            assert self._open.acquire(timeout=60.0), "an answer is missing"
        codes = {code for code, _ in self.answers}
        return {code: sorted(took for other, took in self.answers if other == code) for code in codes}


def status_times(vehicle: JsonVehicle, count: int = 50) -> list[float]:
    times = []
    for _ in range(count):
        began_s = time.monotonic()
        vehicle.ask("rpc/ingest")
        times.append(time.monotonic() - began_s)
    return sorted(times)


def judge(what: str, answers: dict[str, list[float]], status: list[float], quiet_machine: bool) -> None:
    assert set(answers) == {"decided", "overloaded", "trivial"}
    decided_s, refused_s, trivial_s = (median(answers[code]) for code in ("decided", "overloaded", "trivial"))
    refused = answers["overloaded"]
    print(
        f"{what}: {len(refused)} of {FLOOD} refused, median {1e3 * refused_s:.1f} ms, "
        f"99 % within {1e3 * refused[99 * len(refused) // 100]:.1f} ms, last {1e3 * refused[-1]:.1f} ms; "
        f"trivial median {1e3 * trivial_s:.1f} ms; decided median {1e3 * decided_s:.1f} ms; "
        f"status median {1e3 * median(status):.1f} ms, greatest {1e3 * status[-1]:.1f} ms"
    )
    assert refused_s < REFUSED_LATER * trivial_s
    assert refused_s < WAITED * decided_s
    assert status[-1] < WAITED * decided_s
    if quiet_machine:
        assert refused_s < REFUSED_S
        assert status[-1] < STATUS_S


def test_a_flood_of_questions(vehicle: JsonVehicle, quiet_machine: bool) -> None:
    flood = Flood(vehicle, FLOOD)
    status = status_times(vehicle)
    fly_on(vehicle, 10)
    assert vehicle.wait_applied()["next_seq"] == vehicle.seq
    judge("flood", flood.times(), status, quiet_machine)


def test_a_flood_of_questions_behind_a_backlog_of_events(vehicle: JsonVehicle, quiet_machine: bool) -> None:
    fly_on(vehicle, 200)
    flood = Flood(vehicle, FLOOD)
    status = status_times(vehicle)
    judge("flood behind a backlog", flood.times(), status, quiet_machine)
    assert vehicle.wait_applied()["next_seq"] == vehicle.seq


def test_a_backlog_does_not_delay_the_end(tmp_path: Path, quiet_machine: bool) -> None:
    without_s, code, _ = time_to_end(tmp_path / "without", 0)
    assert code == 0
    took_s, code, log = time_to_end(tmp_path / "backlog", 400)
    print(
        f"ended with {code} after {took_s:.2f} s of drain_ms = {1e3 * DRAIN_S:.0f}; "
        f"without a backlog after {without_s:.2f} s"
    )
    # What could not be finished is told by the exit code and in the log.
    assert code == 1
    assert "events were left to be sent again" in log
    assert took_s < DRAIN_S + ENDS_LATER * without_s
    if quiet_machine:
        assert took_s < DRAIN_S + ENDED_S


def time_to_end(folder: Path, backlog: int) -> tuple[float, int, str]:
    """How long a daemon takes to end with so many keyframes before it, s; its exit code and its log."""
    folder.mkdir()
    daemon = start_daemon(folder, "--set", f"drain_ms={1e3 * DRAIN_S:.0f}")
    with open_session(daemon.endpoint) as session:
        vehicle = begun(session)
        fly_on(vehicle, backlog)
        if backlog:
            assert vehicle.ask("rpc/ingest")["next_seq"] < vehicle.seq
        began_s = time.monotonic()
        code = daemon.stop()
        return time.monotonic() - began_s, code, daemon.log.read_text()


def fly_on(vehicle: JsonVehicle, keyframes: int) -> None:
    """Many keyframes in a row with ties that contradict each other, so that each moves all the others."""
    level = [0.0, 0.0, 0.0, 1.0]
    covariance = [1e-4 if index % 7 == 0 else 0.0 for index in range(36)]
    first = 10_000
    for number in range(first, first + keyframes):
        pose = {"translation": [0.1 * (number - first), 0.0, 8.0], "rotation": level}
        saliency = {"saliency": {"local": 0.2, "global": 0.2}}
        vehicle.event("keyframe", {"id": number, "pose": pose, "camera": None, "appearance": saliency})
        if number == first:
            vehicle.event(
                "factor", {"factor": {"prior": {"keyframe": number, "pose": pose, "covariance": covariance}}}
            )
        for to in {number - 1, first + (number - first) // 2, first}:
            if first <= to < number:
                aside = 0.3 * (-1) ** number
                step = {"translation": [0.1 * (number - to), aside, 0.0], "rotation": level}
                body = {"from": to, "to": number, "relative": step, "covariance": covariance}
                vehicle.event("factor", {"factor": {"odometry" if to == number - 1 else "relative": body}})
