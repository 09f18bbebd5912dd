"""A pose-graph file as a graph that can be streamed, with a sentence for whatever was left out or assumed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from . import fields, information
from .assembly import assemble
from .graph import PoseGraph, PoseGraphError
from .lines import lines_in
from .records import Assumptions, AtLine, Measured, Records
from .tags import LANDMARKS, LEFT_OUT, OTHER_ORDER, TAGS, Kind, Tag, split
from .transform import Matrix

NAME_CHARS = 120
"""Of a file's path an error shows the last characters."""


def read_pose_graph(data: bytes, name: str, assumptions: Assumptions | None = None) -> PoseGraph:
    """Reads g2o or TORO; raises `PoseGraphError` with file and line for anything that cannot be streamed.

    Taken exactly: poses in any of the forms of `TAGS`, offsets, priors, FIX, any order of lines. Left out,
    and told in `notes`: landmarks, vertices without edges, words after the numbers. Refused: unknown tags,
    wrong counts of numbers, values that are not finite, information that is not positive definite, components
    that nothing holds.
    """
    assumptions = assumptions or Assumptions()
    reader = _Reader(assumptions)
    shown = name if len(name) <= NAME_CHARS else f"...{name[-NAME_CHARS:]}"
    number = 1
    try:
        for number, words in lines_in(data):
            reader.take(number, words)
        return assemble(reader.records, assumptions)
    except AtLine as error:
        raise PoseGraphError(f"{shown}:{error.line}: {error}") from None
    except PoseGraphError as error:
        raise PoseGraphError(f"{shown}:{number}: {error}") from None


@dataclass
class _Reader:
    assumptions: Assumptions
    records: Records = field(default_factory=Records)
    inverses: dict[tuple[float, ...], tuple[Matrix, bool]] = field(default_factory=dict)
    space: tuple[str, int] | None = None
    plane: tuple[str, int] | None = None

    def take(self, line: int, words: Sequence[str]) -> None:
        """Takes in a line."""
        self.records.last_line = line
        tag, *rest = words
        if tag == "FIX":
            if not rest:
                raise PoseGraphError("FIX names no vertex")
            for word in rest:
                self.records.fixed.setdefault(fields.vertex_id(word), line)
        elif tag in LEFT_OUT:
            self.records.left_out[LEFT_OUT[tag]] += 1
            if tag in LANDMARKS and rest:
                self.records.landmarks.add(rest[0])
        elif tag in TAGS:
            self._demand_one_space(tag, line)
            taken, extra = split(tag, rest)
            if extra is not None:
                self.records.trailing.append((line, extra))
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
                if ids[0] in self.records.vertices:
                    raise PoseGraphError(f"vertex {ids[0]} comes twice")
                self.records.vertices[ids[0]] = pose
            case Kind.OFFSET:
                if ids[0] in self.records.offsets:
                    raise PoseGraphError(f"offset {ids[0]} comes twice")
                self.records.offsets[ids[0]] = pose
            case Kind.EDGE | Kind.PRIOR:
                ends = ids[: form.ids]
                if len(ends) == 2 and ends[0] == ends[1]:
                    raise PoseGraphError(f"the edge ties vertex {ends[0]} to itself")
                covariance = self._covariance(form, numbers[form.poses :])
                self.records.measured.append(Measured(line, ends, ids[form.ids :], pose, covariance))

    def _covariance(self, form: Tag, numbers: Sequence[float]) -> Matrix:
        if numbers:
            upper = tuple(numbers[place] for place in form.information)
            if upper not in self.inverses:  # Most graphs have the same for all edges.
                self.inverses[upper] = information.covariance(upper, mend=self.assumptions.mend_information)
            covariance, mended = self.inverses[upper]
            self.records.mended += mended
        elif self.assumptions.default_sigmas is None:
            raise PoseGraphError(
                f"{form.kind.value} without information; say how sure such are with --default-sigmas M,RAD"
            )
        else:
            covariance = information.diagonal(self.assumptions.default_sigmas, 3 if form.planar else 6)
            self.records.defaulted += 1
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
            self.records.planar = True
        else:
            self.space = self.space or (tag, line)
        if self.plane and self.space:
            (other, before), _ = sorted((self.plane, self.space), key=lambda first: first[1])
            raise PoseGraphError(
                f"{tag} after {other} (line {before}): a file is in the plane or in space, not in both"
            )
