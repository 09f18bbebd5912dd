"""Rigid transforms as the files write them, and what they do to covariances."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Transform:
    """Translation [x, y, z], m, and unit quaternion [x, y, z, w]."""

    translation: tuple[float, float, float]
    rotation: tuple[float, float, float, float]

    def __matmul__(self, other: Transform) -> Transform:
        """`a_from_b @ b_from_c` is `a_from_c`."""
        moved = np.array(self.translation) + self.matrix() @ np.array(other.translation)
        x, y, z, w = self.rotation
        a, b, c, d = other.rotation
        product = (
            w * a + x * d + y * c - z * b,
            w * b - x * c + y * d + z * a,
            w * c + x * b - y * a + z * d,
            w * d - x * a - y * b - z * c,
        )
        norm = math.hypot(*product)
        qx, qy, qz, qw = (part / norm for part in product)
        return Transform((float(moved[0]), float(moved[1]), float(moved[2])), (qx, qy, qz, qw))

    def inverse(self) -> Transform:
        """`b_from_a` of `a_from_b`."""
        x, y, z, w = self.rotation
        back = -(self.matrix().T @ np.array(self.translation))
        return Transform((float(back[0]), float(back[1]), float(back[2])), (-x, -y, -z, w))

    def matrix(self) -> Matrix:
        """The 3x3 rotation."""
        x, y, z, w = self.rotation
        return np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
            ]
        )

    def adjoint(self) -> Matrix:
        """The 6x6 matrix with T exp(xi) T^-1 = exp(Ad xi) for xi = [rho; phi] [SDA18, eq. 175]."""
        x, y, z = self.translation
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        adjoint = np.zeros((6, 6))
        adjoint[:3, :3] = adjoint[3:, 3:] = self.matrix()
        adjoint[:3, 3:] = cross @ self.matrix()
        return adjoint

    def moved_covariance(self, covariance: Matrix) -> Matrix:
        """The covariance of the same perturbation after a change of frame: of Ad xi where xi has
        `covariance`.
        """
        adjoint = self.adjoint()
        carried = adjoint @ covariance @ adjoint.T
        return (carried + carried.T) / 2.0


ORIGIN = Transform((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))


def from_euler(x: float, y: float, z: float, roll: float, pitch: float, yaw: float) -> Transform:
    """TORO's pose: the rotation Rz(yaw) Ry(pitch) Rx(roll), rad."""
    sr, cr = math.sin(roll / 2), math.cos(roll / 2)
    sp, cp = math.sin(pitch / 2), math.cos(pitch / 2)
    sy, cy = math.sin(yaw / 2), math.cos(yaw / 2)
    rotation = (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )
    return Transform((x, y, z), rotation)


def from_plane(x: float, y: float, heading: float) -> Transform:
    """A pose of the plane z = 0, turned about z, rad."""
    return Transform((x, y, 0.0), (0.0, 0.0, math.sin(heading / 2), math.cos(heading / 2)))
