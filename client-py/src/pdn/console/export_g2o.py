"""A journal as a pose graph in g2o text form, in the convention that `pdn import` reads."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from .. import files
from .journal_file import Journal
from .pose_graph import Transform, writer


def write_g2o(journal: Journal, path: Path) -> tuple[int, int]:
    """Writes vertices at their estimates, FIX for the one that holds the others to the world, and an edge for
    each odometry and relative factor; returns how many vertices and edges.

    Numbers have all the digits that they need to be read back the same. Further prior factors are
    EDGE_SE3_PRIOR, which g2o and `pdn import` read and GTSAM passes over. Attitude, depth, position and
    camera factors have no place in the format and are left out; comments at the top count them.
    """
    keyframes = journal.graph["keyframes"]
    known = {keyframe["id"] for keyframe in keyframes}
    anchor = _anchor(journal, known)
    edges: list[str] = []
    priors: list[str] = []
    left_out: Counter[str] = Counter()
    for kind, factor in _factors(journal):
        match kind:
            case "odometry" | "relative":
                if {factor["from"], factor["to"]} <= known:
                    measured = _pose(factor["relative"]), _covariance(factor)
                    edges.append(writer.edge(factor["from"], factor["to"], *measured))
            case "prior":
                if factor["keyframe"] in known and factor["keyframe"] != anchor:
                    priors.append(
                        writer.prior(factor["keyframe"], _pose(factor["pose"]), _covariance(factor))
                    )
            case _:
                left_out[kind] += 1
    lines = [f"# {count} {kind} factors have no place here" for kind, count in sorted(left_out.items())]
    lines += [writer.IDENTITY_OFFSET] if priors else []
    lines += [writer.vertex(keyframe["id"], _pose(keyframe["pose"])) for keyframe in keyframes]
    lines += [] if anchor is None else [writer.fix(anchor)]
    files.write_text(path, "\n".join(lines + priors + edges) + "\n")
    return len(keyframes), len(edges)


def _anchor(journal: Journal, known: set[int]) -> int | None:
    """The keyframe that holds the others: the first, if the mission was configured so, else that of the first
    prior.
    """
    if journal.configured["config"]["first_keyframe_sigmas"] is not None:
        ids = [record.content["id"] for record in journal.of("keyframe")]
    else:
        ids = [factor["keyframe"] for kind, factor in _factors(journal) if kind == "prior"]
    return next((id for id in ids if id in known), None)


def _factors(journal: Journal) -> list[tuple[str, Any]]:
    return [next(iter(record.content["factor"].items())) for record in journal.of("factor")]


def _covariance(factor: Any) -> Any:
    return np.array(factor["covariance"], dtype=float).reshape(6, 6)


def _pose(pose: Any) -> Transform:
    x, y, z = pose["translation"]
    qx, qy, qz, qw = pose["rotation"]
    return Transform((x, y, z), (qx, qy, qz, qw))
