"""Rigid transforms in numpy, in the convention of the contract.

A tangent vector is ``[rho (m); phi (rad)]``, translation first, and perturbs on the right:
``X = X_hat @ exp(xi)``. Rotations are 3x3 matrices here and unit quaternions ``[x, y, z, w]`` on the wire.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_SMALL_ANGLE_RAD = 1e-7
"""Below it the series are exact to double precision: the next term is of order 1e-14 relative."""


@dataclass(frozen=True, slots=True)
class Pose:
    """``a_from_b``: maps points of frame b into frame a."""

    rotation: Array
    """3x3."""
    translation: Array
    """3, m."""

    @staticmethod
    def identity() -> Pose:
        """The transform that moves nothing."""
        return Pose(np.eye(3), np.zeros(3))

    @staticmethod
    def of(translation: Array | list[float], quaternion: Array | list[float]) -> Pose:
        """From the wire's translation and unit quaternion ``[x, y, z, w]``."""
        return Pose(rotation_of(quaternion), np.asarray(translation, dtype=float))

    def __matmul__(self, other: Pose) -> Pose:
        return Pose(
            self.rotation @ other.rotation,
            self.rotation @ other.translation + self.translation,
        )

    def inverse(self) -> Pose:
        """``b_from_a``."""
        return Pose(self.rotation.T, -self.rotation.T @ self.translation)

    def quaternion(self) -> list[float]:
        """The rotation as ``[x, y, z, w]`` with w >= 0."""
        return quaternion_of(self.rotation)

    def heading_rad(self) -> float:
        """Angle from north to the body's x axis in the horizontal plane, clockwise seen from above."""
        return math.atan2(self.rotation[1, 0], self.rotation[0, 0])


def skew(v: Array) -> Array:
    """The matrix of ``v x .``."""
    x, y, z = v
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def exp_rotation(phi: Array) -> Array:
    """Rotation matrix of a rotation vector, rad."""
    angle = math.sqrt(float(phi @ phi))
    k = skew(phi)
    if angle < _SMALL_ANGLE_RAD:
        return np.eye(3) + k + 0.5 * k @ k
    half = math.sin(0.5 * angle)
    return np.eye(3) + (math.sin(angle) / angle) * k + (2.0 * half * half / (angle * angle)) * k @ k


def log_rotation(rotation: Array) -> Array:
    """Rotation vector of a rotation matrix, rad, of norm at most pi."""
    x, y, z, w = quaternion_of(rotation)
    imaginary = np.array([x, y, z])
    sine = math.sqrt(float(imaginary @ imaginary))
    if sine < _SMALL_ANGLE_RAD:
        return 2.0 * imaginary
    return (2.0 * math.atan2(sine, w) / sine) * imaginary


def exp(xi: Array) -> Pose:
    """The transform of a tangent vector ``[rho; phi]``."""
    return Pose(exp_rotation(xi[3:]), _left_jacobian(xi[3:]) @ xi[:3])


def log(pose: Pose) -> Array:
    """The tangent vector ``[rho; phi]`` of a transform."""
    phi = log_rotation(pose.rotation)
    return np.concatenate([np.linalg.solve(_left_jacobian(phi), pose.translation), phi])


def adjoint(pose: Pose) -> Array:
    """6x6: ``pose @ exp(xi) = exp(adjoint(pose) xi) @ pose``."""
    out = np.zeros((6, 6))
    out[:3, :3] = out[3:, 3:] = pose.rotation
    out[:3, 3:] = skew(pose.translation) @ pose.rotation
    return out


def level(heading_rad: float) -> Array:
    """The rotation of a level body: x forward along the heading, z down."""
    c, s = math.cos(heading_rad), math.sin(heading_rad)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def wrap_rad(angle: float) -> float:
    """The same angle in (-pi, pi]."""
    return math.pi - (math.pi - angle) % (2.0 * math.pi)


def tangent_basis(direction: Array) -> tuple[Array, Array]:
    """The two unit vectors b1, b2 across a unit direction in which the contract counts its error.

    With a the axis of smallest magnitude (the lowest on a tie): ``b1 = normalize(z x e_a)``, ``b2 = z x b1``.
    """
    axis = np.zeros(3)
    axis[int(np.argmin(np.abs(direction)))] = 1.0
    first = np.cross(direction, axis)
    first /= np.linalg.norm(first)
    return first, np.cross(direction, first)


def rotation_of(quaternion: Array | list[float]) -> Array:
    """Rotation matrix of a unit quaternion ``[x, y, z, w]``."""
    x, y, z, w = quaternion
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion_of(rotation: Array) -> list[float]:
    """Unit quaternion ``[x, y, z, w]``, w >= 0, of a rotation matrix; the largest component is computed
    first."""
    m = rotation.tolist()
    trace = m[0][0] + m[1][1] + m[2][2]
    if trace > 0.0:
        s = 2.0 * math.sqrt(1.0 + trace)
        q = [(m[2][1] - m[1][2]) / s, (m[0][2] - m[2][0]) / s, (m[1][0] - m[0][1]) / s, 0.25 * s]
    else:
        i = max(range(3), key=lambda axis: m[axis][axis])
        j, k = (i + 1) % 3, (i + 2) % 3
        s = 2.0 * math.sqrt(max(0.0, 1.0 + m[i][i] - m[j][j] - m[k][k]))
        q = [0.0, 0.0, 0.0, (m[k][j] - m[j][k]) / s]
        q[i], q[j], q[k] = 0.25 * s, (m[j][i] + m[i][j]) / s, (m[k][i] + m[i][k]) / s
    norm = math.copysign(math.sqrt(sum(c * c for c in q)), q[3] if q[3] != 0.0 else 1.0)
    return [c / norm for c in q]


def _left_jacobian(phi: Array) -> Array:
    """3x3 V with ``exp([rho; phi]).translation = V rho``."""
    angle = math.sqrt(float(phi @ phi))
    k = skew(phi)
    if angle < _SMALL_ANGLE_RAD:
        return np.eye(3) + 0.5 * k + k @ k / 6.0
    half = math.sin(0.5 * angle)
    return np.eye(3) + (2.0 * half * half / angle**2) * k + ((angle - math.sin(angle)) / angle**3) * k @ k
