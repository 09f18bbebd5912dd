"""Lines of a g2o file, with every digit that a number needs to come back the same."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from .transform import Matrix, Transform


def vertex(id: int, pose: Transform) -> str:
    """A vertex at its pose."""
    return f"VERTEX_SE3:QUAT {id} {_pose(pose)}"


def fix(id: int) -> str:
    """What holds a vertex where it is."""
    return f"FIX {id}"


def edge(from_: int, to: int, relative: Transform, covariance: Matrix) -> str:
    """The pose of `to` in the frame of `from_`."""
    return f"EDGE_SE3:QUAT {from_} {to} {_pose(relative)} {_information(covariance)}"


IDENTITY_OFFSET = "PARAMS_SE3OFFSET 0 0 0 0 0 0 0 1"
"""The offset that `prior` names."""


def prior(keyframe: int, pose: Transform, covariance: Matrix) -> str:
    """A measured pose, at the offset 0."""
    return f"EDGE_SE3_PRIOR {keyframe} 0 {_pose(pose)} {_information(covariance)}"


def _pose(pose: Transform) -> str:
    return _text([*pose.translation, *pose.rotation])


def _information(covariance: Matrix) -> str:
    information = np.linalg.inv(covariance)
    return _text(((information + information.T) / 2.0)[np.triu_indices(6)].tolist())


def _text(numbers: Iterable[float]) -> str:
    return " ".join(repr(float(number)) for number in numbers)
