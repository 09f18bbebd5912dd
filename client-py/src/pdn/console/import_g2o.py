"""`pdn import-g2o`: streams a recorded pose graph into the planner as a vehicle would have sent it."""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from pdn import wire
from pdn.client import Client, MissionStream, Timeout

from . import formatting
from .failures import CommandFailed
from .g2o import G2oError, PoseGraph, Transform, read_g2o
from .planner import Planner, of_planner

NOMINAL_FACET: dict[str, Any] = {
    "origin": [0.0, 0.0, 0.0],
    "u": [1.0, 0.0, 0.0],
    "v": [0.0, 1.0, 0.0],
    "length_u_m": 1.0,
    "length_v_m": 1.0,
}
"""A mission needs a surface to photograph, a pose graph has none: this square metre stands for it, and
coverage and decisions of an imported mission mean nothing.
"""

ORIGIN = Transform((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))


def register(app: typer.Typer) -> None:
    """Adds `import-g2o`."""
    app.command("import-g2o")(of_planner(import_g2o))


def import_g2o(
    planner: Planner,
    file: Annotated[
        Path, typer.Argument(exists=True, dir_okay=False, help="A 3-D pose graph in g2o text form.")
    ],
    mission: Annotated[
        str | None,
        typer.Option("--mission", metavar="ID", help="Id of the new mission; default: file name and time."),
    ] = None,
    anchor_sigma: Annotated[
        float,
        typer.Option("--anchor-sigma", min=1e-9, help="Sigma of the prior on the first keyframe, m and rad."),
    ] = 1e-3,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress bar.")] = False,
    timeout: Annotated[
        float,
        typer.Option("--timeout", metavar="SECONDS", min=0.1, help="Longest time without any progress."),
    ] = 60.0,
) -> None:
    """Import a 3-D g2o pose graph as a new mission, keyframe by keyframe, and print chi2 and the last
    pose's covariance.

    Edges become `relative` factors; poses are initialised from them, not from the file. The first keyframe
    is anchored at its vertex. The mission's target is one nominal square metre, so its coverage and
    decisions mean nothing.
    """
    try:
        graph = read_g2o(file)
    except G2oError as error:
        raise CommandFailed(str(error)) from error
    name = mission if mission is not None else _mission_id(file)
    began_s = time.monotonic()
    with planner.connected() as client:
        client.configure(_configuration(name))
        client.start(f"import of {file.name}", mission=name)
        with client.mission_stream(name, timeout_s=timeout) as events:
            stream_graph(graph, events, anchor_sigma, show_progress=not quiet and not planner.as_json)
            last_seq = events.next_seq - 1
            _settle(events, timeout)
        streamed_s = time.monotonic() - began_s
        report = _report(client, graph, name, last_seq, timeout)
        client.complete("imported", mission=name)
    report |= {"file": str(file), "stream_s": streamed_s, "total_s": time.monotonic() - began_s}
    print(json.dumps(report) if planner.as_json else _sentences(report))


def stream_graph(
    graph: PoseGraph, events: MissionStream, anchor_sigma: float, *, show_progress: bool
) -> None:
    """Sends each keyframe, then the factors that it completes; the first is anchored by a prior."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True), disable=not show_progress) as progress:
        task = progress.add_task("keyframes", total=len(graph.keyframes))
        for keyframe, edges in graph.arrivals():
            events.keyframe(keyframe)
            if keyframe == graph.anchor:
                pose = graph.vertices.get(keyframe, ORIGIN)
                events.prior(keyframe, _pose(pose), anchor_sigma**2 * np.eye(6))
            for edge in edges:
                events.relative(edge.from_, edge.to, _pose(edge.relative), edge.covariance)
            progress.advance(task)


def _report(
    client: Client, graph: PoseGraph, mission: str, last_seq: int, timeout_s: float
) -> dict[str, Any]:
    last = graph.keyframes[-1]
    reply = client.graph(last, True, after=last_seq, mission=mission, timeout_s=timeout_s)
    found = {keyframe.id: keyframe for keyframe in reply.keyframes}
    if last not in found:
        raise CommandFailed(f"keyframe {last} is not in the planner's graph")
    keyframe = found[last]
    return {
        "mission": mission,
        "keyframes": len(graph.keyframes),
        "edges": len(graph.edges),
        "chi2": reply.chi2,
        "last_keyframe": last,
        "last_pose": wire.to_plain(keyframe.pose),
        "last_covariance": None if keyframe.covariance is None else list(keyframe.covariance),
    }


def _sentences(report: dict[str, Any]) -> str:
    lines = [
        f"{report['file']} is mission {report['mission']}: "
        f"{report['keyframes']} keyframes, {report['edges']} edges, "
        f"{report['stream_s']:.1f} s.",
        f"chi2 {report['chi2']:.12g} (sum of r' W r at the estimate)",
    ]
    if report["last_covariance"] is not None:
        metres, degrees = formatting.sigmas(report["last_covariance"])
        lines.append(
            f"keyframe {report['last_keyframe']}: sigma {' '.join(f'{value:.6g}' for value in metres)} m, "
            f"{' '.join(f'{value:.6g}' for value in degrees)} deg, in its body frame"
        )
    return "\n".join(lines)


def _configuration(mission: str) -> dict[str, Any]:
    return {"mission": mission, "target": {"facets": [NOMINAL_FACET]}, "first_keyframe_sigmas": None}


def _mission_id(file: Path) -> str:
    stem = "".join(letter if letter.isascii() and letter.isalnum() else "-" for letter in file.stem.lower())
    return f"{stem[:40]}-{time.time_ns() // 1_000_000}"


def _settle(events: MissionStream, timeout_s: float) -> None:
    """Waits until everything is confirmed, as long as something is confirmed within each `timeout_s`."""
    while True:
        confirmed = events.durable_seq
        try:
            events.flush(timeout_s)
            return
        except Timeout:
            if events.durable_seq == confirmed:
                raise


def _pose(transform: Transform) -> wire.Pose:
    return wire.Pose(translation=transform.translation, rotation=transform.rotation)
