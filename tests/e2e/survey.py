"""A small survey over a flat floor with drawn noise, told in the contract's JSON."""

from typing import Any

import numpy as np

from auditor_math import camera_of, compose, exp_se3, inverse, matrix, pose_json, quaternion

Json = dict[str, Any]
FLOOR_M = 10.0
ALTITUDE_M = 1.5
SPACING_M = 0.5
LANE_M = 0.6
HALF = 0.5**0.5
BODY_FROM_CAMERA: Json = {"translation": [0.1, 0.0, 0.05], "rotation": [0.0, 0.0, HALF, HALF]}


def config(mission: str, **changes: Any) -> Json:
    """A mission over a floor of 12 by 6 m."""
    floor = {
        "origin": [0.0, 0.0, FLOOR_M],
        "u": [0.0, 1.0, 0.0],
        "v": [1.0, 0.0, 0.0],
        "length_u_m": 6.0,
        "length_v_m": 12.0,
    }
    small = {
        "x_m": 0.02,
        "y_m": 0.02,
        "depth_m": 0.005,
        "roll_deg": 0.1,
        "pitch_deg": 0.1,
        "heading_deg": 0.1,
    }
    camera = {"body_from_camera": BODY_FROM_CAMERA}
    planner = {"min_revisit_m": 1.5}
    return {
        "mission": mission,
        "target": {"facets": [floor], "area_m2": None},
        "allowable": small,
        "alpha": 0.9,
        "camera": camera,
        "planner": planner,
        **changes,
    }


def true_poses(lanes: int, per_lane: int) -> list[np.ndarray]:
    """Boustrophedon above the floor, heading along the lane."""
    poses = []
    for lane in range(lanes):
        steps = range(per_lane) if lane % 2 == 0 else reversed(range(per_lane))
        heading = 0.0 if lane % 2 == 0 else np.pi
        for step in steps:
            pose = exp_se3(np.array([0, 0, 0, 0, 0, heading]))
            pose[:3, 3] = [1.0 + SPACING_M * step, 1.0 + LANE_M * lane, FLOOR_M - ALTITUDE_M]
            poses.append(pose)
    return poses


def is_salient(pose: np.ndarray) -> bool:
    """Two patches have texture."""
    x, y = pose[0, 3], pose[1, 3]
    return (x - 3.0) ** 2 + (y - 1.3) ** 2 < 1.1**2 or (x - 6.5) ** 2 + (y - 2.0) ** 2 < 1.0


def fly(vehicle: Any, lanes: int = 4, per_lane: int = 16, seed: int = 7) -> None:
    """Publishes keyframes, navigation factors, link outcomes and registrations of the whole survey."""
    noise = np.random.default_rng(seed)
    poses = true_poses(lanes, per_lane)
    body_from_camera = matrix(BODY_FROM_CAMERA)
    tilted = compose(body_from_camera, exp_se3(np.array([0, 0, 0, np.radians(8.0), 0, 0])))
    for index, pose in enumerate(poses):
        scores = (0.9, 0.7 - 0.001 * index) if is_salient(pose) else (0.15, 0.1)
        camera = pose_json(tilted) if index % 10 == 3 else None
        keyframe = {"id": 100 + 3 * index, "pose": pose_json(pose) if index == 0 else None, "camera": camera,
                    "appearance": {"saliency": {"local": scores[0], "global": scores[1]}}}  # fmt: skip
        vehicle.event("keyframe", keyframe)
        if index:
            _odometry(vehicle, noise, poses, index)
        _absolute(vehicle, noise, pose, 100 + 3 * index)
        _links(vehicle, noise, poses, index, lambda i: tilted if i % 10 == 3 else body_from_camera)


def _odometry(vehicle: Any, noise: np.random.Generator, poses: list[np.ndarray], index: int) -> None:
    step = compose(inverse(poses[index - 1]), poses[index])
    sigma = np.r_[np.full(3, 0.012), np.radians(np.full(3, 0.05))] * np.sqrt(np.linalg.norm(step[:3, 3]))
    measured = compose(step, exp_se3(sigma * noise.standard_normal(6)))
    body = {"from": 97 + 3 * index, "to": 100 + 3 * index, "relative": pose_json(measured),
            "covariance": np.diag(sigma**2).ravel().tolist()}  # fmt: skip
    vehicle.event("factor", {"factor": {"odometry": body}})


def _absolute(vehicle: Any, noise: np.random.Generator, pose: np.ndarray, keyframe: int) -> None:
    sigma = np.radians(0.25)
    turn = np.eye(4)
    turn[:3, :3] = exp_se3(np.r_[np.zeros(3), sigma * noise.standard_normal(3)])[:3, :3] @ pose[:3, :3]
    attitude = {"keyframe": keyframe, "rotation": quaternion(turn[:3, :3]), "tilt_variance_rad2": sigma**2,
                "heading_variance_rad2": sigma**2 if keyframe % 2 else None}  # fmt: skip
    vehicle.event("factor", {"factor": {"attitude": attitude}})
    depth = {
        "keyframe": keyframe,
        "depth_m": pose[2, 3] + 0.02 * noise.standard_normal(),
        "variance_m2": 0.02**2,
    }
    vehicle.event("factor", {"factor": {"depth": depth}})


def _links(
    vehicle: Any, noise: np.random.Generator, poses: list[np.ndarray], index: int, body_from_camera: Any
) -> None:
    here = camera_of(poses[index], body_from_camera(index))
    for other in range(index):
        there = camera_of(poses[other], body_from_camera(other))
        seen = compose(inverse(there), here)
        baseline = np.linalg.norm(seen[:3, 3])
        if not 0.4 <= baseline <= 0.8:
            continue
        rate = 0.85 if is_salient(poses[index]) and is_salient(poses[other]) else 0.03
        registered = bool(noise.random() < rate)
        pair = {"from": 100 + 3 * other, "to": 100 + 3 * index}
        vehicle.event("link", {**pair, "registered": registered})
        if registered:
            _camera(vehicle, noise, pair, seen)


def _camera(vehicle: Any, noise: np.random.Generator, pair: Json, seen: np.ndarray) -> None:
    sigma = np.radians([1.0, 1.0, 0.1, 0.1, 0.1])
    drawn = sigma * noise.standard_normal(5)
    direction = seen[:3, 3] / np.linalg.norm(seen[:3, 3])
    basis = np.linalg.svd(direction[None, :])[2][1:]
    direction = direction + drawn[:2] @ basis
    rotation = seen[:3, :3] @ exp_se3(np.r_[np.zeros(3), drawn[2:]])[:3, :3]
    body = {
        **pair,
        "direction": (direction / np.linalg.norm(direction)).tolist(),
        "rotation": quaternion(rotation),
        "covariance": np.diag(sigma**2).ravel().tolist(),
    }
    vehicle.event("factor", {"factor": {"camera": body}})
