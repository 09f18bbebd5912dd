"""An independent program flies a small mission by JSON over Zenoh and recomputes a decision, number by
number.
"""

from typing import Any

import numpy as np
import pytest

from auditor import (
    Graph,
    adjoint,
    build_graph,
    expect,
    invert,
    link_probability,
    matrix,
    nearest,
    ratio,
    saliency_bin,
    waypoints,
)
from auditor_math import inverse
from conftest import Daemon
from json_zenoh import JsonVehicle, open_session
from survey import config, fly

Json = dict[str, Any]

# Exact methods agree to about condition number times machine epsilon; 1e-9, scaled by standard deviations,
# is what the method's page promises, a hundred times what is seen here.
SCALED = 1e-9


class Audited:
    """A flown mission with its decision and all that the auditor may know."""

    def __init__(self, endpoint: str) -> None:
        with open_session(endpoint) as session:
            vehicle = JsonVehicle(session, "audited", "audit-1")
            self.state = vehicle.ask("op/configure", config("audit-1"))
            vehicle.ask("op/start", {"reason": "audit"})
            fly(vehicle)
            self.decision = vehicle.ask("rpc/decision", after=vehicle.seq - 1, detail="full")
            self.graph_reply = vehicle.ask("rpc/graph", marginals="true")
            self.link_model = vehicle.ask("rpc/link_model")
            self.coverage = vehicle.ask("rpc/coverage")
            self.waypoints = vehicle.ask("rpc/waypoints")["waypoints"]
            self.what_if = vehicle.ask("rpc/decision", alpha=0.0)
            self.after = vehicle.ask("rpc/mission")
        self.events = vehicle.events
        self.config = self.state["config"]
        self.graph = build_graph(self.config, self.events, self.graph_reply)
        self.robot = self.graph.index[self.decision["robot"]["keyframe"]]


@pytest.fixture(scope="module")
def audited(daemon: Daemon) -> Audited:
    return Audited(daemon.endpoint)


def assert_covariance(got: list[float], truth: np.ndarray) -> None:
    sigma = np.sqrt(np.diag(truth))
    error = np.abs(np.reshape(got, (6, 6)) - truth) / np.outer(sigma, sigma)
    assert error.max() < SCALED, f"scaled error {error.max():.3g}"


def test_the_mission_is_worth_auditing(audited: Audited) -> None:
    decision = audited.decision
    assert len(decision["candidates"]) >= 2
    assert all(len(candidate["links"]) >= 4 for candidate in decision["candidates"])
    assert list(decision["action"]) == ["revisit"]
    assert decision["decision"] == 0
    assert decision["graph_seq"] == len(audited.events) == audited.after["next_seq"]
    assert decision["phase"] == "running"
    assert decision["complete"]
    assert decision["not_evaluated"] == []


def test_marginals_of_the_graph(audited: Audited) -> None:
    covariance = invert(audited.graph.information)
    for keyframe in audited.graph_reply["keyframes"]:
        k = 6 * audited.graph.index[keyframe["id"]]
        assert_covariance(keyframe["covariance"], covariance[k : k + 6, k : k + 6])


def test_exploration(audited: Audited) -> None:
    decision, graph = audited.decision, audited.graph
    k = 6 * audited.robot
    robot = invert(graph.information)[k : k + 6, k : k + 6]
    assert_covariance(decision["robot"]["covariance"], robot)
    assert graph.last_odometry is not None
    measured, noise = graph.last_odometry
    carry = adjoint(inverse(measured))
    expected = carry @ robot @ carry.T + noise
    exploration = decision["exploration"]
    assert_covariance(exploration["covariance"], expected)
    u = ratio(expected, decision["allowable"])
    assert exploration["uncertainty"] == pytest.approx(u if u >= 1 else 0, abs=1e-9)
    check_reward(decision, exploration, 0.0)


def test_each_candidate(audited: Audited) -> None:
    decision, graph = audited.decision, audited.graph
    allowable = decision["allowable"]
    for candidate in decision["candidates"]:
        truth = expect(graph, audited.robot, candidate["poses"], candidate["links"])
        assert_covariance(candidate["covariance"], truth.expected[-1])
        assert candidate["uncertainty"] == pytest.approx(ratio(truth.expected[-1], allowable), abs=1e-9)
        assert candidate["uncertainty_all_links"] == pytest.approx(
            ratio(truth.all_links, allowable), abs=1e-9
        )
        assert candidate["uncertainty_no_links"] == pytest.approx(ratio(truth.no_links, allowable), abs=1e-9)
        peak = max(ratio(covariance, allowable) for covariance in truth.expected)
        assert candidate["peak_uncertainty"] == pytest.approx(peak, abs=1e-9)
        redundant = 2 * candidate["one_way_m"] * audited.config["planner"]["swath_m"]
        assert candidate["redundant_m2"] == pytest.approx(redundant, rel=1e-12)
        check_reward(decision, candidate, redundant)
        check_break_even(decision, candidate)
        assert candidate["nodes"] == len(candidate["poses"])


def check_reward(decision: Json, option: Json, redundant_m2: float) -> None:
    area = (decision["target_m2"] - decision["covered_m2"] + redundant_m2) / decision["target_m2"]
    penalty = decision["alpha"] * option["uncertainty"] + (1 - decision["alpha"]) * area
    assert option["area"] == pytest.approx(area, abs=1e-9)
    assert option["penalty"] == pytest.approx(penalty, abs=1e-9)
    assert option["reward"] == pytest.approx(-penalty, abs=1e-9)


def check_break_even(decision: Json, candidate: Json) -> None:
    gain = decision["exploration"]["uncertainty"] - candidate["uncertainty"]
    cost = candidate["redundant_m2"] / decision["target_m2"]
    if gain <= 0:
        assert candidate["break_even_alpha"] is None
    else:
        assert candidate["break_even_alpha"] == pytest.approx(cost / (cost + gain), abs=1e-9)


def test_the_paths_lead_where_they_say(audited: Audited) -> None:
    decision, graph = audited.decision, audited.graph
    here = graph.pose[audited.robot][:3, 3]
    spacing = np.median(
        [np.linalg.norm(b[:3, 3] - a[:3, 3]) for a, b in zip(graph.pose, graph.pose[1:], strict=False)]
    )
    for candidate in decision["candidates"]:
        assert candidate["path"][0] == decision["robot"]["keyframe"]
        assert candidate["path"][-1] == candidate["keyframe"]
        corners = np.array([graph.pose[graph.index[k]][:3, 3] for k in candidate["path"]])
        length = np.linalg.norm(np.diff(corners, axis=0), axis=1).sum()
        assert candidate["one_way_m"] == pytest.approx(length, rel=1e-9)
        places = np.array([matrix(pose)[:3, 3] for pose in candidate["poses"]])
        steps = np.linalg.norm(np.diff(np.vstack([here, places]), axis=0), axis=1)
        assert steps.sum() == pytest.approx(2 * length, rel=1e-9)
        assert steps.max() <= spacing * (1 + 1e-9)
        assert np.allclose(matrix(candidate["poses"][-1]), graph.pose[audited.robot], atol=1e-12)


def test_the_links_are_those_that_the_rule_proposes(audited: Audited) -> None:
    graph, planner = audited.graph, audited.config["planner"]
    table = link_probability(audited.config, audited.events, graph)
    check_link_model(audited, table)
    for candidate in audited.decision["candidates"]:
        nodes = [matrix(pose) for pose in candidate["poses"]]
        expected = [
            [n, keyframe, p]
            for n, node in enumerate(nodes, 1)
            for keyframe, p in propose(graph, planner, table, node)
        ]
        got = sorted(candidate["links"], key=lambda link: (link[0], link[1]))
        expected.sort(key=lambda link: (link[0], link[1]))
        assert [link[:2] for link in got] == [link[:2] for link in expected]
        assert np.allclose([link[2] for link in got], [link[2] for link in expected], rtol=1e-12)
        assert candidate["expected_links"] == pytest.approx(sum(link[2] for link in expected), rel=1e-9)


def check_link_model(audited: Audited, table: np.ndarray) -> None:
    assert np.allclose(
        [cell["probability"] for cell in audited.link_model["cells"]], table.ravel(), rtol=1e-12
    )
    assert audited.decision["link_model"]["cells"] == audited.link_model["cells"]


def propose(graph: Graph, planner: Json, table: np.ndarray, node: np.ndarray) -> list[tuple[int, float]]:
    close = nearest(graph, node)
    camera = node @ graph.camera[close]
    bins = len(table)
    found = []
    for keyframe, index in graph.index.items():
        other = graph.pose[index] @ graph.camera[index]
        distance = float(np.linalg.norm(other[:3, 3] - camera[:3, 3]))
        angle = np.degrees(np.arccos(np.clip(other[:3, 2] @ camera[:3, 2], -1, 1)))
        if (
            planner["min_baseline_m"] <= distance <= planner["max_baseline_m"]
            and angle <= planner["max_view_angle_deg"]
        ):
            p = table[saliency_bin(graph.local[close], bins), saliency_bin(graph.local[index], bins)]
            found.append((-p, distance, keyframe))
    return [(keyframe, -p) for p, _, keyframe in sorted(found)[: planner["max_links"]]]


def test_the_choice(audited: Audited) -> None:
    decision = audited.decision
    options = [(decision["exploration"]["penalty"], 0)] + [
        (c["penalty"], c["candidate"]) for c in decision["candidates"]
    ]
    best = min(options)[1]
    chosen = decision["action"].get("revisit", {"candidate": 0})["candidate"]
    assert chosen == best
    keyframes = [candidate["keyframe"] for candidate in decision["candidates"]]
    assert keyframes == sorted(keyframes)
    assert [candidate["candidate"] for candidate in decision["candidates"]] == list(
        range(1, len(keyframes) + 1)
    )


def test_the_covered_area(audited: Audited) -> None:
    """By an own raster of the final poses; the service's may lag half a cell behind a moved keyframe."""
    camera, floor = audited.config["camera"], audited.config["target"]["facets"][0]
    cell = audited.config["cell_m"]
    u, v = np.meshgrid(np.arange(60) * cell + cell / 2, np.arange(120) * cell + cell / 2)
    points = (
        np.array(floor["origin"]) + u[..., None] * np.array(floor["u"]) + v[..., None] * np.array(floor["v"])
    )
    seen = np.zeros(u.shape, dtype=bool)
    limits = np.tan(np.radians([camera["horizontal_fov_deg"] / 2, camera["vertical_fov_deg"] / 2]))
    for pose, mount in zip(audited.graph.pose, audited.graph.camera, strict=True):
        world = pose @ mount
        p = (points - world[:3, 3]) @ world[:3, :3]
        with np.errstate(divide="ignore", invalid="ignore"):
            inside = (np.abs(p[..., :2] / p[..., 2:]) <= limits).all(axis=-1)
        seen |= inside & (p[..., 2] > 0) & (p[..., 2] <= camera["max_range_m"])
    assert audited.decision["covered_m2"] == pytest.approx(72.0 * seen.mean(), rel=0.02)
    assert audited.decision["target_m2"] == pytest.approx(72.0)


def test_a_what_if_changes_nothing(audited: Audited) -> None:
    assert audited.what_if["decision"] is None
    assert audited.what_if["alpha"] == 0.0
    assert audited.what_if["action"] == {"explore": {}}
    assert audited.after["decisions"] == 1
    assert audited.after["revisits"] == 1


def test_the_waypoints_are_those_of_the_page(audited: Audited) -> None:
    check_waypoints(audited.graph, audited.events, audited.waypoints)
    assert len(audited.waypoints) >= 2


LINE = 60
STEP_M = 0.5
# Saliency that prefers neither end: the best is in the middle, and the next are found on both sides of it.
WORTH = {"uniform": lambda _: 0.5, "middle": lambda k: 0.9 - 0.01 * abs(k - 30)}


@pytest.mark.parametrize("worth", sorted(WORTH))
@pytest.mark.parametrize("radius_m", [None, 4.0, 1e308])
def test_a_long_salient_line_is_represented_by_the_page(
    daemon: Daemon, worth: str, radius_m: float | None
) -> None:
    """One cluster along 30 m: 24 spacings are 12 m, and each keyframe is within that of its waypoint."""
    name = f"line-{worth}-{radius_m}".lower().replace(".", "-").replace("+", "")
    with open_session(daemon.endpoint) as session:
        vehicle = JsonVehicle(session, name, name)
        planner = {"max_cluster_radius_m": radius_m}
        state = vehicle.ask("op/configure", config(name, planner=planner))
        vehicle.ask("op/start", {"reason": "audit"})
        fly_line(vehicle, WORTH[worth])
        replied = vehicle.ask("rpc/waypoints", after=vehicle.seq - 1)["waypoints"]
        graph = build_graph(state["config"], vehicle.events, vehicle.ask("rpc/graph", marginals="true"))
    check_waypoints(graph, vehicle.events, replied)
    assert sum(len(waypoint["members"]) for waypoint in replied) == LINE
    assert (len(replied) == 1) == (radius_m == 1e308)


def fly_line(vehicle: JsonVehicle, worth: Any) -> None:
    """Straight ahead over texture that is rich everywhere; odometry and depth say exactly that."""
    level = [0.0, 0.0, 0.0, 1.0]
    noise = np.diag(np.r_[np.full(3, 1e-4), np.full(3, 1e-6)]).ravel().tolist()
    for k in range(LINE):
        pose = {"translation": [0.0, 0.0, 6.5], "rotation": level} if k == 0 else None
        saliency = {"local": 0.9, "global": worth(k)}
        vehicle.event(
            "keyframe", {"id": k, "pose": pose, "camera": None, "appearance": {"saliency": saliency}}
        )
        if k:
            step = {"translation": [STEP_M, 0.0, 0.0], "rotation": level}
            body = {"from": k - 1, "to": k, "relative": step, "covariance": noise}
            vehicle.event("factor", {"factor": {"odometry": body}})
        depth = {"keyframe": k, "depth_m": 6.5, "variance_m2": 4e-4}
        vehicle.event("factor", {"factor": {"depth": depth}})


def check_waypoints(graph: Graph, events: list[tuple[str, Json]], replied: list[Json]) -> None:
    worth = {
        event["id"]: event["appearance"]["saliency"]["global"] for kind, event in events if kind == "keyframe"
    }
    expected = waypoints(graph, worth)
    assert [waypoint["keyframe"] for waypoint in replied] == [waypoint["keyframe"] for waypoint in expected]
    for got, truth in zip(replied, expected, strict=True):
        assert got["members"] == truth["members"]
        assert got["score"] == pytest.approx(truth["score"], rel=SCALED)
