"""A pose graph on its way to the planner, as a vehicle would have sent it, and what of it is refused."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from pdn import wire
from pdn.client import Client, EventsRefused, MissionStream, Timeout
from pdn.client.errors import ProblemLike
from pdn.client.stream import OnRejected

from .failures import CommandFailed
from .pose_graph import Edge, PoseGraph, Prior, Transform

_DISTANCE = re.compile(r"lies (\d+(?:\.\d+)?) standard deviations")

Measurement = Edge | Prior


@dataclass(frozen=True)
class RefusedMeasurement:
    """A measurement that the planner has not taken."""

    measurement: Measurement
    reason: str
    sigmas: float | None
    """How far it lies from the graph, where that is why."""

    def __str__(self) -> str:
        distance = self.reason if self.sigmas is None else f"{self.sigmas:g} standard deviations away"
        return f"line {self.measurement.line}, {named(self.measurement)}: {distance}"


@dataclass
class GraphStream:
    """Sends a graph; afterwards `refused` is what was not taken, farthest first."""

    graph: PoseGraph
    anchor_sigma: float
    keep_going: bool
    source: str
    refused: list[RefusedMeasurement] = field(default_factory=list)
    _measurements: dict[int, Measurement] = field(default_factory=dict)
    _problems: list[ProblemLike] = field(default_factory=list)

    def run(self, client: Client, mission: str, timeout_s: float, *, show_progress: bool) -> int:
        """Sends all of it and waits until it is confirmed; returns the number of the last event.

        Raises `CommandFailed` for the first refusal, or with `keep_going` for one of something that is no
        measurement.
        """
        rejected: OnRejected = self._problems.append if self.keep_going else "raise"
        try:
            with client.mission_stream(mission, timeout_s=timeout_s, on_rejected=rejected) as events:
                self._send(events, show_progress)
                _wait_applied(events, timeout_s)
                last = events.next_seq - 1
        except EventsRefused as refusal:
            self._problems.extend(refusal.problems)
            raise CommandFailed(self._told(refusal)) from refusal
        self.refused = self._all_refused()
        return last

    def _send(self, events: MissionStream, show_progress: bool) -> None:
        with _progress(len(self.graph.keyframes), show_progress) as progress:
            for arrival in self.graph.arrivals():
                keyframe = arrival.keyframe
                events.keyframe(keyframe)
                if keyframe in self.graph.anchors:
                    tight = self.anchor_sigma**2 * np.eye(6)
                    events.prior(keyframe, pose(self.graph.anchors[keyframe]), tight)
                for edge in arrival.edges:
                    seq = events.relative(edge.from_, edge.to, pose(edge.relative), edge.covariance)
                    self._measurements[seq] = edge
                for prior in arrival.priors:
                    seq = events.prior(keyframe, pose(prior.pose), prior.covariance)
                    self._measurements[seq] = prior
                progress.advance(progress.task_ids[0])

    def _all_refused(self) -> list[RefusedMeasurement]:
        refused = []
        for problem in self._problems:
            measurement = None if problem.seq is None else self._measurements.get(problem.seq)
            if measurement is None:
                raise CommandFailed(f"{problem.message} [{problem.code}]")
            refused.append(_refused(measurement, problem))
        return sorted(refused, key=lambda one: (-(one.sigmas or 0.0), one.measurement.line))

    def _told(self, refusal: EventsRefused) -> str:
        first = next((problem for problem in refusal.problems if problem.seq in self._measurements), None)
        if first is None or first.seq is None:
            return str(refusal)
        refused = _refused(self._measurements[first.seq], first)
        where = f"{self.source}:{refused.measurement.line}: {named(refused.measurement)}"
        if refused.sigmas is None:
            return f"{where} was refused: {refused.reason}"
        return (
            f"{where} lies {refused.sigmas:g} standard deviations from where what came before it puts "
            f"{'its vertices' if isinstance(refused.measurement, Edge) else 'its vertex'}, beyond the gate. "
            "It is false, or the file's standard deviations are too small. --keep-going leaves such out and "
            "lists them, --robust cauchy weighs them down, --gate off (or --gate SIGMAS) takes them"
        )


def named(measurement: Measurement) -> str:
    """A measurement for a person."""
    if isinstance(measurement, Prior):
        return f"prior of {measurement.keyframe}"
    return f"edge {measurement.from_} -> {measurement.to}"


def pose(transform: Transform) -> wire.Pose:
    """A transform as on the wire."""
    return wire.Pose(translation=transform.translation, rotation=transform.rotation)


def _refused(measurement: Measurement, problem: ProblemLike) -> RefusedMeasurement:
    distance = _DISTANCE.search(problem.message)
    return RefusedMeasurement(measurement, problem.message, float(distance[1]) if distance else None)


def _wait_applied(events: MissionStream, timeout_s: float) -> None:
    """Waits until everything is confirmed, as long as something is confirmed within each `timeout_s`."""
    while True:
        confirmed = events.durable_seq
        try:
            events.flush(timeout_s)
            return
        except Timeout:
            if events.durable_seq == confirmed:
                raise


@contextmanager
def _progress(keyframes: int, shown: bool) -> Iterator[Progress]:
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), disable=not shown) as progress:
        progress.add_task("keyframes", total=keyframes)
        yield progress
