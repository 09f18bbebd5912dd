"""A pose-graph file as a graph that can be streamed, with a sentence for whatever was left out or assumed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

from . import components, fields, information
from .graph import Edge, PoseGraph, PoseGraphError, Prior, counted
from .lines import lines_in
from .tags import LANDMARKS, LEFT_OUT, OTHER_ORDER, TAGS, Kind, Tag, split
from .transform import ORIGIN, Matrix, Transform

NAME_CHARS = 120
"""Of a file's path an error shows the last characters."""


@dataclass(frozen=True, slots=True)
class Assumptions:
    """What the reader of a file may assume where the file says nothing."""

    default_sigmas: tuple[float, float] | None = None
    """Of a measurement without information, m and rad; None refuses it."""
    plane_sigmas: tuple[float, float] = (0.01, 0.01)
    """Of z (m), and of roll and pitch (rad), of a measurement in the plane."""
    mend_information: bool = False
    """Whether information that six digits have made indefinite is mended."""


def read_pose_graph(data: bytes, name: str, assumptions: Assumptions | None = None) -> PoseGraph:
    """Reads g2o or TORO; raises `PoseGraphError` with file and line for anything that cannot be streamed.

    Taken exactly: poses in any of the forms of `TAGS`, offsets, priors, FIX, any order of lines. Left out,
    and told in `notes`: landmarks, vertices without edges, words after the numbers. Refused: unknown tags,
    wrong counts of numbers, values that are not finite, information that is not positive definite, components
    that nothing holds.
    """
    reader = _Reader(assumptions or Assumptions())
    shown = name if len(name) <= NAME_CHARS else f"...{name[-NAME_CHARS:]}"
    number = 1
    try:
        for number, words in lines_in(data):
            reader.take(number, words)
        return reader.graph()
    except _AtLine as error:
        raise PoseGraphError(f"{shown}:{error.line}: {error}") from None
    except PoseGraphError as error:
        raise PoseGraphError(f"{shown}:{number}: {error}") from None


class _AtLine(PoseGraphError):
    def __init__(self, line: int, message: str) -> None:
        super().__init__(message)
        self.line = line


@dataclass(frozen=True, slots=True)
class _Measured:
    """A measurement whose offsets are not yet looked up: of `ends[1]` in `ends[0]`, or of `ends[0]` in the
    world.
    """

    line: int
    ends: list[int]
    offsets: list[int]
    pose: Transform
    covariance: Matrix


@dataclass
class _Reader:
    assumptions: Assumptions
    vertices: dict[int, Transform] = field(default_factory=dict)
    measured: list[_Measured] = field(default_factory=list)
    offsets: dict[int, Transform] = field(default_factory=dict)
    fixed: dict[int, int] = field(default_factory=dict)
    landmarks: set[str] = field(default_factory=set)
    left_out: Counter[str] = field(default_factory=Counter)
    assumed: Counter[str] = field(default_factory=Counter)
    inverses: dict[tuple[float, ...], tuple[Matrix, bool]] = field(default_factory=dict)
    trailing: list[tuple[int, str]] = field(default_factory=list)
    space: tuple[str, int] | None = None
    plane: tuple[str, int] | None = None
    last_line: int = 1

    def take(self, line: int, words: Sequence[str]) -> None:
        """Takes in a line."""
        self.last_line = line
        tag, *rest = words
        if tag == "FIX":
            if not rest:
                raise PoseGraphError("FIX names no vertex")
            for word in rest:
                self.fixed.setdefault(fields.vertex_id(word), line)
        elif tag in LEFT_OUT:
            self.left_out[LEFT_OUT[tag]] += 1
            if tag in LANDMARKS and rest:
                self.landmarks.add(rest[0])
        elif tag in TAGS:
            self._demand_one_space(tag, line)
            taken, extra = split(tag, rest)
            if extra is not None:
                self.trailing.append((line, extra))
            try:
                self._tell(TAGS[tag], line, taken)
            except information.NotPositiveDefinite as error:
                raise PoseGraphError(f"{error}{self._other_order(tag, taken)}") from None
        else:
            known = ", ".join([*TAGS, "FIX"])
            raise PoseGraphError(f"unknown tag {fields.shown(tag)}; known are {known}, and landmarks")

    def _tell(self, form: Tag, line: int, words: Sequence[str]) -> None:
        ids = [fields.vertex_id(word) for word in words[: form.ids + form.offsets]]
        numbers = fields.numbers(words[len(ids) :])
        pose = form.pose(numbers[: form.poses])
        match form.kind:
            case Kind.VERTEX:
                if ids[0] in self.vertices:
                    raise PoseGraphError(f"vertex {ids[0]} comes twice")
                self.vertices[ids[0]] = pose
            case Kind.OFFSET:
                if ids[0] in self.offsets:
                    raise PoseGraphError(f"offset {ids[0]} comes twice")
                self.offsets[ids[0]] = pose
            case Kind.EDGE | Kind.PRIOR:
                ends = ids[: form.ids]
                if len(ends) == 2 and ends[0] == ends[1]:
                    raise PoseGraphError(f"the edge ties vertex {ends[0]} to itself")
                covariance = self._covariance(form, numbers[form.poses :])
                self.measured.append(_Measured(line, ends, ids[form.ids :], pose, covariance))

    def _covariance(self, form: Tag, numbers: Sequence[float]) -> Matrix:
        if numbers:
            upper = tuple(numbers[place] for place in form.information)
            if upper not in self.inverses:  # Most graphs have the same for all edges.
                self.inverses[upper] = information.covariance(upper, mend=self.assumptions.mend_information)
            covariance, mended = self.inverses[upper]
            self.assumed["mended"] += mended
        elif self.assumptions.default_sigmas is None:
            raise PoseGraphError(
                f"{form.kind.value} without information; say how sure such are with --default-sigmas M,RAD"
            )
        else:
            covariance = information.diagonal(self.assumptions.default_sigmas, 3 if form.planar else 6)
            self.assumed["default"] += 1
        return information.lifted(covariance, self.assumptions.plane_sigmas) if form.planar else covariance

    def _other_order(self, tag: str, words: Sequence[str]) -> str:
        """Whether the information could be meant in the other order of two."""
        if tag not in OTHER_ORDER:
            return ""
        other = TAGS[OTHER_ORDER[tag]]
        numbers = fields.numbers(words[-len(other.information) :])
        try:
            information.covariance([numbers[place] for place in other.information])
        except PoseGraphError:
            return ""
        return (
            f". In the order of {OTHER_ORDER[tag]} it would be: if the file means that, change the tag to it"
        )

    def _demand_one_space(self, tag: str, line: int) -> None:
        if TAGS[tag].planar:
            self.plane = self.plane or (tag, line)
        else:
            self.space = self.space or (tag, line)
        if self.plane and self.space:
            (other, before), _ = sorted((self.plane, self.space), key=lambda first: first[1])
            raise PoseGraphError(
                f"{tag} after {other} (line {before}): a file is in the plane or in space, not in both"
            )

    def graph(self) -> PoseGraph:
        """The graph of all lines."""
        edges: list[Edge] = []
        priors: list[Prior] = []
        for measured in self.measured:
            pose, covariance = self._without_offsets(measured)
            match measured.ends:
                case [from_, to]:
                    edges.append(Edge(measured.line, from_, to, pose, covariance))
                case [keyframe]:
                    priors.append(Prior(measured.line, keyframe, pose, covariance))
        if not edges and not priors:
            raise _AtLine(self.last_line, f"the file ends here, and there is no edge in it{self._instead()}")
        named = {end for measured in self.measured for end in measured.ends}
        notes = self._notes(named)
        fixed = self._fixed(named, notes)
        if not fixed and not priors:
            fixed = [min(named)]
        anchored = {*fixed, *(prior.keyframe for prior in priors)}
        unanchored = components.unanchored(edges, anchored)
        if unanchored is not None:
            raise _AtLine(unanchored.line, unanchored.told(min(anchored)))
        anchors = {vertex: self._anchor_pose(vertex, len(fixed), notes) for vertex in fixed}
        vertices = {vertex: pose for vertex, pose in self.vertices.items() if vertex in named}
        return PoseGraph(vertices, edges, priors, anchors, self.plane is not None, notes)

    def _instead(self) -> str:
        if self.left_out:
            lines = sorted(self.left_out.items())
            return f"; there are {', '.join(f'{count} of {what}' for what, count in lines)}"
        return f"; there are {counted(len(self.vertices), 'vertex', 'vertices')}" if self.vertices else ""

    def _without_offsets(self, measured: _Measured) -> tuple[Transform, Matrix]:
        """The measurement of the vertices themselves: E = Z^-1 (X_i P_i)^-1 X_j P_j is P_j^-1 E' P_j with
        E' = (P_i Z P_j^-1)^-1 X_i^-1 X_j.
        """
        offsets = []
        for offset in measured.offsets:
            if offset not in self.offsets:
                raise _AtLine(
                    measured.line,
                    f"offset {offset} is not in the file; if it is none, add: "
                    f"{'PARAMS_SE2OFFSET' if self.plane else 'PARAMS_SE3OFFSET'} {offset}"
                    f"{' 0 0 0' if self.plane else ' 0 0 0 0 0 0 1'}",
                )
            offsets.append(self.offsets[offset])
        if all(offset == ORIGIN for offset in offsets):
            return measured.pose, measured.covariance
        pose = measured.pose @ offsets[-1].inverse()
        if len(offsets) == 2:
            pose = offsets[0] @ pose
        return pose, offsets[-1].moved_covariance(measured.covariance)

    def _fixed(self, named: set[int], notes: list[str]) -> list[int]:
        """The vertices that FIX holds and that are in the graph."""
        anchors = []
        for vertex, line in sorted(self.fixed.items()):
            if vertex in named:
                anchors.append(vertex)
            elif vertex not in self.vertices and str(vertex) not in self.landmarks:
                raise _AtLine(line, f"FIX names vertex {vertex}, which is not in the file")
        if anchors != sorted(self.fixed) and anchors:
            notes.append("FIX of what is left out is left out as well")
        if anchors and anchors != [min(named)]:
            notes.append(f"FIX holds {_listed('vertex', anchors)}, not the lowest id, {min(named)}")
        return anchors

    def _anchor_pose(self, vertex: int, fixed: int, notes: list[str]) -> Transform:
        if vertex in self.vertices:
            return self.vertices[vertex]
        if fixed > 1:
            raise _AtLine(
                self.fixed[vertex],
                f"FIX holds vertex {vertex}, whose pose the file does not have; add its VERTEX",
            )
        notes.append(f"vertex {vertex} is held at the origin, for the file has no pose of it")
        return ORIGIN

    def _notes(self, named: set[int]) -> list[str]:
        notes = []
        if self.left_out:
            lines = sorted(self.left_out.items())
            told = ", ".join(f"{counted(count, 'line')} of {what}" for what, count in lines)
            notes.append(f"left out: {told}; only poses are imported")
        without = sorted(self.vertices.keys() - named)
        if without:
            notes.append(f"left out: {_listed('vertex', without)} without an edge")
        unseen = sorted(named - self.vertices.keys())
        if unseen and self.vertices:
            line = next(measured.line for measured in self.measured if unseen[0] in measured.ends)
            notes.append(
                f"{_listed('vertex', unseen)} without a VERTEX line, named by an edge (line {line}): taken, "
                "initialised from the edges as all are"
            )
        elif unseen:
            notes.append("the file has edges only: every vertex is initialised from them, as always")
        if self.trailing:
            line, word = self.trailing[0]
            notes.append(
                f"left out: words after the numbers of {counted(len(self.trailing), 'line')}, "
                f"the first {fields.shown(word)} in line {line}"
            )
        return notes + self._assumed()

    def _assumed(self) -> list[str]:
        notes = []
        if self.plane:
            metres, radians = self.assumptions.plane_sigmas
            notes.append(
                f"the graph is in the plane: each measurement says as well that z stays (sigma {metres:g} "
                f"m) and roll and pitch (sigma {radians:g} rad)"
            )
        if self.assumed["default"]:
            metres, radians = self.assumptions.default_sigmas or (0.0, 0.0)
            count = counted(self.assumed["default"], "measurement")
            notes.append(
                f"{count} without information: taken with sigmas of {metres:g} m and {radians:g} rad"
            )
        if self.assumed["mended"]:
            count = counted(self.assumed["mended"], "measurement")
            notes.append(f"mended the information of {count}, which rounding had made indefinite")
        return notes


def _listed(what: str, ids: list[int]) -> str:
    if len(ids) == 1:
        return f"{what} {ids[0]}"
    plural = {"vertex": "vertices"}[what]
    first = ", ".join(str(one) for one in ids[:3])
    return f"{len(ids)} {plural} ({first}{', ...' if len(ids) > 3 else ''})"
