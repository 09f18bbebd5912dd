"""Rigid transforms: group laws and series, at random."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pdn.sim import se3
from pdn.sim.se3 import Pose

# Products of a few 3x3 matrices of order 10 m: rounding of order 1e-14.
CLOSE = 1e-12


def some_tangent(rng: np.random.Generator, angle: float) -> np.ndarray:
    axis = rng.standard_normal(3)
    return np.concatenate([rng.uniform(-10, 10, 3), angle * axis / np.linalg.norm(axis)])


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-8, 1e-6, 0.1, 1.0, 3.0, math.pi - 1e-6])
def test_log_undoes_exp(angle: float) -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        xi = some_tangent(rng, angle)
        # Near pi the axis comes from a rotation matrix whose sine part is small: 1e-16 / 1e-6.
        tolerance = 1e-8 if angle > 3.1 else 1e-11
        np.testing.assert_allclose(se3.log(se3.exp(xi)), xi, atol=tolerance)


def test_adjoint_carries_a_perturbation_to_the_other_side() -> None:
    rng = np.random.default_rng(2)
    for _ in range(20):
        pose, xi = se3.exp(some_tangent(rng, 2.0)), 0.3 * some_tangent(rng, 1.0)
        left, right = pose @ se3.exp(xi), se3.exp(se3.adjoint(pose) @ xi) @ pose
        np.testing.assert_allclose(left.rotation, right.rotation, atol=CLOSE)
        np.testing.assert_allclose(left.translation, right.translation, atol=1e-11)


def test_quaternions_of_every_branch_return() -> None:
    rng = np.random.default_rng(3)
    for angle in (0.1, 1.5, 3.0, math.pi):
        for axis in (*np.eye(3), *rng.standard_normal((10, 3))):
            rotation = se3.exp_rotation(angle * axis / np.linalg.norm(axis))
            quaternion = se3.quaternion_of(rotation)
            assert quaternion[3] >= 0.0
            assert math.isclose(math.hypot(*quaternion), 1.0, abs_tol=1e-15)
            np.testing.assert_allclose(se3.rotation_of(quaternion), rotation, atol=1e-14)


def test_inverse_and_identity() -> None:
    pose = se3.exp(np.array([1.0, -2.0, 3.0, 0.4, -0.5, 0.6]))
    round_trip = pose @ pose.inverse()
    np.testing.assert_allclose(round_trip.rotation, Pose.identity().rotation, atol=CLOSE)
    np.testing.assert_allclose(round_trip.translation, 0.0, atol=CLOSE)


def test_heading_and_wrapping() -> None:
    for degrees in (-179.0, -90.0, 0.0, 45.0, 180.0):
        pose = Pose(se3.level(math.radians(degrees)), np.zeros(3))
        assert math.isclose(pose.heading_rad(), math.radians(degrees), abs_tol=1e-12)
    assert math.isclose(se3.wrap_rad(math.radians(350.0)), math.radians(-10.0), abs_tol=1e-12)
    assert se3.wrap_rad(math.pi) == math.pi


def test_the_tangent_basis_is_that_of_the_contract() -> None:
    first, second = se3.tangent_basis(np.array([0.0, 0.0, 1.0]))
    # Smallest component: x, the lowest of two equal; z cross x = y, z cross y = -x.
    np.testing.assert_allclose(first, [0.0, 1.0, 0.0])
    np.testing.assert_allclose(second, [-1.0, 0.0, 0.0])
