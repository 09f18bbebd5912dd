"""The true world: what it lets out, and how often registrations succeed."""

from __future__ import annotations

import ast
import math
from pathlib import Path

import numpy as np

import pdn.sim
from pdn.sim import scenario_file
from pdn.sim.hardware import Reading
from pdn.sim.scenario import Scenario
from pdn.sim.se3 import log
from pdn.sim.survey import Viewpoint
from pdn.sim.vehicle import body_from_camera
from pdn.sim.world import World, start_pose

HULL = scenario_file.load("hull40")
HEADING = math.pi / 2


def world_at(u: float, v: float, seed: int, scenario: Scenario = HULL) -> World:
    """On the side, 1.5 m off."""
    return World(scenario, start_pose(np.array([u, -1.5, v]), HEADING), seed)


def facing_the_side(u: float, v: float) -> Viewpoint:
    return Viewpoint(np.array([u, -1.5, v]), HEADING, 0.5)


def strafe(world: World, distance: float) -> Reading:
    """Along the hull: forwards is towards it, so north is to the left."""
    return world.move(np.array([0.0, -distance, 0.0]), 0.0, CAMERA)


CAMERA = body_from_camera(HULL, facing_the_side(20.0, 5.0))


def test_the_same_seed_gives_the_same_readings_and_another_seed_others() -> None:
    def readings(seed: int) -> np.ndarray:
        world = world_at(10.0, 5.0, seed)
        told, first = world.begin(CAMERA)
        numbers = [told.translation, *_numbers(first)]
        for _ in range(5):
            numbers += _numbers(strafe(world, 0.5))
        return np.concatenate(numbers)

    np.testing.assert_array_equal(readings(3), readings(3))
    other, same = readings(4), readings(3)
    assert np.all(other != same)


def test_nothing_of_the_truth_comes_out_without_noise() -> None:
    """Under many seeds no number that a vehicle receives stays what the truth would make it."""
    seen = []
    for seed in range(6):
        world = world_at(10.0, 5.0, seed)
        told, first = world.begin(CAMERA)
        reading = strafe(world, 0.5)
        assert reading.odometry is not None
        seen.append(
            np.concatenate([log(told), *_numbers(first), *_numbers(reading), log(reading.odometry.relative)])
        )
    assert np.all(np.ptp(np.array(seen), axis=0) > 0.0)


def test_noise_of_a_keyframe_does_not_depend_on_what_was_registered() -> None:
    plain, busy = world_at(5.0, 5.0, 1), world_at(5.0, 5.0, 1)
    plain.begin(CAMERA)
    busy.begin(CAMERA)
    for number in range(1, 5):
        first, second = strafe(plain, 0.5), strafe(busy, 0.5)
        busy.register(number - 1, number)
        for a, b in zip(_numbers(first), _numbers(second), strict=True):
            np.testing.assert_array_equal(a, b)


def test_the_vehicle_s_side_does_not_import_the_world() -> None:
    folder = Path(pdn.sim.__file__).parent
    for name in ("vehicle", "planner", "hardware", "policies", "remote", "survey"):
        tree = ast.parse((folder / f"{name}.py").read_text())
        imported = {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom)}
        assert "pdn.sim.world" not in imported
        if name == "vehicle":
            assert not {"pdn.sim.flight", "pdn.sim.sensors", "pdn.sim.coverage"} & imported


def test_success_follows_true_saliency() -> None:
    """Rates of thousands of tries lie within 5 standard deviations of the scenario's."""
    # Region 1 is centred on (5, 5); (20, 5) is bare; its rim lies at (9, 5).
    for u, rate in ((5.0, 0.85), (20.0, 0.005), (8.75, 0.05)):
        successes, tries = 0, 0
        for seed in range(400):
            world = world_at(u, 5.0, seed)
            world.begin(CAMERA)
            strafe(world, 0.5)
            measured = world.register(0, 1)
            assert world.tried == [0, 1]
            assert world.registered == [0, int(measured is not None)]
            successes += measured is not None
            tries += 1
        assert abs(successes / tries - rate) < 5 * math.sqrt(rate * (1 - rate) / tries), u


def test_nothing_registers_without_overlap_or_baseline() -> None:
    for distance in (1.4, 0.2):
        for seed in range(40):
            world = world_at(5.0, 5.0, seed)
            world.begin(CAMERA)
            strafe(world, distance)
            assert world.register(0, 1) is None


def test_overlap_is_the_shared_part_of_the_footprint() -> None:
    world = world_at(5.0, 5.0, 1)
    world.begin(CAMERA)
    strafe(world, 0.5)
    along = 2 * 1.5 * math.tan(math.radians(22.0))
    # Seven rays along the track: the share is known to one of them.
    assert abs(world.overlap(0, 1) - (1.0 - 0.5 / along)) <= 1 / 7
    assert world.overlap(0, 0) == 1.0


def test_the_vehicle_stays_level_and_goes_where_it_is_told() -> None:
    world = world_at(5.0, 5.0, 1)
    world.begin(CAMERA)
    world.move(np.array([0.3, -0.4, 0.1]), 0.2, CAMERA)
    pose = world.poses[1]
    np.testing.assert_allclose(pose.translation, [5.4, -1.2, 5.1], atol=1e-12)
    np.testing.assert_allclose(pose.rotation[:, 2], [0, 0, 1], atol=1e-12)
    assert math.isclose(pose.heading_rad(), HEADING + 0.2)
    assert math.isclose(world.path_m[1], math.hypot(0.3, 0.4, 0.1))


def test_open_water_shows_nothing() -> None:
    world = world_at(45.0, 5.0, 1)
    assert world.begin(CAMERA)[1].image.local == 0.0


def _numbers(reading: Reading) -> list[np.ndarray]:
    assert reading.attitude is not None
    assert reading.depth is not None
    numbers = [reading.attitude.rotation[0], np.array([reading.depth.depth_m])]
    if reading.odometry is not None:
        numbers.append(reading.odometry.relative.translation)
    return numbers
