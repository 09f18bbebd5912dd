"""`pdn mission decision`, `graph`, `waypoints`, `coverage`, `link-model`: what the planner knows."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, TypeVar

import typer

from pdn.client import DEFAULT_ENDPOINT

from . import options, tables
from .connection import connected, print_json

M = TypeVar("M")


def register(mission: typer.Typer) -> None:
    """Adds the questions to the group `mission`."""
    mission.command()(decision)
    mission.command()(graph)
    mission.command()(waypoints)
    mission.command()(coverage)
    mission.command("link-model")(link_model)


def decision(
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
    endpoint: options.Endpoint = DEFAULT_ENDPOINT,
    vehicle: options.Vehicle = "demo",
    zenoh_config: options.ZenohConfig = None,
    certificate: options.Certificate = None,
    as_json: options.Json = False,
    timeout: options.TimeoutS = options.DEFAULT_TIMEOUT_S,
) -> None:
    """Ask: explore or revisit? Without a what-if the decision counts, and the mission must be running."""
    with connected(endpoint, vehicle, timeout, zenoh_config, certificate) as client:
        given = client.decision(
            after=after,
            alpha=alpha,
            sigma_xy_m=sigma_xy_m,
            deadline_ms=deadline_ms,
            detail="full" if detail else "brief",
            mission=mission,
        )
    _show(given, as_json, tables.print_decision)


def graph(
    from_: Annotated[
        int | None, typer.Option("--from", metavar="KEYFRAME", min=0, help="Keyframes from this id on.")
    ] = None,
    marginals: Annotated[bool, typer.Option("--marginals", help="With each keyframe's covariance.")] = False,
    after: options.After = None,
    mission: options.Mission = None,
    endpoint: options.Endpoint = DEFAULT_ENDPOINT,
    vehicle: options.Vehicle = "demo",
    zenoh_config: options.ZenohConfig = None,
    certificate: options.Certificate = None,
    as_json: options.Json = False,
    timeout: options.TimeoutS = options.DEFAULT_TIMEOUT_S,
) -> None:
    """Show the pose graph; a long one is shortened unless --json."""
    with connected(endpoint, vehicle, timeout, zenoh_config, certificate) as client:
        reply = client.graph(from_, marginals, after=after, mission=mission)
    _show(reply, as_json, tables.print_graph)


def waypoints(
    after: options.After = None,
    mission: options.Mission = None,
    endpoint: options.Endpoint = DEFAULT_ENDPOINT,
    vehicle: options.Vehicle = "demo",
    zenoh_config: options.ZenohConfig = None,
    certificate: options.Certificate = None,
    as_json: options.Json = False,
    timeout: options.TimeoutS = options.DEFAULT_TIMEOUT_S,
) -> None:
    """Show the waypoints that revisits may go to."""
    with connected(endpoint, vehicle, timeout, zenoh_config, certificate) as client:
        reply = client.waypoints(after=after, mission=mission)
    _show(reply, as_json, tables.print_waypoints)


def coverage(
    after: options.After = None,
    mission: options.Mission = None,
    endpoint: options.Endpoint = DEFAULT_ENDPOINT,
    vehicle: options.Vehicle = "demo",
    zenoh_config: options.ZenohConfig = None,
    certificate: options.Certificate = None,
    as_json: options.Json = False,
    timeout: options.TimeoutS = options.DEFAULT_TIMEOUT_S,
) -> None:
    """Show what has been photographed, facet by facet."""
    with connected(endpoint, vehicle, timeout, zenoh_config, certificate) as client:
        reply = client.coverage(after=after, mission=mission)
    _show(reply, as_json, tables.print_coverage)


def link_model(
    after: options.After = None,
    mission: options.Mission = None,
    endpoint: options.Endpoint = DEFAULT_ENDPOINT,
    vehicle: options.Vehicle = "demo",
    zenoh_config: options.ZenohConfig = None,
    certificate: options.Certificate = None,
    as_json: options.Json = False,
    timeout: options.TimeoutS = options.DEFAULT_TIMEOUT_S,
) -> None:
    """Show how likely registrations are, by the saliency of both images, and what that rests on."""
    with connected(endpoint, vehicle, timeout, zenoh_config, certificate) as client:
        reply = client.link_model(after=after, mission=mission)
    _show(reply, as_json, tables.print_link_model)


def _show(message: M, as_json: bool, show: Callable[[M], None]) -> None:
    if as_json:
        print_json(message)
    else:
        show(message)
