"""Made-up pose graphs for tests: drawn, written, turned over, and solved by a dense Gauss-Newton."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from pdn.console.pose_graph import PoseGraph, Transform

Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class Measured:
    """A measurement as a file has it: information, upper triangle row by row."""

    from_: int
    to: int
    pose: Transform
    information: Matrix

    def reversed(self) -> Measured:
        """The same, told from the other end: E' = Z E^-1 Z^-1, so that r' = -Ad_Z r."""
        back = adjoint(self.pose.inverse())
        return Measured(self.to, self.from_, self.pose.inverse(), symmetric(back.T @ self.information @ back))

    def text(self) -> str:
        return f"EDGE_SE3:QUAT {self.from_} {self.to} {numbers(self.pose)} {triangle(self.information)}"

    def seen_from(self, i: int, j: int, first: Transform, second: Transform) -> str:
        """The same, told of sensors: Z' = P_i^-1 Z P_j, E = P_j E' P_j^-1."""
        pose = first.inverse() @ self.pose @ second
        carry = adjoint(second)
        information = symmetric(carry.T @ self.information @ carry)
        ids = f"{self.from_} {self.to} {i} {j}"
        return f"EDGE_SE3_OFFSET {ids} {numbers(pose)} {triangle(information)}"


@dataclass(frozen=True)
class Graph:
    """A graph with the poses that its measurements are drawn about."""

    vertices: dict[int, Transform]
    edges: list[Measured]
    priors: list[Measured] = field(default_factory=list)

    @staticmethod
    def random(random: np.random.Generator, poses: int, closures: int, priors: int = 0) -> Graph:
        """A trajectory with loop closures; the noise is as stated."""
        at = [Graph.random_pose(random, 5.0)]
        for _ in range(poses - 1):
            at.append(at[-1] @ Graph.random_pose(random, 1.0))
        pairs = [(k, k + 1) for k in range(poses - 1)]
        for _ in range(closures):
            i, j = (int(one) for one in random.choice(poses, size=2, replace=False))
            pairs.append((i, j))
        edges = [measured(random, i, j, at[i].inverse() @ at[j]) for i, j in pairs]
        told = [
            measured(random, int(k), int(k), at[k]) for k in random.choice(poses, size=priors, replace=False)
        ]
        return Graph(dict(enumerate(at)), edges, told)

    @staticmethod
    def random_pose(random: np.random.Generator, reach_m: float) -> Transform:
        rotation = random.normal(size=3)
        angle = random.uniform(0.0, 2.5)
        x, y, z = rotation / np.linalg.norm(rotation) * math.sin(angle / 2)
        a, b, c = random.uniform(-reach_m, reach_m, size=3)
        return Transform((float(a), float(b), float(c)), (float(x), float(y), float(z), math.cos(angle / 2)))

    def text(self, *, end: str = "\n", fix: int | None = None) -> str:
        lines = ["# made up", "PARAMS_SE3OFFSET 0 0 0 0 0 0 0 1"]
        lines += [f"VERTEX_SE3:QUAT {id} {numbers(pose)}" for id, pose in self.vertices.items()]
        lines += [] if fix is None else [f"FIX {fix}"]
        for prior in self.priors:
            lines.append(f"EDGE_SE3_PRIOR {prior.to} 0 {numbers(prior.pose)} {triangle(prior.information)}")
        return "".join(line + end for line in [*lines, *(edge.text() for edge in self.edges)])

    def renamed(self, names: dict[int, int]) -> Graph:
        def rename(one: Measured) -> Measured:
            return replace(one, from_=names[one.from_], to=names[one.to])

        return Graph(
            {names[id]: pose for id, pose in self.vertices.items()},
            [rename(edge) for edge in self.edges],
            [rename(prior) for prior in self.priors],
        )

    def moved(self, by: Transform) -> Graph:
        """Seen from another world."""
        return Graph(
            {id: by @ pose for id, pose in self.vertices.items()},
            self.edges,
            [replace(prior, pose=by @ prior.pose) for prior in self.priors],
        )


@st.composite
def graphs(draw: st.DrawFn, *, priors: bool = False) -> Graph:
    """Graphs of a few poses."""
    seed = draw(st.integers(0, 2**32))
    poses = draw(st.integers(3, 8))
    closures = draw(st.integers(1, 4))
    held = draw(st.integers(1, 2)) if priors else 0
    return Graph.random(np.random.default_rng(seed), poses, closures, held)


def measured(random: np.random.Generator, from_: int, to: int, true: Transform) -> Measured:
    """Drawn from its own covariance, all six correlated."""
    mixing = np.eye(6) + 0.3 * random.normal(size=(6, 6))
    root = np.diag([0.03] * 3 + [0.01] * 3) @ mixing
    noise = root @ random.normal(size=6)
    return Measured(from_, to, true @ exp(noise), symmetric(np.linalg.inv(root @ root.T)))


def optimum(graph: PoseGraph) -> float:
    """chi2 = sum r' W r at its least, with what FIX holds held; solved densely from the spanning tree."""
    poses = spanning(graph)
    free = [id for id in poses if id not in graph.anchors]
    at = {id: 6 * index for index, id in enumerate(free)}
    chi2 = math.inf
    for _ in range(60):
        rows, errors = [], []
        for edge in graph.edges:
            ahead = poses[edge.from_].inverse() @ poses[edge.to]
            error = log(edge.relative.inverse() @ ahead)
            of_to = right_jacobian_inverse(error)
            rows.append({edge.to: of_to, edge.from_: -of_to @ adjoint(ahead.inverse())})
            errors.append((error, edge.covariance))
        for prior in graph.priors:
            error = log(prior.pose.inverse() @ poses[prior.keyframe])
            rows.append({prior.keyframe: right_jacobian_inverse(error)})
            errors.append((error, prior.covariance))
        jacobian = np.zeros((6 * len(rows), 6 * len(free)))
        residual = np.zeros(6 * len(rows))
        for k, (row, (error, covariance)) in enumerate(zip(rows, errors, strict=True)):
            whiten = np.linalg.inv(np.linalg.cholesky(covariance))
            residual[6 * k : 6 * k + 6] = whiten @ error
            for id, block in row.items():
                if id in at:
                    jacobian[6 * k : 6 * k + 6, at[id] : at[id] + 6] += whiten @ block
        chi2 = float(residual @ residual)
        step = np.linalg.lstsq(jacobian, -residual, rcond=None)[0]
        for id in free:
            poses[id] = poses[id] @ exp(step[at[id] : at[id] + 6])
        if np.abs(step).max() < 1e-10:
            return chi2
    raise AssertionError(f"no optimum within 60 steps, chi2 {chi2}")


def spanning(graph: PoseGraph) -> dict[int, Transform]:
    """Poses as the first edge or prior of each keyframe says."""
    poses: dict[int, Transform] = {}
    for arrival in graph.arrivals():
        if arrival.edges:
            tie = arrival.edges[0]
            known = poses[tie.other(arrival.keyframe)]
            ahead = tie.relative if tie.to == arrival.keyframe else tie.relative.inverse()
            poses[arrival.keyframe] = known @ ahead
        elif arrival.keyframe in graph.anchors:
            poses[arrival.keyframe] = graph.anchors[arrival.keyframe]
        else:
            poses[arrival.keyframe] = arrival.priors[0].pose
    return poses


def hat(v: Matrix) -> Matrix:
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def adjoint(pose: Transform) -> Matrix:
    rotation = pose.matrix()
    whole = np.zeros((6, 6))
    whole[:3, :3] = whole[3:, 3:] = rotation
    whole[:3, 3:] = hat(np.array(pose.translation)) @ rotation
    return whole


def left_jacobian_so3(phi: Matrix) -> Matrix:
    angle = float(np.linalg.norm(phi))
    cross = hat(phi)
    if angle < 1e-5:
        return np.eye(3) + cross / 2 + cross @ cross / 6
    return np.asarray(
        np.eye(3)
        + (1 - math.cos(angle)) / angle**2 * cross
        + (angle - math.sin(angle)) / angle**3 * cross @ cross
    )


def exp(xi: Matrix) -> Transform:
    rho, phi = xi[:3], xi[3:]
    angle = float(np.linalg.norm(phi))
    half = 0.5 - angle**2 / 48 if angle < 1e-5 else math.sin(angle / 2) / angle
    x, y, z = (half * phi).tolist()
    a, b, c = (left_jacobian_so3(phi) @ rho).tolist()
    w = math.cos(angle / 2)
    norm = math.hypot(x, y, z, w)
    return Transform((a, b, c), (x / norm, y / norm, z / norm, w / norm))


def log(pose: Transform) -> Matrix:
    x, y, z, w = pose.rotation if pose.rotation[3] >= 0 else tuple(-part for part in pose.rotation)
    sine = math.sqrt(x * x + y * y + z * z)
    scale = 2.0 / w if sine < 1e-9 else 2.0 * math.atan2(sine, w) / sine
    phi = scale * np.array([x, y, z])
    return np.concatenate([np.linalg.solve(left_jacobian_so3(phi), np.array(pose.translation)), phi])


def right_jacobian_inverse(xi: Matrix) -> Matrix:
    """The series with Bernoulli's numbers; for residuals below 1 rad the next term is below 1e-6."""
    ad = np.zeros((6, 6))
    ad[:3, :3] = ad[3:, 3:] = hat(xi[3:])
    ad[:3, 3:] = hat(xi[:3])
    square = ad @ ad
    fourth = square @ square
    return np.asarray(
        np.eye(6) + ad / 2 + square / 12 - fourth / 720 + fourth @ square / 30240 - fourth @ fourth / 1209600
    )


def symmetric(matrix: Matrix) -> Matrix:
    return np.asarray((matrix + matrix.T) / 2.0)


def numbers(pose: Transform) -> str:
    return " ".join(repr(float(value)) for value in (*pose.translation, *pose.rotation))


def triangle(matrix: Matrix) -> str:
    return " ".join(repr(float(value)) for value in matrix[np.triu_indices(6)])
