"""The nominal survey over a surface, and ways across it at a constant standoff."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from pdn.sim.scenario import Scenario, ScenarioError
from pdn.sim.se3 import Array, wrap_rad
from pdn.sim.surface import Facet


@dataclass(frozen=True)
class Viewpoint:
    """A place where a keyframe is to be taken, in the world as the vehicle believes it to be."""

    position: Array
    """3, m."""
    heading_rad: float
    stride_m: float
    """Farthest that the vehicle goes towards it between two keyframes."""


@dataclass(frozen=True)
class SurveyPoint:
    """A keyframe of the nominal survey."""

    viewpoint: Viewpoint
    line: int
    """Trackline, from 0; on the way between two lines that of the line left."""
    number_on_line: int | None
    """From 0 at the beginning of the trackline; null on the way between two."""
    ends_line: bool
    """Whether this is the last point of its trackline."""


@dataclass(frozen=True)
class _Vertex:
    position: Array
    heading_rad: float


class Survey:
    """A boustrophedon of parallel tracklines; even lines (from 0) run towards growing u, odd ones back."""

    def __init__(self, scenario: Scenario) -> None:
        self._plan = scenario.survey
        self._max_view_angle_rad = scenario.links.max_view_angle_rad
        self._facets = scenario.surface.facets
        plan = scenario.survey
        self.lines_v_m = [plan.first_line_m + plan.line_spacing_m * i for i in range(plan.lines)]
        self.vertices: list[Array] = []
        """The corners of the whole way, m, world."""
        self.points: list[SurveyPoint] = []
        for line, v in enumerate(self.lines_v_m):
            along = self._line(v)
            if line % 2 == 1:
                along.reverse()
            self._extend(along, line, plan.keyframe_spacing_m, on_line=True)
            if line + 1 < plan.lines:
                stride = plan.turn_spacing_m
                over = self._across(self.lines_v_m[line + 1], v, stride, far_end=line % 2 == 0)
                self._extend(over, line, stride, on_line=False)

    def to_first_line(self, line: int) -> list[Viewpoint]:
        """From the end of a trackline straight to the first trackline and back, a keyframe each spacing."""
        stride = self._plan.keyframe_spacing_m
        out = self._across(self.lines_v_m[0], self.lines_v_m[line], stride, far_end=line % 2 == 0)
        back = list(reversed(out))[1:]
        return list(self._sampled(out + back, stride))[1:]

    def _extend(self, vertices: list[_Vertex], line: int, stride: float, *, on_line: bool) -> None:
        if self.points:
            last = self.points[-1].viewpoint
            vertices = [_Vertex(last.position, last.heading_rad), *vertices]
        for vertex in vertices:
            if not self.vertices or float(np.linalg.norm(vertex.position - self.vertices[-1])) > 1e-9:
                self.vertices.append(vertex.position)
        samples = list(self._sampled(vertices, stride))
        for number, viewpoint in enumerate(samples):
            # The beginning of a later line has been reached by the turn.
            if number > 0 or not self.points:
                ends = on_line and number == len(samples) - 1
                self.points.append(SurveyPoint(viewpoint, line, number if on_line else None, ends))

    def _sampled(self, vertices: list[_Vertex], stride: float) -> Iterable[Viewpoint]:
        """Places no farther apart than the stride, each vertex among them."""
        along = self._plan.heading == "along"
        previous = vertices[0]
        first_heading = (
            _direction(vertices[0], vertices[1], previous.heading_rad) if along else previous.heading_rad
        )
        yield Viewpoint(previous.position, first_heading, stride)
        for vertex in vertices[1:]:
            step = vertex.position - previous.position
            length = float(np.linalg.norm(step))
            if length < 1e-9:
                continue
            pieces = max(1, math.ceil(length / stride - 1e-9))
            turn = wrap_rad(vertex.heading_rad - previous.heading_rad)
            for k in range(1, pieces + 1):
                share = k / pieces
                heading = (
                    _direction(previous, vertex, previous.heading_rad)
                    if along
                    else wrap_rad(previous.heading_rad + share * turn)
                )
                yield Viewpoint(previous.position + share * step, heading, stride)
            previous = vertex

    def _line(self, v: float) -> list[_Vertex]:
        """Along a trackline; where two facets meet, the middle of their offset ends."""
        ends = []
        for facet in self._row(v):
            local = facet.local_v_m(v)
            ends.append([self._off(facet, u, local) for u in (0.0, facet.length_u_m)])
        joints = [_middle(left[1], right[0]) for left, right in pairwise(ends)]
        return [ends[0][0], *joints, ends[-1][1]]

    def _across(self, v_to: float, v_from: float, stride: float, *, far_end: bool) -> list[_Vertex]:
        """From one trackline to another at constant u, round the edges of the facets at the standoff.

        The first vertex stands on the line of ``v_from``, the last on that of ``v_to``.
        """
        if v_to < v_from:
            return list(reversed(self._across(v_from, v_to, stride, far_end=far_end)))
        vertices: list[_Vertex] = []
        facet = self._end_facet(v_from, far_end)
        local = facet.local_v_m(v_from)
        vertices.append(self._off(facet, _end_u(facet, far_end), local))
        while v_to >= facet.unwrapped_v_m[1]:
            below = self._end_facet(facet.unwrapped_v_m[1], far_end)
            if float(below.v @ facet.normal) < 0.0:  # Into an inner corner there is nothing to go round.
                vertices.extend(self._round(facet, below, stride, far_end))
            facet = below
        vertices.append(self._off(facet, _end_u(facet, far_end), facet.local_v_m(v_to)))
        return vertices

    def _round(self, above: Facet, below: Facet, stride: float, far_end: bool) -> list[_Vertex]:
        """An arc about the edge that two facets share.

        Its vertices are at most a stride apart, and near enough in angle for successive images to register.
        """
        start = above.point(_end_u(above, far_end), above.length_v_m)
        end = below.point(_end_u(below, far_end), 0.0)
        angle = math.acos(max(-1.0, min(1.0, float(above.normal @ below.normal))))
        steps = max(
            1,
            math.ceil(angle * self._plan.standoff_m / stride),
            math.ceil(angle / self._max_view_angle_rad - 1e-9),
        )
        turn = wrap_rad(_heading(below) - _heading(above))
        arc = []
        for k in range(steps + 1):
            share = k / steps
            normal = _slerp(above.normal, below.normal, angle, share)
            position = start + share * (end - start) + self._plan.standoff_m * normal
            arc.append(_Vertex(position, wrap_rad(_heading(above) + share * turn)))
        return arc

    def _row(self, v: float) -> list[Facet]:
        row = [f for f in self._facets if f.unwrapped_v_m[0] <= v < f.unwrapped_v_m[1]]
        if not row:
            raise ScenarioError(f"no facet lies at v = {v} m of the sheet, where a trackline runs")
        return sorted(row, key=lambda f: f.unwrapped_u_m[0])

    def _end_facet(self, v: float, far_end: bool) -> Facet:
        return self._row(v)[-1 if far_end else 0]

    def _off(self, facet: Facet, u: float, v: float) -> _Vertex:
        return _Vertex(facet.point(u, v) + self._plan.standoff_m * facet.normal, _heading(facet))


def _end_u(facet: Facet, far_end: bool) -> float:
    return facet.length_u_m if far_end else 0.0


def _heading(facet: Facet) -> float:
    """Of a body whose right side points against u: it faces a wall, and keeps that heading under a bottom."""
    return math.atan2(facet.u[0], -facet.u[1])


def _direction(start: _Vertex, end: _Vertex, otherwise: float) -> float:
    step = end.position - start.position
    return math.atan2(step[1], step[0]) if math.hypot(step[0], step[1]) > 1e-9 else otherwise


def _middle(left: _Vertex, right: _Vertex) -> _Vertex:
    turn = wrap_rad(right.heading_rad - left.heading_rad)
    return _Vertex(0.5 * (left.position + right.position), wrap_rad(left.heading_rad + 0.5 * turn))


def _slerp(start: Array, end: Array, angle: float, share: float) -> Array:
    if angle < 1e-9:
        return start
    blend = math.sin((1.0 - share) * angle) * start + math.sin(share * angle) * end
    return np.asarray(blend / math.sin(angle))
