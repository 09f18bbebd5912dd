"""Reading a 3-D pose graph in g2o text form, and the order in which a vehicle would have sent it.

Conventions. An edge measures the pose of its second vertex in the frame of its first, as `relative` does.
Its information matrix is over [x, y, z; rotation], and the rotation part is read as that of the rotation
vector in radians, so that the cost is r' W r with r = Log(Z^-1 X_i^-1 X_j) = [rho; phi] (what GTSAM does
too; g2o itself measures the vector part of the quaternion, about half of it). The tangent order is ours:
covariance = information^-1, no permutation.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

QUATERNION_SLACK = 1e-2
"""A quaternion whose norm differs more from 1 is no rounding but a garbled line."""

MAX_ID = 2**64 - 1


class G2oError(ValueError):
    """A file that cannot be used; the message names the line."""


@dataclass(frozen=True, slots=True)
class Transform:
    """Translation [x, y, z], m, and unit quaternion [x, y, z, w]."""

    translation: tuple[float, float, float]
    rotation: tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Edge:
    """The pose of `to` in the frame of `from_`, with its 6x6 covariance over [m; rad]."""

    line: int
    from_: int
    to: int
    relative: Transform
    covariance: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PoseGraph:
    """Vertices with their poses, where the file gives them, and edges in the order of the file."""

    vertices: dict[int, Transform]
    edges: list[Edge]

    @property
    def keyframes(self) -> list[int]:
        """The ids of all vertices, ascending."""
        named = {end for edge in self.edges for end in (edge.from_, edge.to)}
        return sorted(named | self.vertices.keys())

    @property
    def anchor(self) -> int:
        """The lowest id: the keyframe that holds the others to the world."""
        return self.keyframes[0]

    def arrivals(self) -> Iterator[tuple[int, list[Edge]]]:
        """Each keyframe, by id, with the edges that become known by it: the step from its predecessor
        first, then the loop closures in the order of the file.
        """
        known_by: dict[int, list[Edge]] = {keyframe: [] for keyframe in self.keyframes}
        for edge in self.edges:
            known_by[max(edge.from_, edge.to)].append(edge)
        for keyframe, edges in known_by.items():
            yield keyframe, sorted(edges, key=lambda edge: (edge.from_, edge.to) != (keyframe - 1, keyframe))


def read_g2o(path: Path) -> PoseGraph:
    """Reads a 3-D pose graph; raises `G2oError` with the line for anything that cannot be streamed as it
    is.

    Unit quaternions are normalised to the last digit. Refused are 2-D graphs, unknown tags, wrong counts of
    numbers, values that are not finite, information that is not positive definite, and graphs in more than
    one piece.
    """
    vertices: dict[int, Transform] = {}
    edges: list[Edge] = []
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except UnicodeDecodeError as error:
        raise G2oError(f"{path}: this is no text file") from error
    for number, text in enumerate(lines, start=1):
        words = text.split()
        if not words or words[0].startswith("#"):
            continue
        try:
            match words[0]:
                case "VERTEX_SE3:QUAT":
                    _add_vertex(vertices, words)
                case "EDGE_SE3:QUAT":
                    edges.append(_edge(number, words))
                case "FIX":
                    pass  # Which vertex is held does not change the graph; the import anchors the lowest one.
                case "VERTEX_SE2" | "EDGE_SE2" | "EDGE_SE2_XY" | "VERTEX_XY":
                    raise G2oError("this is a 2-D graph; only 3-D graphs (EDGE_SE3:QUAT) can be imported")
                case tag:
                    raise G2oError(f"unknown tag {tag!r}; known are VERTEX_SE3:QUAT, EDGE_SE3:QUAT and FIX")
        except G2oError as error:
            raise G2oError(f"{path}:{number}: {error}") from None
    if not edges:
        raise G2oError(f"{path}: there is no EDGE_SE3:QUAT in it")
    graph = PoseGraph(vertices, edges)
    _demand_one_piece(path, graph)
    return graph


def _add_vertex(vertices: dict[int, Transform], words: list[str]) -> None:
    if len(words) != 9:
        raise G2oError(f"a vertex has an id and 7 numbers, not {len(words) - 1} fields")
    vertex = _id(words[1])
    if vertex in vertices:
        raise G2oError(f"vertex {vertex} comes twice")
    vertices[vertex] = _transform(_numbers(words[2:]))


def _edge(line: int, words: list[str]) -> Edge:
    if len(words) != 31:
        raise G2oError(f"an edge has two ids, 7 numbers and 21 of information, not {len(words) - 1} fields")
    from_, to = _id(words[1]), _id(words[2])
    if from_ == to:
        raise G2oError(f"the edge ties vertex {to} to itself")
    numbers = _numbers(words[3:])
    return Edge(line, from_, to, _transform(numbers[:7]), _covariance(numbers[7:]))


def _id(word: str) -> int:
    digits = word.lstrip("0") or "0"
    # Python reads no number of thousands of digits.
    if not word.isdecimal() or len(digits) > len(str(MAX_ID)) or int(digits) > MAX_ID:
        shown = word if len(word) <= 40 else f"{word[:40]}..."
        raise G2oError(f"{shown!r} is no id; ids are whole numbers from 0 to 2^64 - 1")
    return int(digits)


def _numbers(words: list[str]) -> list[float]:
    try:
        numbers = [float(word) for word in words]
    except ValueError as error:
        raise G2oError(str(error)) from None
    if not all(map(math.isfinite, numbers)):
        raise G2oError("not all numbers are finite")
    return numbers


def _transform(numbers: list[float]) -> Transform:
    x, y, z, qx, qy, qz, qw = numbers
    norm = math.hypot(qx, qy, qz, qw)
    if abs(norm - 1.0) > QUATERNION_SLACK:
        raise G2oError(f"the quaternion's norm is {norm:g}, not 1")
    return Transform((x, y, z), (qx / norm, qy / norm, qz / norm, qw / norm))


def _covariance(upper: list[float]) -> NDArray[np.float64]:
    information = np.zeros((6, 6))
    information[np.triu_indices(6)] = upper
    information = information + np.triu(information, 1).T
    if np.linalg.eigvalsh(information)[0] <= 0.0:
        least = float(np.linalg.eigvalsh(information)[0])
        raise G2oError(f"the information is not positive definite: its least eigenvalue is {least:g}")
    covariance = np.linalg.inv(information)
    covariance = (covariance + covariance.T) / 2.0
    try:
        np.linalg.cholesky(covariance)
    except np.linalg.LinAlgError:
        raise G2oError("the information is too nearly singular to be inverted") from None
    return np.asarray(covariance, dtype=np.float64)


def _demand_one_piece(path: Path, graph: PoseGraph) -> None:
    neighbours: dict[int, list[int]] = {keyframe: [] for keyframe in graph.keyframes}
    for edge in graph.edges:
        neighbours[edge.from_].append(edge.to)
        neighbours[edge.to].append(edge.from_)
    reached, ahead = {graph.anchor}, [graph.anchor]
    while ahead:
        for neighbour in neighbours[ahead.pop()]:
            if neighbour not in reached:
                reached.add(neighbour)
                ahead.append(neighbour)
    apart = [keyframe for keyframe in graph.keyframes if keyframe not in reached]
    if apart:
        raise G2oError(
            f"{path}: {len(apart)} vertices, of which {apart[0]} is the first, "
            f"are not connected to vertex {graph.anchor}"
        )
