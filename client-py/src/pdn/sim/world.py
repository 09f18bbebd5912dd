"""The true world: where the vehicle really is, what its camera really sees, what really registers.

Nothing here knows of an estimate. The noise of each measurement comes from a generator of its own, named by
the seed, the sensor and the keyframes' numbers, so that two policies under one seed meet the same noise as
long as they do the same, and one sensor's draws never shift another's.
"""

from __future__ import annotations

import math
from enum import IntEnum

import numpy as np

from pdn.sim import sensors
from pdn.sim.hardware import Image, Odometry, Reading, Registration
from pdn.sim.scenario import Scenario
from pdn.sim.se3 import Array, Pose, level

_RAYS_U, _RAYS_V = 9, 7
"""Rays of a footprint along the camera's x and y axes."""


class _Stream(IntEnum):
    START = 0
    ODOMETRY = 1
    ATTITUDE = 2
    DEPTH = 3
    REGISTRATION = 4


class World:
    """A ``Hardware`` with the truth beside it, for whoever scores the flight."""

    def __init__(self, scenario: Scenario, start: Pose, seed: int) -> None:
        self._scenario = scenario
        self._seed = seed
        self._pose = start
        self._rays = _grid_of_rays(scenario)
        self._footprints: dict[int, Array] = {}
        self.poses: list[Pose] = []
        """True ``world_from_body`` of each keyframe."""
        self.cameras: list[Pose] = []
        """True ``world_from_camera`` of each keyframe."""
        self.images: list[Image] = []
        self.path_m: list[float] = []
        """True length of the way up to each keyframe."""
        self.tried: list[int] = []
        """Registrations tried by each keyframe with earlier ones."""
        self.registered: list[int] = []
        """Those of them that succeeded."""

    def begin(self, body_from_camera: Pose) -> tuple[Pose, Reading]:
        """See ``Hardware``."""
        start = sensors.measure_start(self._pose, self._scenario.noise, self._stream(_Stream.START))
        return start, self._take(None, body_from_camera, 0.0)

    def move(self, displacement_in_body: Array, turn_rad: float, body_from_camera: Pose) -> Reading:
        """See ``Hardware``. The thrusters do what they are told; what is not known is where that led."""
        before = self._pose
        after = Pose(
            level(before.heading_rad() + turn_rad),
            before.translation + before.rotation @ displacement_in_body,
        )
        distance = float(np.linalg.norm(displacement_in_body))
        self._pose = after
        rng = self._stream(_Stream.ODOMETRY, len(self.poses))
        odometry = sensors.measure_odometry(before.inverse() @ after, distance, self._scenario.noise, rng)
        return self._take(odometry, body_from_camera, distance)

    def register(self, older: int, newer: int) -> Registration | None:
        """See ``Hardware``.

        The images match with the probability of their saliencies, provided that the true baseline is not
        degenerate and that the newer image shows at least ``min_overlap`` of what the older one shows.
        """
        self.tried[newer] += 1
        measured = self._match(older, newer)
        self.registered[newer] += measured is not None
        return measured

    def overlap(self, older: int, newer: int) -> float:
        """Share of the surface in the older image that the newer one shows as well; 0 if it shows none."""
        points = self._footprint(older)
        if len(points) == 0:
            return 0.0
        camera = self.cameras[newer]
        seen = (points - camera.translation) @ camera.rotation
        optics = self._scenario.optics
        depth = seen[:, 2]
        inside = (
            (depth > 0.0)
            & (depth <= optics.max_range_m)
            & (np.abs(seen[:, 0]) <= optics.tan_half_horizontal * depth)
            & (np.abs(seen[:, 1]) <= optics.tan_half_vertical * depth)
        )
        return float(np.mean(inside))

    def _match(self, older: int, newer: int) -> Registration | None:
        links = self._scenario.links
        rng = self._stream(_Stream.REGISTRATION, older, newer)
        rate = links.rate(self.images[older].local, self.images[newer].local)
        if rng.random() >= rate:
            return None
        relative = self.cameras[older].inverse() @ self.cameras[newer]
        if float(np.linalg.norm(relative.translation)) < links.min_baseline_m:
            return None
        if self.overlap(older, newer) < links.min_overlap:
            return None
        return sensors.measure_registration(relative, self._scenario.noise, rng)

    def _take(self, odometry: Odometry | None, body_from_camera: Pose, distance: float) -> Reading:
        number = len(self.poses)
        noise = self._scenario.noise
        self.poses.append(self._pose)
        self.cameras.append(self._pose @ body_from_camera)
        self.path_m.append((self.path_m[-1] if self.path_m else 0.0) + distance)
        self.images.append(self._see(self.cameras[-1]))
        self.tried.append(0)
        self.registered.append(0)
        return Reading(
            odometry,
            sensors.measure_attitude(self._pose.rotation, noise, self._stream(_Stream.ATTITUDE, number)),
            sensors.measure_depth(
                float(self._pose.translation[2]), noise, self._stream(_Stream.DEPTH, number)
            ),
            self.images[-1],
        )

    def _see(self, camera: Pose) -> Image:
        """Scores of the place in the middle of the image; of open water, nothing."""
        hits = self._scenario.surface.cast(camera.translation, camera.rotation[:, 2][None])
        # Half an image is still surface when its middle lies just outside.
        if float(hits.miss_m[0]) > 0.5 * self._scenario.survey.standoff_m:
            return Image(0.0, 0.0)
        local, global_ = self._scenario.saliency_at(float(hits.unwrapped[0, 0]), float(hits.unwrapped[0, 1]))
        return Image(local, global_)

    def _footprint(self, number: int) -> Array:
        if number not in self._footprints:
            camera = self.cameras[number]
            rays = self._rays @ camera.rotation.T
            hits = self._scenario.surface.cast(camera.translation, rays)
            reach = np.linalg.norm(hits.point - camera.translation, axis=1)
            kept = (hits.miss_m <= 0.0) & (reach * self._rays[:, 2] <= self._scenario.optics.max_range_m)
            self._footprints[number] = hits.point[kept]
        return self._footprints[number]

    def _stream(self, purpose: _Stream, *numbers: int) -> np.random.Generator:
        sequence = np.random.SeedSequence(self._seed, spawn_key=(int(purpose), *numbers))
        return np.random.Generator(np.random.PCG64(sequence))


def _grid_of_rays(scenario: Scenario) -> Array:
    optics = scenario.optics
    x = ((np.arange(_RAYS_U) + 0.5) / _RAYS_U * 2.0 - 1.0) * optics.tan_half_horizontal
    y = ((np.arange(_RAYS_V) + 0.5) / _RAYS_V * 2.0 - 1.0) * optics.tan_half_vertical
    grid = np.array([[a, b, 1.0] for a in x for b in y])
    return np.asarray(grid / np.linalg.norm(grid, axis=1, keepdims=True))


def start_pose(position: Array, heading_rad: float) -> Pose:
    """A level body at a place."""
    return Pose(level(math.remainder(heading_rad, 2.0 * math.pi)), position)
