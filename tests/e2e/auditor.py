"""Recomputes a decision from the events, the configuration and the linearisation points: dense, and nothing
of ours.

Every matrix is built whole and inverted whole; the equations are those of the paper, named at their lines.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from auditor_math import adjoint, compose, inverse, log_se3, log_so3, matrix, right_jacobian_inverse, rotation

Json = dict[str, Any]
CAUCHY = 2.385


@dataclass
class Graph:
    """The keyframes' linearisation points and the information over them, Lambda_0."""

    config: Json
    index: dict[int, int] = field(default_factory=dict)
    pose: list[np.ndarray] = field(default_factory=list)
    camera: list[np.ndarray] = field(default_factory=list)
    local: list[float] = field(default_factory=list)
    information: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    last_odometry: tuple[np.ndarray, np.ndarray] | None = None

    def add(self, nodes: list[int], jacobians: list[np.ndarray], information: np.ndarray) -> None:
        add_blocks(self.information, nodes, jacobians, information)


def add_blocks(
    total: np.ndarray, nodes: list[int], jacobians: list[np.ndarray], information: np.ndarray
) -> None:
    """total += J^T W J with J spread over the nodes' six columns each."""
    for a, ja in zip(nodes, jacobians, strict=True):
        for b, jb in zip(nodes, jacobians, strict=True):
            total[6 * a : 6 * a + 6, 6 * b : 6 * b + 6] += ja.T @ information @ jb


def relative_jacobians(first: np.ndarray, second: np.ndarray, measured: np.ndarray) -> list[np.ndarray]:
    """Of Log(Z^-1 X_i^-1 X_j)."""
    step = compose(inverse(first), second)
    jacobian = right_jacobian_inverse(log_se3(compose(inverse(measured), step)))
    return [-jacobian @ adjoint(inverse(step)), jacobian]


def camera_terms(
    pose_m: np.ndarray,
    camera_m: np.ndarray,
    pose_i: np.ndarray,
    camera_i: np.ndarray,
    direction: np.ndarray | None,
    turn: np.ndarray | None,
) -> tuple[np.ndarray, list[np.ndarray]]:
    """Residual and Jacobians of the five-degree camera factor; no measurement means a zero residual."""
    seen = compose(inverse(pose_m @ camera_m), pose_i @ camera_i)
    distance = np.linalg.norm(seen[:3, 3])
    unit = seen[:3, 3] / distance
    z = unit if direction is None else direction
    axis = np.eye(3)[int(np.argmin(np.abs(z)))]
    b1 = np.cross(z, axis) / np.linalg.norm(np.cross(z, axis))
    basis = np.vstack([b1, np.cross(z, b1)])
    angle = np.zeros(3) if turn is None else log_so3(turn.T @ seen[:3, :3])
    by_seen = np.zeros((5, 6))
    by_seen[:2, :3] = basis @ (np.eye(3) - np.outer(unit, unit)) @ seen[:3, :3] / distance
    by_seen[2:, 3:] = right_jacobian_inverse(angle)
    by_m = -by_seen @ adjoint(inverse(seen)) @ adjoint(inverse(camera_m))
    return np.r_[basis @ unit, angle], [by_m, by_seen @ adjoint(inverse(camera_i))]


def build_graph(config: Json, events: list[tuple[str, Json]], graph_reply: Json) -> Graph:
    """Lambda_0 at the linearisation points [PDN12, eq. 4]."""
    graph = Graph(config)
    for number, keyframe in enumerate(graph_reply["keyframes"]):
        graph.index[keyframe["id"]] = number
        graph.pose.append(matrix(keyframe["linearization"]))
        graph.local.append(keyframe["local_saliency"])
    graph.camera = [matrix(config["camera"]["body_from_camera"])] * len(graph.pose)
    graph.information = np.zeros((6 * len(graph.pose),) * 2)
    _first_prior(graph, events)
    for kind, event in events:
        if kind == "keyframe" and event["camera"]:
            graph.camera[graph.index[event["id"]]] = matrix(event["camera"])
    for kind, event in events:
        if kind == "factor":
            ((name, body),) = event["factor"].items()
            FACTORS[name](graph, body)
    return graph


def _first_prior(graph: Graph, events: list[tuple[str, Json]]) -> None:
    first = next(event for kind, event in events if kind == "keyframe")
    sigmas = graph.config["first_keyframe_sigmas"]
    sigma = np.r_[sigmas["translation_m"], np.radians(sigmas["rotation_deg"])]
    node = graph.index[first["id"]]
    residual = log_se3(compose(inverse(matrix(first["pose"])), graph.pose[node]))
    graph.add([node], [right_jacobian_inverse(residual)], np.diag(sigma**-2.0))


def _odometry(graph: Graph, body: Json) -> None:
    i, j = graph.index[body["from"]], graph.index[body["to"]]
    covariance = np.reshape(body["covariance"], (6, 6))
    measured = matrix(body["relative"])
    graph.add([i, j], relative_jacobians(graph.pose[i], graph.pose[j], measured), np.linalg.inv(covariance))
    graph.last_odometry = (measured, covariance)


def _attitude(graph: Graph, body: Json) -> None:
    i = graph.index[body["keyframe"]]
    z = rotation(body["rotation"])
    jacobian = np.zeros((3, 6))
    jacobian[:, 3:] = right_jacobian_inverse(log_so3(graph.pose[i][:3, :3] @ z.T)) @ z
    heading = body["heading_variance_rad2"]
    weights = [1 / body["tilt_variance_rad2"]] * 2 + [1 / heading if heading else 0.0]
    graph.add([i], [jacobian], np.diag(weights))


def _depth(graph: Graph, body: Json) -> None:
    i = graph.index[body["keyframe"]]
    jacobian = np.zeros((1, 6))
    jacobian[0, :3] = graph.pose[i][2, :3]
    graph.add([i], [jacobian], np.array([[1 / body["variance_m2"]]]))


def _camera(graph: Graph, body: Json) -> None:
    m, i = graph.index[body["from"]], graph.index[body["to"]]
    turn, direction = rotation(body["rotation"]), np.array(body["direction"])
    residual, jacobians = camera_terms(
        graph.pose[m], graph.camera[m], graph.pose[i], graph.camera[i], direction, turn
    )
    information = np.linalg.inv(np.reshape(body["covariance"], (5, 5)))
    weight = 1 / (1 + residual @ information @ residual / CAUCHY**2)
    graph.add([m, i], jacobians, weight * information)


FACTORS = {"odometry": _odometry, "attitude": _attitude, "depth": _depth, "camera": _camera}


@dataclass
class Expectation:
    """What a path promises: covariances of its virtual nodes for each treatment of the links."""

    expected: list[np.ndarray]
    all_links: np.ndarray
    no_links: np.ndarray


def expect(graph: Graph, robot: int, poses: list[Json], links: list[list[float]]) -> Expectation:
    """Dense inverse of Lambda_0 + Lambda_odo + Lambda_cam + absolute [PDN12, eq. 1, 3, 4]."""
    nodes = [graph.pose[robot]] + [matrix(pose) for pose in poses]
    cameras = [graph.camera[nearest(graph, node)] for node in nodes]
    size = len(graph.pose)
    number = [robot, *range(size, size + len(poses))]
    base = np.zeros((6 * (size + len(poses)),) * 2)
    base[: 6 * size, : 6 * size] = graph.information
    _virtual_odometry(graph.config, base, nodes, number)
    _virtual_absolute(graph.config, base, nodes, number)
    cam = graph.config["camera"]
    sigma = np.radians([cam["direction_sigma_deg"]] * 2 + [cam["rotation_sigma_deg"]] * 3)
    results = []
    for weigh in (lambda p: p, lambda _: 1.0, lambda _: 0.0):
        total = base.copy()
        for node, keyframe, probability in links:
            m, i = graph.index[int(keyframe)], int(node)
            _, jacobians = camera_terms(graph.pose[m], graph.camera[m], nodes[i], cameras[i], None, None)
            add_blocks(total, [m, number[i]], jacobians, weigh(probability) * np.diag(sigma**-2.0))
        covariance = invert(total)
        results.append([covariance[6 * k : 6 * k + 6, 6 * k : 6 * k + 6] for k in number[1:]])
    return Expectation(results[0], results[1][-1], results[2][-1])


def _virtual_odometry(config: Json, total: np.ndarray, nodes: list[np.ndarray], number: list[int]) -> None:
    odo = config["odometry"]
    sigma = np.r_[odo["translation_sigma_m_per_sqrt_m"], np.radians(odo["rotation_sigma_deg_per_sqrt_m"])]
    for a in range(len(nodes) - 1):
        step = compose(inverse(nodes[a]), nodes[a + 1])
        information = np.diag(1 / (sigma**2 * np.linalg.norm(step[:3, 3])))
        add_blocks(total, number[a : a + 2], relative_jacobians(nodes[a], nodes[a + 1], step), information)


def _virtual_absolute(config: Json, total: np.ndarray, nodes: list[np.ndarray], number: list[int]) -> None:
    tilt, heading, depth = (
        config["attitude"]["tilt_sigma_deg"],
        config["attitude"]["heading_sigma_deg"],
        config["depth"]["sigma_m"],
    )
    weights = np.diag(np.radians([tilt, tilt, heading]) ** -2.0)
    for node, k in zip(nodes[1:], number[1:], strict=True):
        attitude = np.hstack([np.zeros((3, 3)), node[:3, :3]])
        add_blocks(total, [k], [attitude], weights)
        add_blocks(total, [k], [np.r_[node[2, :3], np.zeros(3)][None, :]], np.array([[depth**-2.0]]))


def invert(information: np.ndarray) -> np.ndarray:
    """Dense inverse, scaled to a unit diagonal before, which halves the digits that conditioning costs."""
    scale = 1 / np.sqrt(np.diag(information))
    return np.linalg.inv(information * np.outer(scale, scale)) * np.outer(scale, scale)


def nearest(graph: Graph, node: np.ndarray) -> int:
    """The keyframe nearest to a virtual node, ties to the lower id."""
    by_id = sorted(graph.index)
    distances = [np.linalg.norm(graph.pose[graph.index[k]][:3, 3] - node[:3, 3]) for k in by_id]
    return graph.index[by_id[int(np.argmin(distances))]]


def ratio(covariance: np.ndarray, allowable: Json) -> float:
    """(|Sigma| / |Sigma_allow|)^(1/6), by logarithms [PDN12, eq. 5]."""
    metres = [allowable["x_m"], allowable["y_m"], allowable["depth_m"]]
    radians = np.radians([allowable["roll_deg"], allowable["pitch_deg"], allowable["heading_deg"]])
    factor = np.linalg.cholesky(covariance)
    log_allow = np.log(np.r_[metres, radians]).sum()
    return float(np.exp((np.log(np.diag(factor)).sum() - log_allow) / 3))


def link_probability(config: Json, events: list[tuple[str, Json]], graph: Graph) -> np.ndarray:
    """The table of P_L with the outcomes of the mission [PDN12, eq. 2]."""
    bins = config["link_model"]["bins"]
    prior = np.reshape(config["link_model"]["prior"], (bins, bins, 2))
    proposed, registered = np.zeros((bins, bins)), np.zeros((bins, bins))
    for kind, event in events:
        if kind == "link":
            a, b = (saliency_bin(graph.local[graph.index[event[end]]], bins) for end in ("from", "to"))
            for row, column in {(a, b), (b, a)}:
                proposed[row, column] += 1
                registered[row, column] += event["registered"]
    return (registered + prior[..., 0]) / (proposed + prior.sum(axis=2))


def saliency_bin(local: float, bins: int) -> int:
    return min(int(local * bins), bins - 1)


def waypoints(graph: Graph, global_saliency: dict[int, float]) -> list[Json]:
    """Keyframes that represent clusters of the salient set, by the page: DBSCAN, then in each cluster the
    greatest S_G * u_min / u represents what is within the radius, and so on with what is left.
    """
    planner = graph.config["planner"]
    places = {k: graph.pose[i][:3, 3] for k, i in graph.index.items()}
    salient = sorted(
        k for k, i in graph.index.items() if graph.local[i] >= planner["waypoint_local_saliency"]
    )
    covariance = invert(graph.information)
    u = {k: _sixth_root(covariance, graph.index[k]) for k in salient}
    steps = np.diff(np.array(graph.pose)[:, :3, 3], axis=0)
    radius = planner["max_cluster_radius_m"] or 24 * np.median(np.linalg.norm(steps, axis=1))
    limit = round(min(radius, 1e9) * 1e9)  # in nanometres; no survey is a million kilometres wide
    found = []
    for cluster in _dbscan(places, salient, planner["eps_m"], planner["min_points"]):
        least = min(u[k] for k in cluster)
        score = {k: global_saliency[k] * least / u[k] for k in cluster}
        left = sorted(cluster)
        while left:
            best = max(left, key=lambda k: score[k])
            members = [k for k in left if _nanometres(places[k] - places[best]) <= limit]
            found.append({"keyframe": best, "score": score[best], "members": members})
            left = [k for k in left if k not in members]
    return sorted(found, key=lambda waypoint: waypoint["keyframe"])


def _sixth_root(covariance: np.ndarray, index: int) -> float:
    block = covariance[6 * index : 6 * index + 6, 6 * index : 6 * index + 6]
    return float(np.exp(np.linalg.slogdet(block)[1] / 6))


def _nanometres(difference: np.ndarray) -> int:
    return round(float(np.linalg.norm(difference)) * 1e9)


def _dbscan(places: dict[int, np.ndarray], ids: list[int], eps: float, points: int) -> list[set[int]]:
    """Core keyframes joined step by step; a border keyframe goes with the nearest core keyframe."""
    limit = round(eps * 1e9)
    near = {a: {b: d for b in ids if (d := _nanometres(places[a] - places[b])) <= limit} for a in ids}
    label = {k: k for k in ids if len(near[k]) >= points}
    while True:
        joined = {k: min(label[o] for o in near[k] if o in label) for k in label}
        if joined == label:
            break
        label = joined
    clusters: dict[int, set[int]] = {}
    for k in ids:
        core = min((o for o in near[k] if o in label), key=lambda o, k=k: (near[k][o], o), default=None)
        if core is not None:
            clusters.setdefault(label[core], set()).add(k)
    return list(clusters.values())
