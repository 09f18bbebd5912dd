"""Scenarios: the paper's figures, the real hull's area, refusals that name the field."""

from __future__ import annotations

import copy
import math
import tomllib
from importlib import resources

import numpy as np
import pytest

from pdn.sim import scenario_file
from pdn.sim.scenario import ScenarioError
from pdn.sim.se3 import Pose, level
from pdn.sim.survey import Survey
from pdn.sim.vehicle import body_from_camera

NAMES = ["gunnerus", "hull40", "seafloor"]
PUBLISHED_WETTED_M2 = 200.98


def table_of(name: str) -> dict:
    return tomllib.loads((resources.files("pdn.sim") / "scenarios" / f"{name}.toml").read_text())


def test_all_that_come_with_the_package_load() -> None:
    assert scenario_file.packaged() == NAMES
    for name in NAMES:
        assert scenario_file.load(name).name == name


def test_hull40_is_the_paper_s() -> None:
    scenario = scenario_file.load("hull40")
    assert scenario.surface.area_m2 == 1200.0
    for facet in scenario.surface.facets:
        np.testing.assert_allclose(facet.normal, [[0, -1, 0], [0, 0, 1]][facet.name == "bottom"], atol=1e-15)
    survey = Survey(scenario)
    assert len(survey.lines_v_m) == 25
    on_lines = sum(point.ends_line for point in survey.points)
    assert on_lines == 25
    places = np.array([point.viewpoint.position for point in survey.points])
    steps = np.linalg.norm(np.diff(places, axis=0), axis=1)
    # 25 lines of 40 m, 23 turns of 1.2 m on a plane, one round the bilge: 1.0 m down, a quarter circle of
    # 1.5 m as three chords, 0.2 m on.
    chords = 3 * 2 * 1.5 * math.sin(math.pi / 12)
    assert math.isclose(steps.sum(), 25 * 40 + 23 * 1.2 + 1.0 + chords + 0.2, abs_tol=1e-9)
    assert np.count_nonzero(np.isclose(steps, 0.5)) == 25 * 80
    np.testing.assert_allclose(scenario.surface.nearest(places).distance_m, 1.5, atol=1e-12)
    assert scenario.saliency_at(5.0, 5.0) == (0.98, 0.9)
    assert scenario.saliency_at(20.0, 5.0) == (0.15, 0.1)


def test_hull40_starts_from_the_stated_prior() -> None:
    prior = scenario_file.load("hull40").config["link_model"]["prior"]
    assert len(prior) == 25
    assert all(math.isclose(a + b, 200.0) for a, b in prior)
    rates = np.array([a / (a + b) for a, b in prior]).reshape(5, 5)
    np.testing.assert_allclose(rates, rates.T)
    assert np.allclose([rates[0, 0], rates[0, 4], rates[4, 4]], [0.005, 0.05, 0.85])


def test_exhaustive_goes_to_the_first_line_at_every_other_end() -> None:
    survey = Survey(scenario_file.load("hull40"))
    detours = [survey.to_first_line(line) for line in range(1, 25, 2)]
    assert len(detours) == 12
    for line, viewpoints in zip(range(1, 25, 2), detours, strict=True):
        end = next(p.viewpoint for p in survey.points if p.line == line and p.ends_line)
        np.testing.assert_allclose(viewpoints[-1].position, end.position, atol=1e-9)
        reached = min(viewpoints, key=lambda viewpoint: viewpoint.position[2])
        np.testing.assert_allclose(reached.position, [0.0, -1.5, 0.6], atol=1e-9)
        steps = np.linalg.norm(np.diff([end.position, *(a.position for a in viewpoints)], axis=0), axis=1)
        assert steps.max() <= 0.5 + 1e-9


@pytest.mark.parametrize("name", NAMES)
def test_the_camera_faces_the_surface_all_the_way(name: str) -> None:
    scenario = scenario_file.load(name)
    standoff = scenario.survey.standoff_m
    misses = []
    for point in Survey(scenario).points[::3]:
        mount = body_from_camera(scenario, point.viewpoint)
        np.testing.assert_allclose(mount.rotation.T @ mount.rotation, np.eye(3), atol=1e-12)
        assert math.isclose(np.linalg.det(mount.rotation), 1.0, abs_tol=1e-12)
        camera = Pose(level(point.viewpoint.heading_rad), point.viewpoint.position) @ mount
        view = scenario.surface.cast(camera.translation, camera.rotation[:, 2][None])
        misses.append(float(view.miss_m[0]))
        assert scenario.surface.nearest(point.viewpoint.position[None]).distance_m[0] > 0.3 * standoff
    # The tilt has one axis: on the real hull, whose patches do not meet exactly, the middle of an image may
    # pass between two of them.
    assert np.mean(np.array(misses) > 1e-6) <= (0.15 if name == "gunnerus" else 0.0)


def test_the_wider_field_of_view_lies_across_the_tracklines() -> None:
    for name in NAMES:
        scenario = scenario_file.load(name)
        points = Survey(scenario).points
        middle = points[10].viewpoint
        way = points[11].viewpoint.position - points[10].viewpoint.position
        camera = level(middle.heading_rad) @ body_from_camera(scenario, middle).rotation
        assert abs(camera[:, 0] @ way) < 0.15 * np.linalg.norm(way)


@pytest.mark.parametrize("name", NAMES)
def test_the_planner_may_cross_from_line_to_line(name: str) -> None:
    """Where it may not, every revisit goes back along the whole survey."""
    scenario = scenario_file.load(name)
    reach_m = scenario.config["planner"].get("edge_radius_m", 2.6 * scenario.survey.keyframe_spacing_m)
    assert reach_m > 1.05 * scenario.survey.line_spacing_m


def test_gunnerus_has_the_published_wetted_area() -> None:
    scenario = scenario_file.load("gunnerus")
    assert abs(scenario.surface.area_m2 / PUBLISHED_WETTED_M2 - 1.0) < 0.01
    for facet in scenario.surface.facets:
        # Outwards: to starboard or down.
        assert facet.normal[1] > 0.0
        assert facet.normal[1] ** 2 + facet.normal[2] ** 2 > 0.7


def test_a_scenario_of_one_s_own(tmp_path: object) -> None:
    path = str(tmp_path) + "/mine.toml"
    text = (resources.files("pdn.sim") / "scenarios" / "seafloor.toml").read_text()
    with open(path, "w") as file:
        file.write(text.replace('name = "seafloor"', 'name = "mine"'))
    assert scenario_file.load(path).name == "mine"


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda t: t.pop("survey"), "survey"),
        (lambda t: t["facets"][0].pop("v"), "v"),
        (lambda t: t["facets"][0].update(v=[0.0, 1.0, 1.0]), "orthogonal unit vectors"),
        (lambda t: t["survey"].update(heading="backwards"), "backwards"),
        (lambda t: t["config"]["odometry"].update(rotation_sigma_deg_per_sqrt_m="much"), "cannot be read"),
        (lambda t: t["survey"].update(lines=40), "no facet lies"),
    ],
)
def test_a_bad_scenario_is_refused_with_its_field(change: object, says: str) -> None:
    table = copy.deepcopy(table_of("hull40"))
    change(table)  # type: ignore[operator]
    with pytest.raises(ScenarioError, match=says):
        Survey(scenario_file.parse(table))


def test_an_unknown_name_lists_the_known_ones() -> None:
    with pytest.raises(ScenarioError, match="gunnerus, hull40, seafloor"):
        scenario_file.load("hull41")
    with pytest.raises(ScenarioError, match="no scenario file"):
        scenario_file.load("./hull41.toml")
