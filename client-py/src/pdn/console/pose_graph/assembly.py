"""From what the lines of a file say to a graph: offsets looked up, anchors found, loose ends told."""

from __future__ import annotations

from . import components, notes
from .graph import Edge, PoseGraph, Prior, counted
from .records import Assumptions, AtLine, Measured, Records
from .transform import ORIGIN, Matrix, Transform


def assemble(records: Records, assumptions: Assumptions) -> PoseGraph:
    """The graph of all lines; raises `AtLine`."""
    edges: list[Edge] = []
    priors: list[Prior] = []
    for measured in records.measured:
        pose, covariance = _without_offsets(records, measured)
        match measured.ends:
            case [from_, to]:
                edges.append(Edge(measured.line, from_, to, pose, covariance))
            case [keyframe]:
                priors.append(Prior(measured.line, keyframe, pose, covariance))
    if not edges and not priors:
        raise AtLine(records.last_line, f"the file ends here, and there is no edge in it{_instead(records)}")
    named = {end for measured in records.measured for end in measured.ends}
    told = notes.of(records, named, assumptions)
    fixed = _fixed(records, named, told)
    if not fixed and not priors:
        fixed = [min(named)]
    anchored = {*fixed, *(prior.keyframe for prior in priors)}
    unanchored = components.unanchored(edges, anchored)
    if unanchored is not None:
        raise AtLine(unanchored.line, unanchored.told(min(anchored)))
    anchors = {vertex: _anchor_pose(records, vertex, len(fixed), told) for vertex in fixed}
    vertices = {vertex: pose for vertex, pose in records.vertices.items() if vertex in named}
    return PoseGraph(vertices, edges, priors, anchors, records.planar, told)


def _without_offsets(records: Records, measured: Measured) -> tuple[Transform, Matrix]:
    """The measurement of the vertices themselves: E = Z^-1 (X_i P_i)^-1 X_j P_j is P_j^-1 E' P_j with
    E' = (P_i Z P_j^-1)^-1 X_i^-1 X_j.
    """
    offsets = []
    for offset in measured.offsets:
        if offset not in records.offsets:
            raise AtLine(
                measured.line,
                f"offset {offset} is not in the file; if it is none, add: "
                f"{'PARAMS_SE2OFFSET' if records.planar else 'PARAMS_SE3OFFSET'} {offset}"
                f"{' 0 0 0' if records.planar else ' 0 0 0 0 0 0 1'}",
            )
        offsets.append(records.offsets[offset])
    if all(offset == ORIGIN for offset in offsets):
        return measured.pose, measured.covariance
    pose = measured.pose @ offsets[-1].inverse()
    if len(offsets) == 2:
        pose = offsets[0] @ pose
    return pose, offsets[-1].moved_covariance(measured.covariance)


def _fixed(records: Records, named: set[int], told: list[str]) -> list[int]:
    """The vertices that FIX holds and that are in the graph."""
    anchors = []
    for vertex, line in sorted(records.fixed.items()):
        if vertex in named:
            anchors.append(vertex)
        elif vertex not in records.vertices and str(vertex) not in records.landmarks:
            raise AtLine(line, f"FIX names vertex {vertex}, which is not in the file")
    if anchors != sorted(records.fixed):
        told.append("FIX of what is left out is left out as well")
    if anchors and anchors != [min(named)]:
        but = "" if min(named) in anchors else f", not the lowest id, {min(named)}"
        told.append(f"FIX holds {notes.listed(anchors)}{but}")
    return anchors


def _anchor_pose(records: Records, vertex: int, fixed: int, told: list[str]) -> Transform:
    if vertex in records.vertices:
        return records.vertices[vertex]
    if fixed > 1:
        raise AtLine(
            records.fixed[vertex],
            f"FIX holds vertex {vertex}, whose pose the file does not have; add its VERTEX",
        )
    told.append(f"vertex {vertex} is held at the origin, for the file has no pose of it")
    return ORIGIN


def _instead(records: Records) -> str:
    if records.left_out:
        lines = sorted(records.left_out.items())
        return f"; there are {', '.join(f'{count} of {what}' for what, count in lines)}"
    return f"; there are {counted(len(records.vertices), 'vertex', 'vertices')}" if records.vertices else ""
