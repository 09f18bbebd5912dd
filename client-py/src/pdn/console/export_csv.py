"""A journal as tables: one file a kind, units in the headers."""

from __future__ import annotations

import csv
from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from pdn import files

from .journal_file import Journal, Json, Record

POSE = ["n_m", "e_m", "d_m", "qx", "qy", "qz", "qw"]
SIGMAS = ["sigma_x_m", "sigma_y_m", "sigma_z_m", "sigma_roll_rad", "sigma_pitch_rad", "sigma_yaw_rad"]


def write_csv(journal: Journal, folder: Path) -> list[Path]:
    """Writes the tables into a folder and returns their paths; raises `files.FileNotWritten`.

    No table takes its place before all are on the disk, so that a folder does not hold tables of two missions
    when one cannot be written.
    """
    files.make_folder(folder)
    tables = {
        "keyframes": (["keyframe", "seq", "stamp_ns", *POSE, *SIGMAS], _keyframes(journal)),
        "factors": (["seq", "stamp_ns", "kind", "from", "to"], _factors(journal)),
        "links": (["seq", "stamp_ns", "from", "to", "registered"], _links(journal)),
        "decisions": (
            [
                "decision",
                "graph_seq",
                "action",
                "keyframe",
                "exploring_uncertainty",
                "alpha",
                "candidates",
                "complete",
                "total_ms",
                "reason",
            ],
            _decisions(journal),
        ),
        "candidates": (
            [
                "decision",
                "candidate",
                "keyframe",
                "one_way_m",
                "nodes",
                "uncertainty",
                "uncertainty_all_links",
                "uncertainty_no_links",
                "peak_uncertainty",
                "redundant_m2",
                "area",
                "penalty",
                "reward",
                "break_even_alpha",
            ],
            _candidates(journal),
        ),
        "commands": (["record", "at_ns", "command", "reason"], _commands(journal)),
    }
    paths = {name: folder / f"{name}.csv" for name in tables}
    with ExitStack() as together:
        for name, (header, rows) in tables.items():
            file = together.enter_context(files.replacing(paths[name], newline=""))
            writer = csv.writer(file)
            writer.writerow(header)
            writer.writerows(rows)
            files.sync(file)
    return list(paths.values())


def _keyframes(journal: Journal) -> Iterable[list[Any]]:
    told = {record.content["id"]: record for record in journal.of("keyframe")}
    for keyframe in journal.graph["keyframes"]:
        record = told[keyframe["id"]]
        pose, covariance = keyframe["pose"], keyframe["covariance"]
        sigmas = [""] * 6 if covariance is None else [covariance[7 * axis] ** 0.5 for axis in range(6)]
        seq, stamp_ns = record.content["seq"], record.content["stamp_ns"]
        yield [keyframe["id"], seq, stamp_ns, *pose["translation"], *pose["rotation"], *sigmas]


def _factors(journal: Journal) -> Iterable[list[Any]]:
    for record in journal.of("factor"):
        ((kind, factor),) = record.content["factor"].items()
        ends = [factor.get("from", factor.get("keyframe")), factor.get("to", "")]
        yield [record.content["seq"], record.content["stamp_ns"], kind, *ends]


def _links(journal: Journal) -> Iterable[list[Any]]:
    for record in journal.of("link"):
        content = record.content
        yield [content[name] for name in ("seq", "stamp_ns", "from", "to", "registered")]


def decisions(journal: Journal) -> list[tuple[Record, Json]]:
    """Every decision with its record."""
    return [(record, record.content["decision"]) for record in journal.of("decided")]


def _decisions(journal: Journal) -> Iterable[list[Any]]:
    for _, decision in decisions(journal):
        ((action, target),) = decision["action"].items()
        yield [
            decision["decision"],
            decision["graph_seq"],
            action,
            target.get("keyframe", ""),
            decision["exploration"]["uncertainty"],
            decision["alpha"],
            len(decision["candidates"]),
            decision["complete"],
            decision["timing"]["total_ms"],
            decision["reason"],
        ]


def _candidates(journal: Journal) -> Iterable[list[Any]]:
    for _, decision in decisions(journal):
        for candidate in decision["candidates"]:
            names = ["candidate", "keyframe", "one_way_m", "nodes", "uncertainty", "uncertainty_all_links"]
            names += ["uncertainty_no_links", "peak_uncertainty", "redundant_m2", "area", "penalty", "reward"]
            row = [candidate.get(name) for name in [*names, "break_even_alpha"]]
            yield [decision["decision"], *("" if value is None else value for value in row)]


def _commands(journal: Journal) -> Iterable[list[Any]]:
    for record in journal.of("configured", "command", "reopened"):
        content = record.content
        command = content.get("operation", "configure" if record.kind == "configured" else "restart of pdnd")
        yield [record.number, content["at_ns"], command, content.get("reason", "")]
