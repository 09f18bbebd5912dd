"""Noise: each function draws one error from the covariance that goes out with the measurement."""

from __future__ import annotations

import math

import numpy as np

from pdn.sim.hardware import Attitude, Depth, Odometry, Registration
from pdn.sim.scenario import Noise
from pdn.sim.se3 import Array, Pose, exp, exp_rotation, tangent_basis

_LEAST_DISTANCE_M = 0.01
"""Turning on the spot counts as this far, since a covariance must be positive definite."""

_GYRO_ONLY_RAD = math.radians(5.0)
"""Error of the heading in a measured rotation where no compass observes it: the truth must not slip out
there."""


def measure_odometry(true: Pose, distance_m: float, noise: Noise, rng: np.random.Generator) -> Odometry:
    """``Z = T Exp(n)``, n drawn from ``diag(sigma^2) d`` with d the distance gone, m."""
    sigma = noise.odometry * math.sqrt(max(distance_m, _LEAST_DISTANCE_M))
    return Odometry(true @ exp(sigma * rng.standard_normal(6)), np.diag(sigma**2))


def measure_attitude(true: Array, noise: Noise, rng: np.random.Generator) -> Attitude | None:
    """``Log(R Z^T)`` is drawn in world axes: two tilts, then heading."""
    if noise.tilt_rad is None:
        return None
    heading = _GYRO_ONLY_RAD if noise.heading_rad is None else noise.heading_rad
    error = np.array([noise.tilt_rad, noise.tilt_rad, heading]) * rng.standard_normal(3)
    variance = None if noise.heading_rad is None else noise.heading_rad**2
    return Attitude(exp_rotation(-error) @ true, noise.tilt_rad**2, variance)


def measure_depth(true_m: float, noise: Noise, rng: np.random.Generator) -> Depth | None:
    """Depth plus an error."""
    if noise.depth_m is None:
        return None
    return Depth(true_m + noise.depth_m * float(rng.standard_normal()), noise.depth_m**2)


def measure_registration(true: Pose, noise: Noise, rng: np.random.Generator) -> Registration:
    """Direction and rotation of the newer camera in the older camera's frame.

    The direction's error is drawn in the tangent plane of the true direction. Its squared norm, all that an
    isotropic covariance weighs, is the same in the tangent plane of the measured direction, where the
    residual is taken. The rotation's error is ``Log(R_Z^T R)``.
    """
    direction = true.translation / np.linalg.norm(true.translation)
    first, second = tangent_basis(direction)
    a, b = noise.direction_rad * rng.standard_normal(2)
    measured = math.sqrt(1.0 - a * a - b * b) * direction + a * first + b * second
    rotation = true.rotation @ exp_rotation(-noise.rotation_rad * rng.standard_normal(3))
    sigma = np.array([noise.direction_rad] * 2 + [noise.rotation_rad] * 3)
    return Registration(measured / np.linalg.norm(measured), rotation, np.diag(sigma**2))


def measure_start(true: Pose, noise: Noise, rng: np.random.Generator) -> Pose:
    """Where the vehicle is told that it starts: ``Z = X Exp(n)``, n drawn from the first keyframe's prior."""
    return true @ exp(noise.first_keyframe * rng.standard_normal(6))
