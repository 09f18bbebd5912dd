"""Whole decisions of a real pdnd over Zenoh, on the survey that pdn-perf wrote; prints JSON, times in ms.

A vehicle streams the survey but for its last keyframes. Each of these comes before one question, so that
nothing is left of the question before. What is timed begins with the question, which is sent right after the
events, and ends when the bytes of the reply are there; reading them is the asker's work. Beside it stands the
CPU time of the daemon in between, which other work on the machine disturbs less.
"""

import argparse
import json
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import zenoh
from pdn import wire
from pdn.client import Client, MissionStream, connect
from pdn.client.session import open_session

from survey_file import ATTITUDE, DEPTH, ODOMETRY, PRIOR, Array, SurveyFile

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from conftest import Daemon, start_daemon

Found = dict[str, Any]

READY_S = 20.0
TIMEOUT_S = 60.0

EPS_M = 0.704
"""Splits the survey's patches of texture into some 50 clusters, where the default of 1.5 m finds some 30."""

STRICT = {"x_m": 0.05, "y_m": 0.05, "depth_m": 0.01, "roll_deg": 0.1, "pitch_deg": 0.1, "heading_deg": 0.1}
"""An allowance that is always exceeded."""

GENEROUS = {
    "x_m": 50.0,
    "y_m": 50.0,
    "depth_m": 5.0,
    "roll_deg": 20.0,
    "pitch_deg": 20.0,
    "heading_deg": 20.0,
}
"""An allowance that the uncertainty stays far below: exploring is certain."""

DETAILS = ("brief", "choice", "full")
FORMS = {"bincode": wire.Format.BINCODE, "json": wire.Format.JSON}


def measure(survey: SurveyFile, binary: Path, decisions: int, threads: int) -> Found:
    """Decisions of each detail and encoding with an allowance that is exceeded, and with one that is not."""
    found: Found = {"threads": threads, "decisions": decisions}
    with (
        tempfile.TemporaryDirectory(prefix="pdn-bench-state-") as folder,
        pdnd(binary, Path(folder), threads) as daemon,
    ):
        with Mission(daemon, "weighed", survey, {"allowable": STRICT}) as weighed:
            asked = [(detail, form) for detail in DETAILS for form in FORMS]
            weighed.fly_to(survey.keyframes - decisions * len(asked) - 1)
            found["weighed"] = [weighed.decisions(detail, form, decisions) for detail, form in asked]
            found["beliefs"] = weighed.beliefs()
        with Mission(daemon, "certain", survey, {"allowable": GENEROUS}) as certain:
            certain.fly_to(survey.keyframes - decisions * len(FORMS) - 1)
            found["certain"] = [certain.decisions("choice", form, decisions) for form in FORMS]
    return found


class Asked(NamedTuple):
    """A reply, the time that passed until its bytes were there, and the daemon's CPU time in between."""

    reply: bytes
    ms: float
    cpu_ms: float


class Mission:
    """A vehicle on its survey."""

    def __init__(self, daemon: Daemon, name: str, survey: SurveyFile, changes: Found) -> None:
        self.survey, self.name, self.daemon = survey, name, daemon
        self.client: Client = connect(name, daemon.endpoint, timeout_s=TIMEOUT_S)
        self.client.configure(configuration(name, survey, changes))
        self.client.start("the benchmark begins")
        self.events: MissionStream = self.client.mission_stream()
        self.session, _ = open_session(daemon.endpoint, READY_S)
        self.told = groups(survey)
        self.keyframes = 0

    def __enter__(self) -> "Mission":
        return self

    def __exit__(self, *_: object) -> None:
        self.client.complete("the benchmark ends")
        self.session.close()
        self.client.close()

    def step(self) -> int:
        """One keyframe with what was measured there; the number of the last event."""
        last = -1
        for kind, other, pose, sigmas in next(self.told):
            last = self.tell(kind, other, pose, sigmas)
        self.keyframes += 1
        return last

    def tell(self, kind: int, other: int, pose: Array, sigmas: Array) -> int:
        events, number = self.events, self.keyframes
        place, turn = pose[:3], pose[3:].tolist()
        measured = wire.Pose(translation=tuple(place.tolist()), rotation=tuple(turn))
        spread, variance = np.diag(sigmas**2), float(sigmas[5] ** 2)
        if kind in (PRIOR, ODOMETRY):
            local, rare = self.survey["saliency"][number].tolist()
            events.keyframe(number, saliency=(local, rare))
            if kind == PRIOR:
                return events.prior(number, measured, spread)
            return events.odometry(other, number, measured, spread)
        if kind == ATTITUDE:
            return events.attitude(number, turn, variance, variance)
        if kind == DEPTH:
            return events.depth(number, float(place[2]), float(sigmas[2] ** 2))
        direction, rotation = (float(sigmas[at] ** 2) for at in (0, 5))
        covariance = np.diag([direction, direction, rotation, rotation, rotation])
        return events.camera(other, number, (place / np.linalg.norm(place)).tolist(), turn, covariance)

    def fly_to(self, keyframes: int) -> None:
        while self.keyframes < keyframes:
            self.step()
        self.events.flush(timeout_s=300.0)

    def decisions(self, detail: str, form: str, count: int) -> Found:
        """So many questions, each after one more keyframe, and as many for the transport's floor."""
        asked, floor, told = [], [], []
        for _ in range(count):
            after = self.step()
            asked.append(self.ask(wire.Topic.RPC_DECISION, form, f"after={after};detail={detail}"))
            told.append(wire.decode(wire.Decision, asked[-1].reply, FORMS[form]))
            self.events.flush()
            floor.append(self.ask(wire.Topic.RPC_INGEST, form, "").ms)
        took = [one.ms for one in asked]
        candidates = told[-1].candidates
        parts = ("wait_ms", "queue_ms", "evaluate_ms", "total_ms")
        return {
            "detail": detail,
            "encoding": form,
            "median": statistics.median(took),
            "cpu": statistics.median(one.cpu_ms for one in asked),
            "least": min(took),
            "greatest": max(took),
            "floor": statistics.median(floor),
            **{part: statistics.median(getattr(one.timing, part) for one in told) for part in parts},
            "bytes": statistics.median(len(one.reply) for one in asked),
            "candidates": len(candidates),
            "virtual_nodes": statistics.fmean(known.nodes for known in candidates) if candidates else 0.0,
            "action": type(told[-1].action).__name__,
        }

    def beliefs(self, repeats: int = 5) -> Found:
        """The candidates' beliefs alone: their paths as paths that a person drew, asked of a state that
        has converged.
        """
        decision = self.client.decision(detail="brief")
        places = {known.id: known.linearization.translation for known in self.client.graph().keyframes}
        paths = [[places[keyframe] for keyframe in known.path] for known in decision.candidates]
        took, cpu = [], []
        for _ in range(repeats):
            before_ms = spent_ms(self.daemon)
            took.append(self.client.evaluate(paths).timing.evaluate_ms)
            cpu.append(spent_ms(self.daemon) - before_ms)
        return {"median": statistics.median(took), "cpu": statistics.median(cpu)}

    def ask(self, topic: wire.Topic, form: str, parameters: str) -> Asked:
        selector = f"{wire.key(self.name, topic)}?{parameters};encoding={form}".replace("?;", "?")
        before_ms, began = spent_ms(self.daemon), time.perf_counter()
        replies = self.session.get(selector, timeout=TIMEOUT_S, consolidation=zenoh.ConsolidationMode.NONE)
        reply = next(iter(replies))
        ms = 1e3 * (time.perf_counter() - began)
        cpu_ms = spent_ms(self.daemon) - before_ms
        if reply.ok is None:
            raise SystemExit(f"{selector} was refused: {reply.err and reply.err.payload.to_string()}")
        return Asked(reply.ok.payload.to_bytes(), ms, cpu_ms)


def groups(survey: SurveyFile) -> Iterator[list[tuple[int, int, Array, Array]]]:
    """For each keyframe its measurements, the arrival first: kind, other keyframe, pose, deviations."""
    ends = survey["stream_ends"].tolist()
    rows = list(zip(ends, survey["stream_poses"], survey["stream_sigmas"], strict=True))
    at = 0
    for keyframe in range(survey.keyframes):
        first = at
        while at < len(rows) and rows[at][0][0] == keyframe:
            at += 1
        yield [(kind, other, pose, sigmas) for (_, kind, other), pose, sigmas in rows[first:at]]


def configuration(name: str, survey: SurveyFile, changes: Found) -> Found:
    """The paper's hull, which the contract's defaults are, over a floor that holds the survey."""
    width_m, length_m = (np.ptp(survey["poses"][:, :2], axis=0) + 4.0).tolist()
    x_m, y_m = (survey["poses"][:, :2].min(axis=0) - 2.0).tolist()
    floor = {
        "origin": [x_m, y_m, 10.0],
        "u": [0.0, 1.0, 0.0],
        "v": [1.0, 0.0, 0.0],
        "length_u_m": length_m,
        "length_v_m": width_m,
    }
    area_m2 = max(length_m * width_m, survey.keyframes * 0.5 * 0.7 * 2.0)
    target = {"facets": [floor], "area_m2": area_m2}
    fixed = {"robust": {"camera": "none"}, "first_keyframe_sigmas": None, "planner": {"eps_m": EPS_M}}
    return {"mission": name, "target": target, "alpha": 0.75, **fixed, **changes}


@contextmanager
def pdnd(binary: Path, folder: Path, threads: int) -> Iterator[Daemon]:
    """A daemon of its own on loopback, ready."""
    os.environ.update(PDND_BINARY=str(binary), PDN_PLANNER_THREADS=str(threads))
    daemon = start_daemon(folder)
    try:
        yield daemon
    finally:
        daemon.stop()


def spent_ms(daemon: Daemon) -> float:
    """CPU time of all threads that it has."""
    threads = Path(f"/proc/{daemon.process.pid}/task").glob("*/schedstat")
    return sum(int(thread.read_text().split()[0]) for thread in threads) * 1e-6


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("input", type=Path, help="what `pdn-perf run --write` wrote")
    parser.add_argument("--binary", type=Path, required=True, help="pdnd")
    parser.add_argument("--decisions", type=int, default=24, help="of each detail and encoding")
    parser.add_argument("--threads", type=int, default=1, help="`planner_threads` of the daemon")
    arguments = parser.parse_args()
    survey = SurveyFile(arguments.input)
    print(json.dumps(measure(survey, arguments.binary, arguments.decisions, arguments.threads)))


if __name__ == "__main__":
    main()
