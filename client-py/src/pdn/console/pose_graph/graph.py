"""A pose graph as it is streamed, and the order in which a vehicle would have sent it."""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .transform import Transform

MAX_ERROR = 500
"""Characters of an error, whatever the file holds."""


class PoseGraphError(ValueError):
    """A file that cannot be used; the message names the line and is at most `MAX_ERROR` characters long."""

    def __init__(self, message: str) -> None:
        super().__init__(message if len(message) <= MAX_ERROR else f"{message[: MAX_ERROR - 3]}...")


def counted(count: int, one: str, many: str | None = None) -> str:
    """`1 edge`, `2 edges`."""
    return f"{count} {one if count == 1 else many or one + 's'}"


@dataclass(frozen=True, slots=True)
class Edge:
    """The pose of `to` in the frame of `from_`, with its 6x6 covariance over [m; rad]."""

    line: int
    from_: int
    to: int
    relative: Transform
    covariance: NDArray[np.float64]

    def other(self, end: int) -> int:
        """The vertex at its other end."""
        return self.to if end == self.from_ else self.from_


@dataclass(frozen=True, slots=True)
class Prior:
    """The measured pose of `keyframe`, with its 6x6 covariance over [m; rad]."""

    line: int
    keyframe: int
    pose: Transform
    covariance: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Arrival:
    """A keyframe, with what becomes known by it: the edge that ties it to those before it first, then the
    other edges to those before it, then the priors, each in the order of the file.
    """

    keyframe: int
    edges: list[Edge]
    priors: list[Prior]


@dataclass(frozen=True, slots=True)
class PoseGraph:
    """Vertices with their poses, where the file gives them, and measurements in the order of the file.

    Every vertex hangs by edges on one that is in `anchors` or has a prior.
    """

    vertices: dict[int, Transform]
    edges: list[Edge]
    priors: list[Prior]
    anchors: dict[int, Transform]
    """Vertices that hold the others to the world, at their poses."""
    planar: bool
    """Whether the file says nothing of z, roll and pitch."""
    notes: list[str]
    """What was left out or assumed, a sentence each."""

    @property
    def keyframes(self) -> list[int]:
        """The ids of all vertices, ascending."""
        named = {end for edge in self.edges for end in (edge.from_, edge.to)}
        return sorted(named | self.vertices.keys() | {prior.keyframe for prior in self.priors})

    @property
    def degrees_of_freedom(self) -> int:
        """Numbers measured less numbers estimated."""
        measured = len(self.edges) + len(self.priors) + len(self.anchors)
        return (3 if self.planar else 6) * (measured - len(self.keyframes))

    def arrivals(self) -> Iterator[Arrival]:
        """Each keyframe once an edge ties it to one before it: next comes the one whose id is nearest to that
        of a neighbour before it, so that a trajectory comes in its order and loop closures come when it has.
        """
        priors: dict[int, list[Prior]] = {}
        for prior in self.priors:
            priors.setdefault(prior.keyframe, []).append(prior)
        by_end: dict[int, list[Edge]] = {keyframe: [] for keyframe in self.keyframes}
        for edge in self.edges:
            by_end[edge.from_].append(edge)
            by_end[edge.to].append(edge)
        known: set[int] = set()
        for root in [*sorted(self.anchors), *sorted(priors)]:
            ahead = [(0, root)]
            while ahead:
                _, keyframe = heapq.heappop(ahead)
                if keyframe in known:
                    continue
                edges = [edge for edge in by_end[keyframe] if edge.other(keyframe) in known]
                known.add(keyframe)
                yield Arrival(keyframe, _tie_first(keyframe, edges), priors.get(keyframe, []))
                for edge in by_end[keyframe]:
                    other = edge.other(keyframe)
                    if other not in known:
                        heapq.heappush(ahead, (abs(other - keyframe), other))


def _tie_first(keyframe: int, edges: list[Edge]) -> list[Edge]:
    if not edges:
        return edges
    tie = min(edges, key=lambda edge: abs(edge.other(keyframe) - keyframe))
    return [tie, *(edge for edge in edges if edge is not tie)]
