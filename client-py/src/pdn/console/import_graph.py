"""`pdn import`: streams a recorded pose graph into the planner as a vehicle would have sent it."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer

from pdn.client import Client

from . import import_mission, import_options
from .failures import CommandFailed
from .import_refused import write_refused
from .import_report import Report, show
from .import_stream import GraphStream
from .planner import Planner, of_planner
from .pose_graph import Assumptions, PoseGraph, PoseGraphError, Transform, read_pose_graph


def register(app: typer.Typer) -> None:
    """Adds `import`, and `import-g2o` as its older name."""
    app.command("import")(of_planner(import_graph))
    alias = f"The older name of `pdn import`, for scripts that have it.\n\n{import_graph.__doc__}"
    app.command("import-g2o", help=alias)(of_planner(import_graph))


def import_graph(
    planner: Planner,
    file: Annotated[
        Path,
        typer.Argument(exists=True, dir_okay=False, help="A pose graph as text: g2o or TORO, 3-D or 2-D."),
    ],
    mission: Annotated[
        str | None,
        typer.Option("--mission", metavar="ID", help="Id of the new mission; default: file name and time."),
    ] = None,
    replace: Annotated[
        bool,
        typer.Option("--replace", help="Abort what an earlier import has left running; nothing else."),
    ] = False,
    robust: Annotated[
        str | None,
        typer.Option(
            "--robust",
            metavar="KIND[:C]",
            help="Loss of the edges: none (default), huber or cauchy, with its parameter.",
        ),
    ] = None,
    gate: Annotated[
        str | None,
        typer.Option(
            "--gate",
            metavar="SIGMAS|off",
            help="Refuse what lies farther from the graph before it; default: the planner's, 20.",
        ),
    ] = None,
    keep_going: Annotated[
        bool, typer.Option("--keep-going", help="Leave refused measurements out, and list the farthest.")
    ] = False,
    refused: Annotated[
        Path | None,
        typer.Option("--refused", metavar="FILE", help="With --keep-going: write all of them as g2o."),
    ] = None,
    default_sigmas: Annotated[
        str | None,
        typer.Option("--default-sigmas", metavar="M,RAD", help="Of edges without information."),
    ] = None,
    plane_sigmas: Annotated[
        str,
        typer.Option(
            "--plane-sigmas", metavar="M,RAD", help="Of z, and of roll and pitch, in edges of a 2-D graph."
        ),
    ] = "0.01,0.01",
    mend_information: Annotated[
        bool,
        typer.Option("--mend-information", help="Mend information that six digits have made indefinite."),
    ] = False,
    anchor_sigma: Annotated[
        float,
        typer.Option("--anchor-sigma", min=1e-9, help="Sigma of the prior on what is held, m and rad."),
    ] = 1e-3,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress bar.")] = False,
    timeout: Annotated[
        float,
        typer.Option("--timeout", metavar="SECONDS", min=0.1, help="Longest time without any progress."),
    ] = 60.0,
) -> None:
    """Import a pose graph (g2o, TORO) as a new mission, keyframe by keyframe, and tell chi2, how consistent
    it is, and the last pose's covariance.

    Edges become `relative` factors, EDGE_SE3_PRIOR `prior` factors; poses are initialised from them, not from
    the file. What FIX names is held at its pose; without FIX and priors the lowest id is. The mission's
    target is one nominal square metre, so its coverage and decisions mean nothing.
    """
    name = import_options.mission_id(mission) if mission is not None else _mission_id(file)
    settings = _settings(robust, gate)
    assumptions = _assumptions(default_sigmas, plane_sigmas, mend_information)
    _check_refused(refused, keep_going)
    graph = _read(file, assumptions)
    streaming = GraphStream(graph, anchor_sigma, keep_going, str(file))
    began_s = time.monotonic()
    with planner.connected() as client:
        import_mission.clear_the_way(client, name, replace=replace)
        try:
            with import_mission.running(
                client, import_mission.configuration(name, settings), f"import of {file.name}"
            ):
                progress = not quiet and not planner.as_json
                last_seq = streaming.run(client, name, timeout, show_progress=progress)
                streamed_s = time.monotonic() - began_s
                report = _report(client, streaming, name, last_seq, timeout)
                if refused is not None:
                    write_refused(refused, str(file), streaming.refused, _estimates(client, name, timeout))
        except import_mission.Terminated as ended:
            raise typer.Exit(ended.exit_code) from None
    report.file, report.settings, report.refused_file = str(file), settings, refused
    report.stream_s, report.total_s = streamed_s, time.monotonic() - began_s
    show(report, as_json=planner.as_json)


def _settings(robust: str | None, gate: str | None) -> dict[str, Any]:
    """Settings of the mission that differ from the planner's defaults."""
    settings: dict[str, Any] = {}
    if robust is not None:
        settings["robust"] = {"relative": import_options.robust(robust)}
    if gate is not None:
        settings["gate_sigmas"] = import_options.gate(gate)
    return settings


def _assumptions(default_sigmas: str | None, plane_sigmas: str, mend_information: bool) -> Assumptions:
    default = None if default_sigmas is None else import_options.sigmas(default_sigmas)
    return Assumptions(default, import_options.sigmas(plane_sigmas), mend_information)


def _check_refused(refused: Path | None, keep_going: bool) -> None:
    """What would otherwise be found out at the end of a long import."""
    if refused is None:
        return
    if not keep_going:
        raise typer.BadParameter(
            "needs --keep-going: else the first refusal ends the import", param_hint="--refused"
        )
    if not refused.absolute().parent.is_dir() or refused.is_dir():
        raise typer.BadParameter(f"{refused} cannot be written: no such folder", param_hint="--refused")


def _read(file: Path, assumptions: Assumptions) -> PoseGraph:
    try:
        return read_pose_graph(file.read_bytes(), str(file), assumptions)
    except PoseGraphError as error:
        raise CommandFailed(str(error)) from error


def _report(client: Client, streaming: GraphStream, mission: str, last_seq: int, timeout_s: float) -> Report:
    last = streaming.graph.keyframes[-1]
    reply = client.graph(last, True, after=last_seq, mission=mission, timeout_s=timeout_s)
    found = {keyframe.id: keyframe for keyframe in reply.keyframes}
    if last not in found:
        raise CommandFailed(f"keyframe {last} is not in the planner's graph")
    return Report(mission, streaming, reply.chi2, found[last])


def _estimates(client: Client, mission: str, timeout_s: float) -> dict[int, Transform]:
    reply = client.graph(mission=mission, timeout_s=timeout_s)
    return {
        keyframe.id: Transform(keyframe.pose.translation, keyframe.pose.rotation)
        for keyframe in reply.keyframes
    }


def _mission_id(file: Path) -> str:
    stem = "".join(letter if letter.isascii() and letter.isalnum() else "-" for letter in file.stem.lower())
    return f"{stem[:40]}-{time.time_ns() // 1_000_000}"
