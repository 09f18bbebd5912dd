"""What came of an import, for a person and for a program."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pdn import wire

from . import formatting
from .import_stream import GraphStream
from .pose_graph import consistency, counted

WORST = 10
"""RefusedMeasurement measurements that are listed."""


@dataclass
class Report:
    """A mission, what went into it, and what it came to."""

    mission: str
    streaming: GraphStream
    chi2: float
    last: wire.GraphKeyframe
    file: str = ""
    settings: dict[str, Any] = field(default_factory=dict)
    refused_file: Path | None = None
    stream_s: float = 0.0
    total_s: float = 0.0

    @property
    def degrees_of_freedom(self) -> int:
        """Of what was taken."""
        graph = self.streaming.graph
        return graph.degrees_of_freedom - (3 if graph.planar else 6) * len(self.streaming.refused)

    @property
    def per_degree(self) -> float | None:
        """chi2 per degree of freedom."""
        freedom = self.degrees_of_freedom
        return self.chi2 / freedom if freedom > 0 else None

    @property
    def verdict(self) -> str:
        """How consistent the graph is, in a sentence or two."""
        if self._loss() != "none":
            return "The robust loss weighs chi2 down, so it says nothing of how consistent the graph is."
        told = consistency.verdict(self.chi2, self.degrees_of_freedom)
        return f"{told} The left-out measurements do not count." if self.streaming.refused else told

    def gate(self) -> str:
        """The gate and the loss that counted."""
        sigmas = self.settings.get("gate_sigmas", "the planner's default")
        loss = self._loss()
        told = loss if isinstance(loss, str) else " ".join(f"{kind} {c:g}" for kind, c in loss.items())
        gate = (
            "off"
            if sigmas is None
            else sigmas
            if isinstance(sigmas, str)
            else f"{sigmas:g} standard deviations"
        )
        return f"gate: {gate}; robust loss: {told}"

    def _loss(self) -> Any:
        return self.settings.get("robust", {}).get("relative", "none")


def show(report: Report, *, as_json: bool) -> None:
    """Prints it."""
    print(json.dumps(_plain(report)) if as_json else _sentences(report))


def _plain(report: Report) -> dict[str, Any]:
    graph, refused = report.streaming.graph, report.streaming.refused
    return {
        "mission": report.mission,
        "keyframes": len(graph.keyframes),
        "edges": len(graph.edges),
        "priors": len(graph.priors),
        "anchors": sorted(graph.anchors),
        "notes": graph.notes,
        "settings": report.settings,
        "refused": len(refused),
        "farthest": [
            {"line": one.measurement.line, "sigmas": one.sigmas, "reason": one.reason}
            for one in refused[:WORST]
        ],
        "chi2": report.chi2,
        "degrees_of_freedom": report.degrees_of_freedom,
        "chi2_per_degree": report.per_degree,
        "consistency": report.verdict,
        "last_keyframe": report.last.id,
        "last_pose": wire.to_plain(report.last.pose),
        "last_covariance": None if report.last.covariance is None else list(report.last.covariance),
        "file": report.file,
        "stream_s": report.stream_s,
        "total_s": report.total_s,
    }


def _sentences(report: Report) -> str:
    graph, refused = report.streaming.graph, report.streaming.refused
    parts = [counted(len(graph.keyframes), "keyframe"), counted(len(graph.edges), "edge")]
    parts += [counted(len(graph.priors), "prior")] if graph.priors else []
    anchors = ", ".join(str(id) for id in sorted(graph.anchors)[:5])
    anchors += ", ..." if len(graph.anchors) > 5 else ""
    lines = [
        f"{report.file} is mission {report.mission}: {', '.join(parts)}, {report.stream_s:.1f} s.",
        *graph.notes,
        f"held at its pose: {anchors}" if anchors else "held by the priors of the file",
        report.gate(),
    ]
    if refused:
        lines.append(f"refused and left out: {counted(len(refused), 'measurement')}, the farthest first")
        lines += [f"  {one}" for one in refused[:WORST]]
    if report.refused_file is not None:
        lines.append(f"all that were refused: {report.refused_file}")
    per_degree = "" if report.per_degree is None else f", {report.per_degree:.6g} per degree of freedom"
    lines += [
        f"chi2 {report.chi2:.12g} (sum of r' W r at the estimate), {report.degrees_of_freedom} degrees of "
        f"freedom{per_degree}",
        report.verdict,
    ]
    if report.last.covariance is not None:
        metres, degrees = formatting.sigmas(report.last.covariance)
        lines.append(
            f"keyframe {report.last.id}: sigma {' '.join(f'{value:.6g}' for value in metres)} m, "
            f"{' '.join(f'{value:.6g}' for value in degrees)} deg, in its body frame"
        )
    return "\n".join(lines)
