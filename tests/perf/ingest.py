"""What taking in an event costs a pdnd, beside other builds of it: events a second, and CPU time per 1000 events.

    python tests/perf/ingest.py OLD/pdnd NEW/pdnd

Each build takes the same bytes in turn, in several rounds, each in a daemon of its own with a journal. The medians over the
rounds are printed, and their ratios to the first build's. `owner` is the CPU time of the vehicle's thread, which decodes,
orders, folds and journals; `daemon` is that of all threads, the network's included.

The events are those that cost the solver little, so that what is left is taking them in: `links` are outcomes of
registrations, `repeats` is one event again and again, `navigation` is attitude and depth of few keyframes, `ahead` are
links of which the first of each 64 comes last. `survey` is a keyframe with odometry, attitude and depth each.
"""

import argparse
import json
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import zenoh
from pdn import wire
from pdn.client import connect
from pdn.client.session import open_session

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from conftest import Daemon, start_daemon

KEYFRAMES = 40
"""Keyframes that there are before the clock starts, in a line."""

WINDOW = 384
"""Events under way at most; a daemon takes 512 of one client."""

BOUND_S = 60.0

FLOOR = {"origin": [-2, -2, 8], "u": [0, 1, 0], "v": [1, 0, 0], "length_u_m": 4, "length_v_m": 24}
LEVEL = (0.0, 0.0, 0.0, 1.0)
COVARIANCE = np.diag(np.r_[np.full(3, 0.01), np.full(3, 0.001)] ** 2)


class Sent(NamedTuple):
    """An event as it travels."""

    topic: wire.Topic
    payload: bytes
    encoding: str
    next_seq: int
    """Once it is applied, all events below this are."""


class Cost(NamedTuple):
    """Of one run."""

    events_per_s: float
    owner_cpu_ms: float
    """Per 1000 events, as the next."""

    daemon_cpu_ms: float


Message = wire.Keyframe | wire.Factor | wire.LinkOutcome
TOPICS = {
    wire.Keyframe: wire.Topic.IN_KEYFRAME,
    wire.Factor: wire.Topic.IN_FACTOR,
    wire.LinkOutcome: wire.Topic.IN_LINK,
}


def links(mission: str, seq: int, count: int) -> list[Message]:
    at = range(count)
    return [
        wire.LinkOutcome(mission, seq + k, k, k % (KEYFRAMES - 9), k % (KEYFRAMES - 9) + 9, k % 3 > 0)
        for k in at
    ]


def repeats(mission: str, seq: int, count: int) -> list[Message]:
    """All but each 256th are the first one again."""
    told = links(mission, seq, 1 + count // 256)
    return [told[k // 256] if k % 256 == 255 else told[0] for k in range(count)]


def navigation(mission: str, seq: int, count: int) -> list[Message]:
    return [absolute(mission, seq + k, k % KEYFRAMES, k % 2 == 0) for k in range(count)]


def ahead(mission: str, seq: int, count: int) -> list[Message]:
    told = links(mission, seq, count)
    blocks = [told[first : first + 64] for first in range(0, count, 64)]
    return [event for block in blocks for event in [*block[1:], block[0]]]


def survey(mission: str, seq: int, count: int) -> list[Message]:
    return [event for k in range(count // 4) for event in keyframe(mission, seq + 4 * k, KEYFRAMES + k)]


WORK: dict[str, Callable[[str, int, int], list[Message]]] = {
    "links": links,
    "repeats": repeats,
    "navigation": navigation,
    "ahead": ahead,
    "survey": survey,
}


def keyframe(mission: str, seq: int, number: int) -> list[Message]:
    """One with odometry (the first: a prior), attitude and depth, half a metre from the one before."""
    covariance = tuple(COVARIANCE.ravel().tolist())
    if number == 0:
        tie: Any = wire.FactorKind.Prior(number, wire.Pose((0.0, 0.0, 6.5), LEVEL), covariance)
    else:
        tie = wire.FactorKind.Odometry(number - 1, number, wire.Pose((0.5, 0.0, 0.0), LEVEL), covariance)
    return [
        wire.Keyframe(
            mission=mission,
            seq=seq,
            stamp_ns=number,
            id=number,
            appearance=wire.Appearance.Saliency(0.2, 0.1),
        ),
        wire.Factor(mission, seq + 1, number, tie),
        absolute(mission, seq + 2, number, True),
        absolute(mission, seq + 3, number, False),
    ]


def absolute(mission: str, seq: int, number: int, is_depth: bool) -> wire.Factor:
    if is_depth:
        return wire.Factor(mission, seq, number, wire.FactorKind.Depth(number, 6.5, 4e-4))
    return wire.Factor(mission, seq, number, wire.FactorKind.Attitude(number, LEVEL, 2e-5, 2e-5))


def sent(messages: list[Message], form: wire.Format) -> list[Sent]:
    """The messages as payloads; each with the number up to which all are there once it is."""
    found, here = [], set[int]()
    next_seq = min(message.seq for message in messages)
    for message in messages:
        here.add(message.seq)
        while next_seq in here:
            next_seq += 1
        kind = type(message)
        payload = wire.encode(message, form)
        found.append(Sent(TOPICS[kind], payload, wire.encoding(kind, form), next_seq))
    return found


class Publisher:
    """Sends events, at most WINDOW of them beyond what is acknowledged."""

    def __init__(self, session: zenoh.Session, vehicle: str) -> None:
        self.acknowledged = 0
        self.subscriber = session.declare_subscriber(wire.key(vehicle, wire.Topic.OUT_ACK), self._hear)
        self.publishers = {
            (topic, encoding): session.declare_publisher(
                wire.key(vehicle, topic),
                encoding=encoding,
                congestion_control=zenoh.CongestionControl.BLOCK,
            )
            for kind, topic in TOPICS.items()
            for encoding in (wire.encoding(kind, form) for form in wire.Format)
        }

    def _hear(self, sample: zenoh.Sample) -> None:
        payload = sample.payload.to_bytes()
        form = wire.format_of(wire.Ack, str(sample.encoding))
        self.acknowledged = max(self.acknowledged, wire.decode(wire.Ack, payload, form).next_seq)

    def send(self, events: list[Sent]) -> None:
        """All of them, until they are applied."""
        for place, event in enumerate(events):
            if place >= WINDOW:
                self.wait(events[place - WINDOW].next_seq)
            self.publishers[event.topic, event.encoding].put(event.payload)
        self.wait(events[-1].next_seq)

    def wait(self, next_seq: int) -> None:
        end = time.monotonic() + BOUND_S
        while self.acknowledged < next_seq:
            if time.monotonic() > end:
                raise SystemExit(f"{self.acknowledged} events were applied in {BOUND_S} s, not {next_seq}")
            time.sleep(0.0002)


def run(binary: Path, work: str, form: wire.Format, count: int, missions: int) -> Cost:
    """The cost in a daemon of its own, whose vehicle has ended so many missions before."""
    os.environ["PDND_BINARY"] = str(binary)
    with tempfile.TemporaryDirectory(prefix="pdn-ingest-") as folder:
        daemon = start_daemon(Path(folder))
        try:
            with connect("ingest", daemon.endpoint) as client:
                for number in range(missions):
                    client.configure({"mission": f"earlier-{number}", "target": {"facets": [FLOOR]}})
                    client.abort("there are to be several")
                client.configure(
                    {"mission": "m", "target": {"facets": [FLOOR]}, "first_keyframe_sigmas": None}
                )
                client.start("the measurement begins")
                session, _ = open_session(daemon.endpoint, 20.0)
                with session:
                    return measure(daemon, Publisher(session, "ingest"), work, form, count)
        finally:
            daemon.stop()


def measure(daemon: Daemon, publisher: Publisher, work: str, form: wire.Format, count: int) -> Cost:
    line = [event for k in range(KEYFRAMES) for event in keyframe("m", 4 * k, k)]
    publisher.send(sent(line, form))
    events = sent(WORK[work]("m", len(line), count), form)
    before, began = cpu_ms(daemon), time.perf_counter()
    publisher.send(events)
    took_s = time.perf_counter() - began
    after = cpu_ms(daemon)
    owner, whole = ((now - then) / len(events) * 1e3 for now, then in zip(after, before, strict=True))
    return Cost(len(events) / took_s, owner, whole)


def cpu_ms(daemon: Daemon) -> tuple[float, float]:
    """CPU time of the vehicle's thread, and of all threads."""
    owner = whole = 0.0
    for thread in Path(f"/proc/{daemon.process.pid}/task").iterdir():
        spent = int((thread / "schedstat").read_text().split()[0]) * 1e-6
        whole += spent
        owner += spent if (thread / "comm").read_text().startswith("own ") else 0.0
    return owner, whole


def medians(costs: list[Cost]) -> Cost:
    return Cost(*(statistics.median(column) for column in zip(*costs, strict=True)))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "binaries", type=Path, nargs="+", metavar="PDND", help="builds, the first to compare with"
    )
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--events", type=int, default=8192, help="of a run")
    parser.add_argument("--missions", type=int, default=3, help="that the vehicle has ended before")
    parser.add_argument("--work", nargs="+", choices=WORK, default=list(WORK))
    parser.add_argument("--json", action="store_true", help="print medians as JSON")
    arguments = parser.parse_args()
    found = []
    for work in arguments.work:
        for form in wire.Format:
            costs: list[list[Cost]] = [[] for _ in arguments.binaries]
            for turn in range(arguments.rounds):
                order = list(enumerate(arguments.binaries))
                for place, binary in order if turn % 2 == 0 else reversed(order):
                    costs[place].append(run(binary, work, form, arguments.events, arguments.missions))
            one = [medians(each) for each in costs]
            found.append({"work": work, "encoding": form.value, "builds": [cost._asdict() for cost in one]})
            if not arguments.json:
                print(line_of(work, form, one), flush=True)
    if arguments.json:
        print(json.dumps(found))


def line_of(work: str, form: wire.Format, costs: list[Cost]) -> str:
    first = costs[0]
    told = [
        f"{cost.events_per_s:7.0f} events/s ({cost.events_per_s / first.events_per_s:.2f}), owner"
        f" {cost.owner_cpu_ms:6.1f} ms ({cost.owner_cpu_ms / first.owner_cpu_ms:.2f}), daemon"
        f" {cost.daemon_cpu_ms:6.1f} ms ({cost.daemon_cpu_ms / first.daemon_cpu_ms:.2f})"
        for cost in costs
    ]
    return f"{work:10} {form.value:7} " + " | ".join(told)


if __name__ == "__main__":
    main()
