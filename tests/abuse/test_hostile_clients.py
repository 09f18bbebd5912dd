"""No client keeps the others from going on, whatever it does; see `hostile.py` for what they do.

A step of the good vehicle takes a few milliseconds. What is asserted of it under attack is `STEP_S`: room for a busy
machine of two cores, on which the attacker runs as well, and for events that found no room in a flood and are sent
again after 0.75 s and more.
"""

import json
import signal
import time

import pytest

from attack import Good, descriptors, hostile
from conftest import Daemon, wait_until
from json_zenoh import open_session

STEP_S = 5.0


def under(attack: str, times: list[float]) -> None:
    times = sorted(times)
    print(f"{attack}: {len(times)} steps, median {1e3 * times[len(times) // 2]:.1f} ms, "
          f"greatest {1e3 * times[-1]:.0f} ms")  # fmt: skip
    assert times[-1] < STEP_S


@pytest.mark.parametrize("pattern", ["pdn/good/v1/out/*", "pdn/good/v1/in/*", "**"])
def test_a_listener_that_never_reads(target: Daemon, good: Good, pattern: str) -> None:
    with hostile("never_reads", target.endpoint, pattern) as client:
        # Its subscription takes a moment to arrive.
        wait_until(lambda: good.step() >= 0.0 and client.has_spoken(), "the listener to hear of a step")
        assert client.says() == "blocked"
        # Each is refused aloud, which fills what stands between the daemon and the listener.
        with hostile("sends_rubbish", target.endpoint, "good", "150000") as flood:
            under(f"a listener to {pattern} that never reads", good.steps_until(flood))
    if "in" not in pattern:
        assert "publications were left out" in target.log.read_text(), "the listener was no burden"


def test_a_listener_that_is_frozen(target: Daemon, good: Good) -> None:
    with hostile("listens", target.endpoint, "**") as client:
        client.process.send_signal(signal.SIGSTOP)
        with hostile("sends_rubbish", target.endpoint, "good", "150000") as flood:
            under("a frozen listener", good.steps_until(flood))


def test_one_that_asks_and_never_reads(target: Daemon, good: Good) -> None:
    for _ in range(50):
        good.step()
    with hostile("asks_and_never_reads", target.endpoint, "good"):
        give_up_s = time.monotonic() + 12.0
        times = []
        while time.monotonic() < give_up_s:
            times.append(good.step())
        under("one that asks and never reads", times)


def test_silent_connections(target: Daemon, good: Good) -> None:
    before = descriptors(target)
    with hostile("says_nothing", target.endpoint, "150"):
        began = time.monotonic()
        with open_session(target.endpoint):
            took_s = time.monotonic() - began
        print(f"a new client came in within {took_s:.2f} s beside 150 silent connections")
        assert took_s < 2.0
        under("150 silent connections", [good.step() for _ in range(50)])
        wait_until(lambda: descriptors(target) < before + 10, "silent connections to be given up")


@pytest.mark.parametrize("attack", ["sends_10_mb", "sends_rubbish 20000", "sends_far_ahead"])
def test_a_flood(target: Daemon, good: Good, attack: str) -> None:
    good.step()
    name, *arguments = attack.split()
    with hostile(name, target.endpoint, "good", *arguments) as client:
        under(attack, good.steps_until(client))
        assert client.says() == "done"
    status = good.client.ingest()
    assert (status.next_seq, status.rejected) == (good.last + 1, 0)
    assert status.buffered <= 1024


@pytest.mark.parametrize("what", ["vehicles", "missions"])
def test_a_thousand(target: Daemon, good: Good, what: str) -> None:
    with hostile("configures", target.endpoint, what) as client:
        under(f"a thousand {what}", good.steps_until(client))
        codes = json.loads(client.says())
    if what == "vehicles":
        assert codes == {"ok": 15, "limit": 985}  # max_vehicles is 16, and the good one came first.
    else:
        assert codes == {"ok": 1000}  # Each gives way to the next; max_missions = 16 of them are kept.
