"""The vehicle: steers by the estimate it has, takes keyframes, tries registrations, tells the planner.

It knows its plan, the surface as designed, its own measurements and what the planner answers; it has no
access to the true world. Between two keyframes it aims at a place in estimated coordinates, so its true track
drifts as the estimate does, and a loop closure shows as a correction of the next step.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from pdn.sim.hardware import Hardware, Image, Reading
from pdn.sim.planner import Fix, Planner
from pdn.sim.scenario import Links, Scenario
from pdn.sim.se3 import Array, Pose, level, wrap_rad
from pdn.sim.survey import Viewpoint

_REFRESH_EVERY = 50
"""Keyframes after which the vehicle asks for all estimates again, if no loop closure made it ask before."""

_RECENT = 10
"""A registration with a keyframe farther back than this closes a loop, and moves earlier keyframes too."""

_CLEARANCE_M = 0.03
"""How wrong the vehicle's memory of earlier keyframes may be between two questions."""


class Vehicle:
    """One vehicle on one mission."""

    def __init__(
        self, scenario: Scenario, hardware: Hardware, planner: Planner, on_fix: Callable[[Fix], None]
    ) -> None:
        self._scenario = scenario
        self._hardware = hardware
        self._planner = planner
        self._on_fix = on_fix
        self._table = scenario.links.table()
        self._fix: Fix | None = None
        self._map = _KeyframeMap()
        self._since_refresh = 0

    @property
    def keyframes(self) -> int:
        """Keyframes taken."""
        return self._map.count

    @property
    def fix(self) -> Fix:
        """The newest keyframe as the planner estimates it."""
        if self._fix is None:
            raise RuntimeError("the vehicle has not begun")
        return self._fix

    def begin(self, viewpoint: Viewpoint) -> None:
        """Take the first keyframe where the vehicle stands."""
        camera = body_from_camera(self._scenario, viewpoint)
        start, reading = self._hardware.begin(camera)
        self._planner.keyframe(0, start, camera, reading.image)
        self._report(0, start, camera, reading)

    def go_to(self, viewpoint: Viewpoint) -> None:
        """Steer for a place by the estimate and take a keyframe there; a far one is reached by more
        keyframes."""
        while True:
            pose = self.fix.pose
            way = viewpoint.position - pose.translation
            distance = float(np.linalg.norm(way))
            if distance <= 1.5 * viewpoint.stride_m:
                self._step(way, viewpoint)
                return
            self._step(way * (viewpoint.stride_m / distance), viewpoint)

    def _step(self, way: Array, viewpoint: Viewpoint) -> None:
        pose = self.fix.pose
        turn = wrap_rad(viewpoint.heading_rad - pose.heading_rad())
        camera = body_from_camera(self._scenario, replace(viewpoint, position=pose.translation + way))
        reading = self._hardware.move(pose.rotation.T @ way, turn, camera)
        if reading.odometry is None:
            raise RuntimeError("a step without odometry")
        number = self._map.count
        self._planner.keyframe(number, None, camera, reading.image)
        self._planner.odometry(number - 1, number, reading.odometry)
        self._report(number, pose @ reading.odometry.relative, camera, reading)

    def _report(self, number: int, predicted: Pose, camera: Pose, reading: Reading) -> None:
        if reading.attitude is not None:
            self._planner.attitude(number, reading.attitude)
        if reading.depth is not None:
            self._planner.depth(number, reading.depth)
        self._map.add(predicted, camera, reading.image)
        closes_a_loop = False
        for older in self._map.proposals(self._scenario.links, self._table):
            measured = self._hardware.register(older, number)
            self._planner.registration(older, number, measured)
            closes_a_loop |= measured is not None and number - older > _RECENT
        fix = self._planner.fix()
        self._fix = fix
        self._map.move(number, fix.pose)
        self._since_refresh += 1
        if closes_a_loop or self._since_refresh >= _REFRESH_EVERY:
            self._map.move_all(self._planner.estimates())
            self._since_refresh = 0
        self._on_fix(fix)


def body_from_camera(scenario: Scenario, viewpoint: Viewpoint) -> Pose:
    """The camera tilted, about the body's right axis, towards the nearest point of the surface as designed.

    The wider field of view lies across the trackline: along the body's x-z plane for a body that strafes,
    along its right axis for one that faces its way.
    """
    projection = scenario.surface.nearest(viewpoint.position[None]).point[0]
    towards = level(viewpoint.heading_rad).T @ (projection - viewpoint.position)
    tilt = math.atan2(-towards[2], towards[0])
    right = np.array([0.0, 1.0, 0.0])
    axis = np.array([math.cos(tilt), 0.0, -math.sin(tilt)])
    across = np.cross(right, axis)
    x, y = (across, right) if scenario.survey.heading == "across" else (right, np.cross(axis, right))
    return Pose(np.stack([x, y, axis], axis=1), np.zeros(3))


class _KeyframeMap:
    """What the vehicle remembers of its keyframes: where it believes them, how their cameras lay, what they
    saw."""

    def __init__(self) -> None:
        self.count = 0
        self._centres = np.empty((256, 3))
        self._optical_axes = np.empty((256, 3))
        self._local_saliency = np.empty(256)
        self._camera_positions = np.empty((256, 3))
        """Camera's position in the body."""
        self._camera_axes = np.empty((256, 3))
        """Camera's optical axis in the body."""

    def add(self, pose: Pose, camera: Pose, image: Image) -> None:
        if self.count == len(self._local_saliency):
            (
                self._centres,
                self._optical_axes,
                self._local_saliency,
                self._camera_positions,
                self._camera_axes,
            ) = (
                np.concatenate([column, np.empty_like(column)])
                for column in (
                    self._centres,
                    self._optical_axes,
                    self._local_saliency,
                    self._camera_positions,
                    self._camera_axes,
                )
            )
        self._camera_positions[self.count] = camera.translation
        self._camera_axes[self.count] = camera.rotation[:, 2]
        self._local_saliency[self.count] = image.local
        self.count += 1
        self.move(self.count - 1, pose)

    def move(self, number: int, pose: Pose) -> None:
        self._centres[number] = pose.rotation @ self._camera_positions[number] + pose.translation
        self._optical_axes[number] = pose.rotation @ self._camera_axes[number]

    def move_all(self, poses: list[Pose]) -> None:
        known = poses[: self.count]
        rotations = np.stack([pose.rotation for pose in known])
        places = np.stack([pose.translation for pose in known])
        n = len(known)
        self._centres[:n] = np.einsum("nij,nj->ni", rotations, self._camera_positions[:n]) + places
        self._optical_axes[:n] = np.einsum("nij,nj->ni", rotations, self._camera_axes[:n])

    def proposals(self, links: Links, table: Array) -> list[int]:
        """Earlier keyframes to register the newest with: greatest P_L first, then nearest, then lowest id.

        The planner refuses a baseline that its own estimate makes too short, so a pair must keep clear of
        that by as much as memory may be wrong.
        """
        newest = self.count - 1
        baseline = np.linalg.norm(self._centres[:newest] - self._centres[newest], axis=1)
        cosine = self._optical_axes[:newest] @ self._optical_axes[newest]
        near = np.flatnonzero(
            (baseline >= links.min_baseline_m + _CLEARANCE_M)
            & (baseline <= links.max_baseline_m)
            & (cosine >= math.cos(links.max_view_angle_rad))
        )
        bins = np.minimum((self._local_saliency[near] * links.bins).astype(int), links.bins - 1)
        own = min(int(self._local_saliency[newest] * links.bins), links.bins - 1)
        order = np.lexsort((near, baseline[near], -table[bins, own]))
        return [int(k) for k in near[order[: links.max_links]]]
