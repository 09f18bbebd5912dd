"""The survey's stream of factors through iSAM2: as nearly the factors that pdn gets as GTSAM has in C++.

A camera link becomes a BetweenFactorPose3 whose range is that of the truth with a deviation of RANGE_SIGMA_M,
so that it tells next to nothing, and whose direction and rotation are as sure as the camera's. Attitude is a
PoseRotationPrior, depth a PoseTranslationPrior that leaves the horizontal open by HORIZONTAL_SIGMA_M.
"""

from collections.abc import Iterator

import gtsam
import numpy as np

from cpu import forget_peak, peak_mb, resident_mb, timed
from survey_file import ATTITUDE, CAMERA, DEPTH, ODOMETRY, PRIOR, Array, SurveyFile

RANGE_SIGMA_M = 10.0
HORIZONTAL_SIGMA_M = 1e4

# Threshold and interval of relinearising: what GTSAM ships, and what follows the estimate closely.
SETTINGS = {"as shipped (0.1, each 10th)": (0.1, 10), "close (0.01, each)": (0.01, 1)}


def stream(survey: SurveyFile, threshold: float, skip: int) -> dict[str, object]:
    """Streams everything; CPU times of each keyframe in ms: the update, and reading the newest pose,
    which solves.
    """
    parameters = gtsam.ISAM2Params()
    parameters.setRelinearizeThreshold(threshold)
    parameters.relinearizeSkip = skip
    forget_peak()
    before = resident_mb()
    tree = gtsam.ISAM2(parameters)
    updates, totals = [], []
    for keyframe, (graph, values) in enumerate(groups(survey)):
        _, update_ms = timed(tree.update, graph, values)
        _, read_ms = timed(tree.calculateEstimatePose3, keyframe)
        updates.append(update_ms)
        totals.append(update_ms + read_ms)
    memory = {"before": before, "peak": peak_mb()}
    estimate = tree.calculateEstimate()
    optimum = batch_optimum(survey, estimate)
    return {
        "update_only": summary(updates),
        "update": summary(totals),
        "memory": memory,
        "drift": distance(estimate, optimum),
        "from_ours": distance(optimum, ours(survey)),
    }


def groups(survey: SurveyFile) -> Iterator[tuple[gtsam.NonlinearFactorGraph, gtsam.Values]]:
    """For each keyframe its factors and its first estimate."""
    ends, poses, sigmas = survey["stream_ends"].tolist(), survey["stream_poses"], survey["stream_sigmas"]
    body_from_camera = pose3(survey["body_from_camera"][0])
    at = 0
    for keyframe, first_estimate in enumerate(survey["stream_first_estimates"]):
        graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
        values.insert(keyframe, pose3(first_estimate))
        while at < len(ends) and ends[at][0] == keyframe:
            _, kind, other = ends[at]
            graph.push_back(factor(keyframe, kind, other, pose3(poses[at]), sigmas[at], body_from_camera))
            at += 1
        yield graph, values


def factor(
    keyframe: int, kind: int, other: int, pose: gtsam.Pose3, sigmas: Array, body_from_camera: gtsam.Pose3
) -> gtsam.NonlinearFactor:
    """GTSAM's tangent vectors begin with the rotation."""
    rotation_first = np.concatenate([sigmas[3:], sigmas[:3]])
    match kind:
        case _ if kind == PRIOR:
            return gtsam.PriorFactorPose3(keyframe, pose, gtsam.noiseModel.Diagonal.Sigmas(rotation_first))
        case _ if kind == ODOMETRY:
            model = gtsam.noiseModel.Diagonal.Sigmas(rotation_first)
            return gtsam.BetweenFactorPose3(other, keyframe, pose, model)
        case _ if kind == ATTITUDE:
            return gtsam.PoseRotationPrior3D(keyframe, pose, gtsam.noiseModel.Diagonal.Sigmas(sigmas[3:]))
        case _ if kind == DEPTH:
            open_sigmas = np.array([HORIZONTAL_SIGMA_M, HORIZONTAL_SIGMA_M, sigmas[0]])
            return gtsam.PoseTranslationPrior3D(keyframe, pose, gtsam.noiseModel.Diagonal.Sigmas(open_sigmas))
        case _ if kind == CAMERA:
            relative = body_from_camera.compose(pose).compose(body_from_camera.inverse())
            model = gtsam.noiseModel.Gaussian.Covariance(camera_covariance(relative, sigmas[0], sigmas[3]))
            return gtsam.BetweenFactorPose3(other, keyframe, relative, model)
        case _:
            raise ValueError(f"measurement of unknown kind {kind}")


def camera_covariance(relative: gtsam.Pose3, direction_sigma: float, rotation_sigma: float) -> Array:
    """Of the error of a relative pose, in the later body's axes: sure across the baseline, open along it."""
    translation = relative.translation()
    along = np.outer(translation, translation) / (translation @ translation)
    across_variance = direction_sigma**2 * (translation @ translation)
    in_earlier = across_variance * (np.eye(3) - along) + RANGE_SIGMA_M**2 * along
    rotation = relative.rotation().matrix()
    covariance = np.zeros((6, 6))
    covariance[:3, :3] = rotation_sigma**2 * np.eye(3)
    covariance[3:, 3:] = rotation.T @ in_earlier @ rotation
    return covariance


def batch_optimum(survey: SurveyFile, start: gtsam.Values) -> gtsam.Values:
    graph = gtsam.NonlinearFactorGraph()
    for group, _ in groups(survey):
        graph.push_back(group)
    parameters = gtsam.GaussNewtonParams()
    parameters.setRelativeErrorTol(1e-14)
    parameters.setAbsoluteErrorTol(1e-12)
    parameters.setMaxIterations(10)
    return gtsam.GaussNewtonOptimizer(graph, start, parameters).optimize()


def ours(survey: SurveyFile) -> gtsam.Values:
    """Where pdn's smoother converged."""
    values = gtsam.Values()
    for keyframe, pose in enumerate(survey["poses"]):
        values.insert(keyframe, pose3(pose))
    return values


def distance(one: gtsam.Values, other: gtsam.Values) -> list[float]:
    """Greatest difference of two trajectories, [m, rad]."""
    steps = np.array(
        [gtsam.Pose3.Logmap(one.atPose3(key).between(other.atPose3(key))) for key in range(one.size())]
    )
    return [float(np.linalg.norm(steps[:, part], axis=1).max()) for part in (slice(3, 6), slice(0, 3))]


def summary(times_ms: list[float]) -> dict[str, float]:
    """As pdn-perf tells of many times."""
    ordered = sorted(times_ms)
    late = (len(ordered) * 99 + 99) // 100 - 1
    return {
        "count": len(ordered),
        "sum": sum(ordered),
        "median": float(np.median(ordered)),
        "p99": ordered[late],
        "greatest": ordered[-1],
    }


def pose3(row: Array) -> gtsam.Pose3:
    """From translation and quaternion x, y, z, w."""
    x, y, z, w = row[3:]
    return gtsam.Pose3(gtsam.Rot3.Quaternion(w, x, y, z), row[:3])
