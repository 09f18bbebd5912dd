"""What changes nothing: decisions, the mission, its graph, and what the planner knows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

from pdn import wire

from .requester import Requester

Detail = Literal["brief", "full", "choice"]


class Questions(Requester):
    """The questions of the contract, as methods that return typed messages."""

    def decision(
        self,
        *,
        after: int | None = None,
        deadline_ms: int | None = None,
        detail: Detail = "brief",
        alpha: float | None = None,
        sigma_xy_m: float | None = None,
        sigma_depth_m: float | None = None,
        sigma_tilt_deg: float | None = None,
        sigma_heading_deg: float | None = None,
        mission: str | None = None,
        timeout_s: float | None = None,
    ) -> wire.Decision:
        """Explore or revisit? `after` waits for that event; `alpha` or a sigma makes it a what-if, which
        is not counted.

        When `deadline_ms` comes before all candidates are evaluated, the best of those that were is chosen,
        and `complete` is False. Without it the planner is told to answer shortly before `timeout_s`.
        """
        return self._ask(
            wire.Topic.RPC_DECISION,
            wire.Decision,
            timeout_s,
            deadline_ms=deadline_ms,
            mission=mission,
            after=after,
            detail=detail,
            alpha=alpha,
            sigma_xy_m=sigma_xy_m,
            sigma_depth_m=sigma_depth_m,
            sigma_tilt_deg=sigma_tilt_deg,
            sigma_heading_deg=sigma_heading_deg,
        )

    def evaluate(
        self,
        paths: Sequence[Sequence[Sequence[float]]],
        *,
        after: int | None = None,
        deadline_ms: int | None = None,
        detail: Detail = "brief",
        alpha: float | None = None,
        mission: str | None = None,
        timeout_s: float | None = None,
    ) -> wire.EvaluateReply:
        """Paths of world points [x, y, z], m, from the robot on, evaluated as candidates of a decision."""
        request = wire.EvaluateRequest(paths=tuple(tuple(_point(point) for point in path) for path in paths))
        return self._ask(
            wire.Topic.RPC_EVALUATE,
            wire.EvaluateReply,
            timeout_s,
            message=request,
            deadline_ms=deadline_ms,
            mission=mission,
            after=after,
            detail=detail,
            alpha=alpha,
        )

    def mission(
        self, *, after: int | None = None, mission: str | None = None, timeout_s: float | None = None
    ) -> wire.MissionState:
        """The mission as it stands; `after` waits for that event."""
        return self._ask(wire.Topic.RPC_MISSION, wire.MissionState, timeout_s, mission=mission, after=after)

    def ingest(self, *, mission: str | None = None, timeout_s: float | None = None) -> wire.IngestStatus:
        """Which events have arrived."""
        return self._ask(wire.Topic.RPC_INGEST, wire.IngestStatus, timeout_s, mission=mission)

    def graph(
        self,
        from_: int | None = None,
        marginals: bool = False,
        *,
        after: int | None = None,
        mission: str | None = None,
        timeout_s: float | None = None,
    ) -> wire.GraphReply:
        """The pose graph: keyframes from id `from_` on, with their covariances if `marginals`."""
        parameters: dict[str, Any] = {"from": from_, "marginals": "true" if marginals else None}
        return self._ask(
            wire.Topic.RPC_GRAPH, wire.GraphReply, timeout_s, mission=mission, after=after, **parameters
        )

    def waypoints(
        self, *, after: int | None = None, mission: str | None = None, timeout_s: float | None = None
    ) -> wire.WaypointsReply:
        """Clusters of salient keyframes and their representatives."""
        return self._ask(
            wire.Topic.RPC_WAYPOINTS, wire.WaypointsReply, timeout_s, mission=mission, after=after
        )

    def coverage(
        self, *, after: int | None = None, mission: str | None = None, timeout_s: float | None = None
    ) -> wire.CoverageReply:
        """The coverage raster of each facet."""
        return self._ask(wire.Topic.RPC_COVERAGE, wire.CoverageReply, timeout_s, mission=mission, after=after)

    def link_model(
        self, *, after: int | None = None, mission: str | None = None, timeout_s: float | None = None
    ) -> wire.LinkModelReply:
        """The table of link probabilities with its counts."""
        return self._ask(
            wire.Topic.RPC_LINK_MODEL, wire.LinkModelReply, timeout_s, mission=mission, after=after
        )


def _point(point: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in point)
    return (x, y, z)
