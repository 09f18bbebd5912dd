"""The tags of g2o and TORO: which are read, and which are known and left out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import Enum

from .fields import is_number
from .graph import PoseGraphError
from .transform import Transform, from_euler, from_plane

QUATERNION_SLACK = 1e-2
"""A quaternion whose norm differs more from 1 is no rounding but a garbled line."""


class Kind(Enum):
    """What a line tells."""

    VERTEX = "a vertex"
    EDGE = "an edge"
    PRIOR = "a prior"
    OFFSET = "an offset"


@dataclass(frozen=True, slots=True)
class Tag:
    """The fields of a line: ids, ids of offsets, the numbers of a pose, and those of its information."""

    kind: Kind
    ids: int
    offsets: int
    pose: Callable[[Sequence[float]], Transform]
    poses: int
    information: Sequence[int] = ()
    """For each entry of the upper triangle, row by row, its place among the numbers."""
    planar: bool = False


def quaternion(numbers: Sequence[float]) -> Transform:
    """[x, y, z] and a quaternion [x, y, z, w], normalised to the last digit."""
    x, y, z, qx, qy, qz, qw = numbers
    norm = (qx * qx + qy * qy + qz * qz + qw * qw) ** 0.5
    if not abs(norm - 1.0) <= QUATERNION_SLACK:
        raise PoseGraphError(f"the quaternion's norm is {norm:g}, not 1")
    return Transform((x, y, z), (qx / norm, qy / norm, qz / norm, qw / norm))


def _euler(numbers: Sequence[float]) -> Transform:
    x, y, z, roll, pitch, yaw = numbers
    return from_euler(x, y, z, roll, pitch, yaw)


def _plane(numbers: Sequence[float]) -> Transform:
    x, y, heading = numbers
    return from_plane(x, y, heading)


_SPACE = range(21)
_PLANE = range(6)
_TORO_PLANE = (0, 1, 4, 2, 5, 3)  # The file has xx, xy, yy, hh, xh, yh.

OTHER_ORDER = {"EDGE2": "EDGE_SE2", "EDGE_SE2": "EDGE2"}
"""Tags whose information has two orders in the files that there are, and the tag of the other one."""

TAGS = {
    "VERTEX_SE3:QUAT": Tag(Kind.VERTEX, 1, 0, quaternion, 7),
    "EDGE_SE3:QUAT": Tag(Kind.EDGE, 2, 0, quaternion, 7, _SPACE),
    "EDGE_SE3_OFFSET": Tag(Kind.EDGE, 2, 2, quaternion, 7, _SPACE),
    "EDGE_SE3_PRIOR": Tag(Kind.PRIOR, 1, 1, quaternion, 7, _SPACE),
    "PARAMS_SE3OFFSET": Tag(Kind.OFFSET, 1, 0, quaternion, 7),
    "VERTEX3": Tag(Kind.VERTEX, 1, 0, _euler, 6),
    "EDGE3": Tag(Kind.EDGE, 2, 0, _euler, 6, _SPACE),
    "VERTEX_SE2": Tag(Kind.VERTEX, 1, 0, _plane, 3, planar=True),
    "EDGE_SE2": Tag(Kind.EDGE, 2, 0, _plane, 3, _PLANE, planar=True),
    "EDGE_SE2_OFFSET": Tag(Kind.EDGE, 2, 2, _plane, 3, _PLANE, planar=True),
    "EDGE_PRIOR_SE2": Tag(Kind.PRIOR, 1, 0, _plane, 3, _PLANE, planar=True),
    "PARAMS_SE2OFFSET": Tag(Kind.OFFSET, 1, 0, _plane, 3, planar=True),
    "VERTEX2": Tag(Kind.VERTEX, 1, 0, _plane, 3, planar=True),
    "EDGE2": Tag(Kind.EDGE, 2, 0, _plane, 3, _TORO_PLANE, planar=True),
}

LANDMARKS = (
    "VERTEX_TRACKXYZ",
    "VERTEX_XY",
    "VERTEX_XYZ",
    "VERTEX_POINT_XY",
    "VERTEX_POINT_XYZ",
    "VERTEX_LINE2D",
)
"""Vertices that are no poses."""

LEFT_OUT = {
    **dict.fromkeys(LANDMARKS, "landmarks"),
    **dict.fromkeys(
        (
            "EDGE_SE3_TRACKXYZ", "EDGE_SE3_LOTSOF_XYZ", "EDGE_SE2_XY", "EDGE_SE2_LOTSOFXY",
            "EDGE_SE2_XY_CALIB", "EDGE_BEARING_SE2_XY", "EDGE_SE2_POINTXY_OFFSET", "EDGE_SE2_TWOPOINTSXY",
            "EDGE_PROJECT_DISPARITY", "EDGE_PROJECT_DEPTH", "EDGE_POINTXYZ", "EDGE_POINTXY",
            "EDGE_POINTXYZ_PRIOR", "EDGE_PRIOR_XY",
            "LANDMARK", "LANDMARK2", "BR",
        ),
        "measurements of landmarks",
    ),
    **dict.fromkeys(("EDGE_SE3_XYZ_PRIOR", "EDGE_PRIOR_SE2_XY"), "measured positions"),
    **dict.fromkeys(("PARAMS_CAMERACALIB", "PARAMS_STEREOCAMERACALIB"), "cameras"),
    **dict.fromkeys(
        ("ROBOTLASER1", "ROBOTLASER_DATA", "FLASER", "RAWLASER1", "VERTEX_TAG", "VERTEX_ELLIPSE", "TAG"),
        "sensor data",
    ),
    "EQUIV": "equivalences (TORO has them for its tree; what ties their vertices is an edge of its own)",
}  # fmt: skip
"""Tags that stand beside a pose graph and are not part of it, with what they are."""


def split(tag: str, words: Sequence[str]) -> tuple[Sequence[str], str | None]:
    """The fields of a line, and the first of the words that follow them.

    Raises `PoseGraphError` for a number too few or too many.
    """
    form = TAGS[tag]
    fewest = form.ids + form.offsets + form.poses
    whole = fewest + len(form.information)
    numeric = next((place for place, word in enumerate(words) if not is_number(word)), len(words))
    trailing = numeric in (fewest, whole) and not any(
        is_number(word) or word in TAGS or word in LEFT_OUT for word in words[numeric:]
    )
    count = numeric if trailing else len(words)
    if count not in (fewest, whole):
        raise PoseGraphError(
            f"{form.kind.value} {_has(tag)}, not {count} fields{_advice(form, fewest, count)}"
        )
    return words[:count], words[count] if count < len(words) else None


def _has(tag: str) -> str:
    form = TAGS[tag]
    parts = ["an id" if form.ids == 1 else "two ids"]
    parts += [f"the id of {'an offset' if form.offsets == 1 else 'two offsets'}"] if form.offsets else []
    parts += [f"{form.poses} numbers"]
    parts += [f"{len(form.information)} of information"] if form.information else []
    return f"has {', '.join(parts[:-1])} and {parts[-1]} after {tag}"


def _advice(form: Tag, fewest: int, count: int) -> str:
    size = 3 if form.planar else 6
    if form.information and count == fewest + size * size:
        return "; of the information only the upper triangle is written, row by row"
    if form.offsets and count == fewest - form.offsets + len(form.information):
        return "; older g2o wrote no ids of offsets here: put them in, after those of the vertices"
    if count > fewest + len(form.information):
        return "; put a # before what does not belong to it"
    return ""
