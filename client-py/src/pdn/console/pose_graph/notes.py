"""Sentences about what of a file was left out or assumed."""

from __future__ import annotations

from . import fields
from .graph import counted
from .records import Assumptions, Records


def of(records: Records, named: set[int], assumptions: Assumptions) -> list[str]:
    """What was left out or assumed, a sentence each; `named` are the vertices of measurements."""
    notes = []
    if records.left_out:
        lines = sorted(records.left_out.items())
        told = ", ".join(f"{counted(count, 'line')} of {what}" for what, count in lines)
        notes.append(f"left out: {told}; only poses are imported")
    without = sorted(records.vertices.keys() - named)
    if without:
        notes.append(f"left out: {listed(without)} without an edge")
    unseen = sorted(named - records.vertices.keys())
    if unseen and records.vertices:
        line = next(measured.line for measured in records.measured if unseen[0] in measured.ends)
        notes.append(
            f"{listed(unseen)} without a VERTEX line, named by an edge (line {line}): taken, "
            "initialised from the edges as all are"
        )
    elif unseen:
        notes.append("the file has edges only: every vertex is initialised from them, as always")
    if records.trailing:
        line, word = records.trailing[0]
        notes.append(
            f"left out: words after the numbers of {counted(len(records.trailing), 'line')}, "
            f"the first {fields.shown(word)} in line {line}"
        )
    return notes + _assumed(records, assumptions)


def _assumed(records: Records, assumptions: Assumptions) -> list[str]:
    notes = []
    if records.planar:
        metres, radians = assumptions.plane_sigmas
        notes.append(
            f"the graph is in the plane: each measurement says as well that z stays (sigma {metres:g} "
            f"m) and roll and pitch (sigma {radians:g} rad)"
        )
    if records.defaulted:
        metres, radians = assumptions.default_sigmas or (0.0, 0.0)
        count = counted(records.defaulted, "measurement")
        notes.append(f"{count} without information: taken with sigmas of {metres:g} m and {radians:g} rad")
    if records.mended:
        count = counted(records.mended, "measurement")
        notes.append(f"mended the information of {count}, which rounding had made indefinite")
    return notes


def listed(vertices: list[int]) -> str:
    """Vertices by id, not all of many."""
    if len(vertices) == 1:
        return f"vertex {vertices[0]}"
    first = ", ".join(str(vertex) for vertex in vertices[:3])
    return f"{len(vertices)} vertices ({first}{', ...' if len(vertices) > 3 else ''})"
