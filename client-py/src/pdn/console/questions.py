"""`pdn mission decision`, `graph`, `waypoints`, `coverage`, `link-model`: what the planner knows."""

from __future__ import annotations

from typing import Annotated

import typer

from . import options, tables
from .planner import Planner, of_planner


def register(mission: typer.Typer) -> None:
    """Adds the questions to the group `mission`."""
    mission.command()(of_planner(decision))
    mission.command()(of_planner(graph))
    mission.command()(of_planner(waypoints))
    mission.command()(of_planner(coverage))
    mission.command("link-model")(of_planner(link_model))


def decision(
    planner: Planner,
    after: options.After = None,
    alpha: Annotated[
        float | None,
        typer.Option(
            "--alpha", min=0.0, max=1.0, help="What if this were the weight of the uncertainty? Not counted."
        ),
    ] = None,
    sigma_xy_m: Annotated[
        float | None,
        typer.Option("--sigma-xy", metavar="METRES", help="What if this were allowed north and east?"),
    ] = None,
    deadline_ms: Annotated[
        int | None, typer.Option("--deadline-ms", min=1, help="Take the best that is found by then.")
    ] = None,
    detail: Annotated[
        bool,
        typer.Option("--detail", help="With poses and links of every candidate (they show with --json)."),
    ] = False,
    mission: options.Mission = None,
) -> None:
    """Ask: explore or revisit? Without a what-if the decision counts, and the mission must be running."""
    with planner.connected() as client:
        given = client.decision(
            after=after,
            alpha=alpha,
            sigma_xy_m=sigma_xy_m,
            deadline_ms=deadline_ms,
            detail="full" if detail else "brief",
            mission=mission,
        )
    planner.show(given, tables.print_decision)


def graph(
    planner: Planner,
    from_: Annotated[
        int | None, typer.Option("--from", metavar="KEYFRAME", min=0, help="Keyframes from this id on.")
    ] = None,
    marginals: Annotated[bool, typer.Option("--marginals", help="With each keyframe's covariance.")] = False,
    after: options.After = None,
    mission: options.Mission = None,
) -> None:
    """Show the pose graph; a long one is shortened unless --json."""
    with planner.connected() as client:
        reply = client.graph(from_, marginals, after=after, mission=mission)
    planner.show(reply, tables.print_graph)


def waypoints(
    planner: Planner,
    after: options.After = None,
    mission: options.Mission = None,
) -> None:
    """Show the waypoints that revisits may go to."""
    with planner.connected() as client:
        reply = client.waypoints(after=after, mission=mission)
    planner.show(reply, tables.print_waypoints)


def coverage(
    planner: Planner,
    after: options.After = None,
    mission: options.Mission = None,
) -> None:
    """Show what has been photographed, facet by facet."""
    with planner.connected() as client:
        reply = client.coverage(after=after, mission=mission)
    planner.show(reply, tables.print_coverage)


def link_model(
    planner: Planner,
    after: options.After = None,
    mission: options.Mission = None,
) -> None:
    """Show how likely registrations are, by the saliency of both images, and what that rests on."""
    with planner.connected() as client:
        reply = client.link_model(after=after, mission=mission)
    planner.show(reply, tables.print_link_model)
