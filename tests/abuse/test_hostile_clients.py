"""No client keeps the others from going on, whatever it does; see `hostile.py` for what they do.

A step of the good vehicle takes a few milliseconds. Under attack it is compared with the steps that a
bystander takes at the same time, see `attack.Good`; an event that found no room in a flood is sent again by
the client's timers, which no machine makes slower. The client's time-out bounds each step as well.
"""

import json
import signal
import time
from statistics import median

import pytest
from pdn.client.backoff import STALL_S

from attack import Good, descriptors, hostile
from conftest import Daemon, wait_until
from json_zenoh import open_session

RESENT_S = STALL_S * (1 + 2 + 4)
"""How long the client's backoff holds back an event that finds no room three times, s."""

SLOWER = 200.0
"""How much longer than a bystander's median step any step may take beyond that; at most 40 was measured."""

OPEN_SLOWER = 20.0
"""The same of the median time to connect; at most 1.3 was measured."""

STEP_S = 5.0
OPEN_S = 2.0
"""Longest step, and longest time to connect, on a quiet machine, s."""

ATTACK_S = 12.0
"""How long one asks and never reads: longer than what stands between it and the daemon can take in."""


Times = list[tuple[float, float]]
"""Of what is attacked and of the bystander, s."""


def judge(attack: str, times: Times, quiet_machine: bool) -> None:
    attacked, beside = told(f"{attack}: {len(times)} steps", times)
    assert attacked[-1] < RESENT_S + SLOWER * median(beside)
    if quiet_machine:
        assert attacked[-1] < STEP_S


def judge_opening(attack: str, times: Times, quiet_machine: bool) -> None:
    attacked, beside = told(f"{attack}: {len(times)} new clients", times)
    assert median(attacked) < OPEN_SLOWER * median(beside)
    if quiet_machine:
        assert attacked[-1] < OPEN_S


def told(what: str, times: Times) -> tuple[list[float], list[float]]:
    """Prints the times; returns both sorted."""
    attacked, beside = (sorted(column) for column in zip(*times, strict=True))
    print(
        f"{what}, median {1e3 * median(attacked):.1f} ms, greatest {1e3 * attacked[-1]:.0f} ms; "
        f"beside, median {1e3 * median(beside):.1f} ms, greatest {1e3 * beside[-1]:.0f} ms"
    )
    return attacked, beside


@pytest.mark.parametrize("pattern", ["pdn/good/v1/out/*", "pdn/good/v1/in/*", "**"])
def test_a_listener_that_never_reads(target: Daemon, good: Good, quiet_machine: bool, pattern: str) -> None:
    with hostile("never_reads", target.endpoint, pattern) as client:
        # Its subscription takes a moment to arrive.
        wait_until(lambda: good.step() >= 0.0 and client.has_spoken(), "the listener to hear of a step")
        assert client.says() == "blocked"
        # Each is refused aloud, which fills what stands between the daemon and the listener.
        with hostile("sends_rubbish", target.endpoint, "good", "150000") as flood:
            judge(f"a listener to {pattern} that never reads", good.steps_until(flood), quiet_machine)
    if "in" not in pattern:
        assert "publications were left out" in target.log.read_text(), "the listener was no burden"


def test_a_listener_that_is_frozen(target: Daemon, good: Good, quiet_machine: bool) -> None:
    with hostile("listens", target.endpoint, "**") as client:
        client.process.send_signal(signal.SIGSTOP)
        with hostile("sends_rubbish", target.endpoint, "good", "150000") as flood:
            judge("a frozen listener", good.steps_until(flood), quiet_machine)


def test_one_that_asks_and_never_reads(target: Daemon, good: Good, quiet_machine: bool) -> None:
    for _ in range(50):
        good.step()
    with hostile("asks_and_never_reads", target.endpoint, "good"):
        ends_s = time.monotonic() + ATTACK_S
        times = []
        while time.monotonic() < ends_s:
            times.append(good.step_beside())
        judge("one that asks and never reads", times, quiet_machine)


def test_silent_connections(target: Daemon, good: Good, quiet_machine: bool) -> None:
    before = descriptors(target)
    with hostile("says_nothing", target.endpoint, "150"):
        times = [
            (time_to_open(target.endpoint), time_to_open(good.bystander.client.endpoint)) for _ in range(5)
        ]
        judge_opening("150 silent connections", times, quiet_machine)
        judge("150 silent connections", [good.step_beside() for _ in range(50)], quiet_machine)
        wait_until(lambda: descriptors(target) < before + 10, "silent connections to be given up")


def time_to_open(endpoint: str) -> float:
    began_s = time.monotonic()
    with open_session(endpoint):
        return time.monotonic() - began_s


@pytest.mark.parametrize("attack", ["sends_10_mb", "sends_rubbish 20000", "sends_far_ahead"])
def test_a_flood(target: Daemon, good: Good, quiet_machine: bool, attack: str) -> None:
    good.step()
    name, *arguments = attack.split()
    with hostile(name, target.endpoint, "good", *arguments) as client:
        judge(attack, good.steps_until(client), quiet_machine)
        assert client.says() == "done"
    status = good.client.ingest()
    assert (status.next_seq, status.rejected) == (good.last + 1, 0)
    assert status.buffered <= 1024


@pytest.mark.parametrize("what", ["vehicles", "missions"])
def test_a_thousand(target: Daemon, good: Good, quiet_machine: bool, what: str) -> None:
    with hostile("configures", target.endpoint, what) as client:
        judge(f"a thousand {what}", good.steps_until(client), quiet_machine)
        codes = json.loads(client.says())
    if what == "vehicles":
        assert codes == {"ok": 15, "limit": 985}  # max_vehicles is 16, and the good one came first.
    else:
        assert codes == {"ok": 1000}  # Each gives way to the next; max_missions = 16 of them are kept.
