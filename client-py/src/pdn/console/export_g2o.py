"""A journal as a pose graph in g2o text form, in the convention that `pdn import-g2o` reads."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .journal_file import Journal


def write_g2o(journal: Journal, path: Path) -> tuple[int, int]:
    """Writes vertices at their estimates and an edge for each odometry and relative factor; returns how many.

    Attitude, depth, position, prior and camera factors have no place in the format and are left out.
    """
    lines = []
    for keyframe in journal.graph["keyframes"]:
        pose = [*keyframe["pose"]["translation"], *keyframe["pose"]["rotation"]]
        lines.append(f"VERTEX_SE3:QUAT {keyframe['id']} {_text(pose)}")
    vertices = len(lines)
    known = {keyframe["id"] for keyframe in journal.graph["keyframes"]}
    upper = np.triu_indices(6)
    for record in journal.of("factor"):
        ((kind, factor),) = record.content["factor"].items()
        if kind not in ("odometry", "relative") or not {factor["from"], factor["to"]} <= known:
            continue
        information = np.linalg.inv(np.array(factor["covariance"], dtype=float).reshape(6, 6))
        relative = [*factor["relative"]["translation"], *factor["relative"]["rotation"]]
        ends = f"{factor['from']} {factor['to']}"
        lines.append(f"EDGE_SE3:QUAT {ends} {_text(relative)} {_text(information[upper])}")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return vertices, len(lines) - vertices


def _text(numbers: object) -> str:
    return " ".join(repr(float(number)) for number in np.asarray(numbers, dtype=float))
