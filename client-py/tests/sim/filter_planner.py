"""A planner for tests that needs no service: an error-state Kalman filter of the newest pose.

Exact for odometry, attitude and depth; it keeps no earlier keyframes in its state, so it uses no
registration.
"""

from __future__ import annotations

import math

import numpy as np

from pdn.sim.hardware import Attitude, Depth, Image, Odometry, Registration
from pdn.sim.planner import Decision, Fix
from pdn.sim.scenario import Scenario
from pdn.sim.se3 import Array, Pose, adjoint, exp, log_rotation


class FilterPlanner:
    """``Planner`` with no memory; it records what it was told."""

    def __init__(self, scenario: Scenario, decision: list[Decision] | None = None) -> None:
        self._first = np.diag(scenario.noise.first_keyframe**2)
        allow = scenario.config["allowable"]
        sigmas = [allow["x_m"], allow["y_m"], allow["depth_m"]]
        sigmas += [math.radians(allow[k]) for k in ("roll_deg", "pitch_deg", "heading_deg")]
        self._log_allowance = 2.0 * float(np.sum(np.log(sigmas)))
        self._poses: list[Pose] = []
        self._covariance: Array = self._first
        self._decisions = list(decision or [])
        self.told: list[tuple[str, object]] = []

    def keyframe(self, number: int, pose: Pose | None, body_from_camera: Pose, image: Image) -> None:
        self.told.append(("keyframe", (number, pose, body_from_camera, image)))
        assert number == len(self._poses)
        if pose is not None:
            self._poses.append(pose)

    def odometry(self, older: int, newer: int, measured: Odometry) -> None:
        self.told.append(("odometry", (older, newer, measured)))
        assert newer == len(self._poses)
        self._poses.append(self._poses[older] @ measured.relative)
        carry = adjoint(measured.relative.inverse())
        self._covariance = carry @ self._covariance @ carry.T + measured.covariance

    def attitude(self, number: int, measured: Attitude) -> None:
        self.told.append(("attitude", (number, measured)))
        pose = self._poses[number]
        jacobian = np.zeros((3, 6))
        jacobian[:, 3:] = pose.rotation
        variance = np.diag([measured.tilt_variance_rad2] * 2 + [measured.heading_variance_rad2 or 1e6])
        self._update(number, log_rotation(pose.rotation @ measured.rotation.T), jacobian, variance)

    def depth(self, number: int, measured: Depth) -> None:
        self.told.append(("depth", (number, measured)))
        pose = self._poses[number]
        jacobian = np.zeros((1, 6))
        jacobian[0, :3] = pose.rotation[2]
        residual = np.array([pose.translation[2] - measured.depth_m])
        self._update(number, residual, jacobian, np.array([[measured.variance_m2]]))

    def registration(self, older: int, newer: int, measured: Registration | None) -> None:
        self.told.append(("registration", (older, newer, measured)))

    def fix(self) -> Fix:
        _, log_determinant = np.linalg.slogdet(self._covariance)
        ratio = math.exp((float(log_determinant) - self._log_allowance) / 6.0)
        return Fix(len(self._poses) - 1, self._poses[-1], self._covariance, ratio, 0.0)

    def estimates(self) -> list[Pose]:
        return list(self._poses)

    def decide(self) -> Decision:
        return self._decisions.pop(0) if self._decisions else Decision(None, (), 0.0, 0)

    def refused(self) -> list[str]:
        return []

    def _update(self, number: int, residual: Array, jacobian: Array, variance: Array) -> None:
        innovation = jacobian @ self._covariance @ jacobian.T + variance
        gain = np.linalg.solve(innovation, jacobian @ self._covariance).T
        self._poses[number] = self._poses[number] @ exp(-gain @ residual)
        self._covariance = (np.eye(6) - gain @ jacobian) @ self._covariance
        self._covariance = 0.5 * (self._covariance + self._covariance.T)
