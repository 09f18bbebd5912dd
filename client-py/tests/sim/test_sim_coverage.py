"""True coverage against areas known in closed form."""

from __future__ import annotations

import math

import numpy as np

from pdn.sim import scenario_file
from pdn.sim.coverage import Raster
from pdn.sim.se3 import Pose, exp_rotation

FLOOR = scenario_file.load("seafloor")
DOWN = np.stack([np.array([0.0, 1.0, 0.0]), np.array([-1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])], axis=1)
"""World from a camera that looks down, its x axis east."""


def camera_at(north: float, east: float, height: float, rotation: np.ndarray = DOWN) -> Pose:
    return Pose(rotation, np.array([north, east, 20.0 - height]))


def covered(*cameras: Pose) -> float:
    raster = Raster(FLOOR)
    for camera in cameras:
        raster.add(camera)
    return raster.covered_m2()


def test_a_camera_that_looks_down_covers_its_footprint() -> None:
    height = 2.0
    sides = [2 * height * math.tan(math.radians(angle / 2)) for angle in (56.0, 44.0)]
    # Cells of 0.1 m count by their centres: at most half a cell at each border.
    expected, border = sides[0] * sides[1], 0.1 * (sides[0] + sides[1])
    assert abs(covered(camera_at(10.0, 15.0, height)) - expected) <= border


def test_cells_are_exactly_those_whose_centres_are_in_view() -> None:
    rng = np.random.default_rng(1)
    raster = Raster(FLOOR)
    tilt = exp_rotation(np.radians([12.0, -9.0, 25.0]))
    camera = camera_at(9.83, 14.61, 2.2, tilt @ DOWN)
    raster.add(camera)
    for _ in range(3000):
        row, column = rng.integers(70, 130), rng.integers(110, 190)
        centre = np.array([0.1 * (row + 0.5), 0.1 * (column + 0.5), 20.0])
        x, y, z = camera.rotation.T @ (centre - camera.translation)
        seen = (
            0.0 < z <= 4.0
            and abs(x / z) <= math.tan(math.radians(28.0))
            and abs(y / z) <= math.tan(math.radians(22.0))
        )
        assert raster.covered[0][row, column] == seen


def test_nothing_counts_twice_or_from_behind_or_from_too_far() -> None:
    here = camera_at(10.0, 15.0, 2.0)
    assert covered(here, here) == covered(here)
    assert covered(camera_at(10.0, 15.0, 4.1)) == 0.0
    upside_down = Pose(DOWN @ np.diag([1.0, -1.0, -1.0]), np.array([10.0, 15.0, 22.0]))
    assert covered(upside_down) == 0.0
    assert covered(camera_at(10.0, 200.0, 2.0)) == 0.0


def test_a_dense_survey_covers_everything() -> None:
    cameras = [camera_at(n, e, 2.0) for n in np.arange(0, 20.1, 1.0) for e in np.arange(0, 30.1, 1.0)]
    assert math.isclose(covered(*cameras), 600.0, abs_tol=1e-9)
