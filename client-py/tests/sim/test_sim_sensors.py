"""Noise: the errors drawn have the covariance that is sent with them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pdn.sim import scenario_file, sensors
from pdn.sim.se3 import Pose, exp, log, log_rotation, tangent_basis

DRAWS = 2000
# The sample variance of n Gaussian draws has relative deviation sqrt(2 / n) = 0.032; 5 of them.
SPREAD = 5 * math.sqrt(2 / DRAWS)
NOISE = scenario_file.load("hull40").noise


def assert_drawn_from(errors: np.ndarray, covariance: np.ndarray) -> None:
    """Mean zero, and whitened by the covariance the errors have the unit matrix as second moments."""
    whitened = np.linalg.solve(np.linalg.cholesky(covariance), errors.T).T
    count, size = whitened.shape
    np.testing.assert_allclose(whitened.T @ whitened / count, np.eye(size), atol=SPREAD)
    np.testing.assert_allclose(whitened.mean(axis=0), 0.0, atol=5 / math.sqrt(count))


@pytest.mark.parametrize("distance", [0.3, 0.5, 1.2])
def test_odometry(distance: float) -> None:
    rng = np.random.default_rng(1)
    true = exp(np.array([distance, 0.0, 0.0, 0.0, 0.0, 0.7]))
    drawn = [sensors.measure_odometry(true, distance, NOISE, rng) for _ in range(DRAWS)]
    sigma = np.array([0.012] * 3 + [math.radians(0.05)] * 3)
    np.testing.assert_allclose(drawn[0].covariance, np.diag(sigma**2) * distance, rtol=1e-12)
    assert_drawn_from(np.array([log(d.relative.inverse() @ true) for d in drawn]), drawn[0].covariance)


def test_turning_on_the_spot_has_a_positive_definite_covariance() -> None:
    drawn = sensors.measure_odometry(Pose.identity(), 0.0, NOISE, np.random.default_rng(1))
    np.linalg.cholesky(drawn.covariance)


def test_attitude() -> None:
    rng = np.random.default_rng(2)
    true = exp(np.array([0, 0, 0, 0.3, -0.2, 2.0])).rotation
    drawn = [sensors.measure_attitude(true, NOISE, rng) for _ in range(DRAWS)]
    first = drawn[0]
    assert first is not None
    assert first.heading_variance_rad2 is not None
    covariance = np.diag([first.tilt_variance_rad2] * 2 + [first.heading_variance_rad2])
    np.testing.assert_allclose(covariance, np.eye(3) * math.radians(0.25) ** 2, rtol=1e-12)
    assert_drawn_from(np.array([log_rotation(true @ d.rotation.T) for d in drawn if d]), covariance)


def test_depth() -> None:
    rng = np.random.default_rng(3)
    drawn = [sensors.measure_depth(7.0, NOISE, rng) for _ in range(DRAWS)]
    errors = np.array([[d.depth_m - 7.0] for d in drawn if d])
    assert_drawn_from(errors, np.array([[0.02**2]]))


@pytest.mark.parametrize("baseline", [[0.5, 0.0, 0.0], [0.0, 0.0, 0.5], [-0.3, 0.4, 0.2], [0.0, -0.4, 0.0]])
def test_registration(baseline: list[float]) -> None:
    rng = np.random.default_rng(4)
    true = Pose(exp(np.array([0, 0, 0, 0.1, 0.2, 3.0])).rotation, np.array(baseline))
    direction = true.translation / np.linalg.norm(true.translation)
    first, second = tangent_basis(direction)
    errors, squares = [], []
    for _ in range(DRAWS):
        measured = sensors.measure_registration(true, NOISE, rng)
        assert math.isclose(np.linalg.norm(measured.direction), 1.0, abs_tol=1e-12)
        turn = log_rotation(measured.rotation.T @ true.rotation)
        errors.append([first @ measured.direction, second @ measured.direction, *turn])
        # The contract takes the residual in the tangent plane of the measured direction, in a basis that may
        # jump with the noise: only the sum of squares has a law of its own there.
        squares.append(sum(float(axis @ direction) ** 2 for axis in tangent_basis(measured.direction)))
    covariance = measured.covariance
    np.testing.assert_allclose(np.degrees(np.sqrt(np.diag(covariance))), [1, 1, 0.1, 0.1, 0.1], rtol=1e-12)
    assert_drawn_from(np.array(errors), covariance)
    # Chi-squared with 2 degrees of freedom: mean 2, variance 4.
    assert abs(np.mean(squares) / covariance[0, 0] - 2.0) < 5 * 2 / math.sqrt(DRAWS)


def test_the_told_start() -> None:
    rng = np.random.default_rng(5)
    true = exp(np.array([1.0, 2.0, 3.0, 0.0, 0.0, 1.0]))
    told = [sensors.measure_start(true, NOISE, rng) for _ in range(DRAWS)]
    covariance = np.diag(np.array([0.02] * 3 + [math.radians(0.1)] * 3) ** 2)
    assert_drawn_from(np.array([log(pose.inverse() @ true) for pose in told]), covariance)


def test_a_wrong_covariance_is_seen() -> None:
    """The test above can fail: 20 % more noise than stated is outside its bounds."""
    rng = np.random.default_rng(6)
    errors = 1.2 * rng.standard_normal((DRAWS, 3))
    with pytest.raises(AssertionError):
        assert_drawn_from(errors, np.eye(3))
