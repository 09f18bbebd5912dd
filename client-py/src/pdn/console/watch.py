"""`pdn watch`: what an operator keeps on a screen; one line for each event where there is no screen."""

from __future__ import annotations

import contextlib
import sys
import time
from typing import Annotated

import msgspec
import typer
from rich.console import Console
from rich.live import Live

from pdn import wire
from pdn.client import MissionUnknown, PlannerPresence, Timeout, Watch, Watched

from . import formatting
from .dashboard import Dashboard
from .failures import CommandFailed
from .planner import Planner, of_planner

FIRST_LOOK_S = 1.0
"""How long the view waits for the state to begin with; a busy planner publishes the next by itself."""

REFRESH_S = 0.5
"""The screen is drawn again at least so often."""


def register(app: typer.Typer) -> None:
    """Adds `watch`."""
    app.command()(of_planner(watch))


def watch(
    planner: Planner,
    name: Annotated[
        str, typer.Option("--name", metavar="NAME", help="Name under which this console announces itself.")
    ] = "console",
    seconds: Annotated[
        float | None,
        typer.Option("--for", metavar="SECONDS", min=0.0, help="Stop after so long; else with Ctrl-C."),
    ] = None,
    until_ended: Annotated[
        bool, typer.Option("--until-ended", help="Stop when the mission is completed (0) or aborted (1).")
    ] = False,
) -> None:
    """Watch a vehicle's mission: phase, uncertainty, coverage, decisions, refusals.

    On a terminal one screen, elsewhere a line for each change; with --json an object a line:
    {"state"|"decision"|"rejected"|"planner": ...}. Ctrl-C ends the view, not the mission.
    """
    dashboard = Dashboard(planner.vehicle, "")
    with (
        contextlib.suppress(KeyboardInterrupt),
        planner.connected(console=name) as client,
        client.watch() as watched,
    ):
        dashboard.endpoint = client.endpoint
        with contextlib.suppress(MissionUnknown, Timeout):
            dashboard.update(client.mission(timeout_s=min(planner.timeout, FIRST_LOOK_S)))
        until_s = float("inf") if seconds is None else time.monotonic() + seconds
        if sys.stdout.isatty() and not planner.as_json:
            _show_dashboard(dashboard, watched, until_s, until_ended)
        else:
            _print_lines(dashboard, watched, until_s, until_ended, planner.as_json)
    if dashboard.state is not None and dashboard.state.phase is wire.Phase.ABORTED:
        raise CommandFailed(f"mission {dashboard.state.mission} was aborted: {dashboard.state.reason}")


def _show_dashboard(dashboard: Dashboard, watched: Watch, until_s: float, until_ended: bool) -> None:
    with Live(dashboard.render(), console=Console(), auto_refresh=False) as live:
        while not dashboard.ended(until_ended) and (left_s := until_s - time.monotonic()) > 0.0:
            if (item := watched.next(min(REFRESH_S, left_s))) is not None:
                dashboard.update(item)
            live.update(dashboard.render(), refresh=True)


def _print_lines(
    dashboard: Dashboard, watched: Watch, until_s: float, until_ended: bool, as_json: bool
) -> None:
    if dashboard.state is not None:
        _print_line(dashboard.state, as_json)
    while not dashboard.ended(until_ended) and (left_s := until_s - time.monotonic()) > 0.0:
        item = watched.next(min(REFRESH_S, left_s))
        if item is not None and dashboard.update(item):
            _print_line(item, as_json)


def _print_line(item: Watched, as_json: bool) -> None:
    clock = time.strftime("%H:%M:%S")
    match item:
        case wire.MissionState():
            kind, line, plain = "state", formatting.one_line(item), wire.to_plain(item)
        case wire.Decision():
            kind, line, plain = "decision", formatting.decision(item), wire.to_plain(item)
        case wire.Problem():
            kind, line, plain = "rejected", formatting.refusal(item), wire.to_plain(item)
        case PlannerPresence(present=present):
            kind, line, plain = "planner", f"the planner {'is there' if present else 'is gone'}", present
        case _:
            kind, line, plain = "unreadable", str(item), str(item)
    text = msgspec.json.encode({kind: plain}).decode() if as_json else f"{clock}  {line}"
    print(text, flush=True)
