"""What an import has left out, as a file that can be looked at and imported again."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from .. import files
from .import_stream import RefusedMeasurement
from .pose_graph import Edge, Transform, counted, writer


def write_refused(
    path: Path, source: str, refused: Sequence[RefusedMeasurement], estimates: dict[int, Transform]
) -> None:
    """Writes each refused measurement with its reason as a comment, and the vertices that it names at their
    estimates, one of each piece held. The file is there whole or not at all.
    """
    count = counted(len(refused), "measurement")
    lines = [
        f"# {count} of {_in_a_line(source)}, left out by pdn import, the farthest first.",
        "# The vertices stand where the import without them has put them.",
    ]
    lines += [writer.vertex(id, estimates[id]) for id in sorted(_named(refused)) if id in estimates]
    lines += [writer.fix(id) for id in _lowest_of_pieces(refused)]
    if any(not isinstance(one.measurement, Edge) for one in refused):
        lines.append(writer.IDENTITY_OFFSET)
    for one in refused:
        lines.append(f"# {_in_a_line(str(one))}")
        measured = one.measurement
        if isinstance(measured, Edge):
            lines.append(writer.edge(measured.from_, measured.to, measured.relative, measured.covariance))
        else:
            lines.append(writer.prior(measured.keyframe, measured.pose, measured.covariance))
    files.write_text(path, "\n".join(lines) + "\n")


def _named(refused: Sequence[RefusedMeasurement]) -> set[int]:
    edges = [one.measurement for one in refused if isinstance(one.measurement, Edge)]
    return {end for edge in edges for end in (edge.from_, edge.to)}


def _lowest_of_pieces(refused: Sequence[RefusedMeasurement]) -> list[int]:
    """The lowest vertex of each piece that the refused edges make."""
    lowest = {id: id for id in _named(refused)}

    def root(id: int) -> int:
        while lowest[id] != id:
            lowest[id] = id = lowest[lowest[id]]
        return id

    for one in refused:
        if isinstance(one.measurement, Edge):
            low, high = sorted((root(one.measurement.from_), root(one.measurement.to)))
            lowest[high] = low
    return sorted({root(id) for id in lowest})


def _in_a_line(text: str) -> str:
    return " ".join(text.split())
