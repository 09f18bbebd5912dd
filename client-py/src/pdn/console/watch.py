"""`pdn watch`: what an operator keeps on a screen; one line for each event where there is no screen."""

from __future__ import annotations

import contextlib
import sys
import time
from collections import deque
from dataclasses import dataclass, field
from typing import Annotated

import msgspec
import typer
from rich.console import Console, Group
from rich.live import Live
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from pdn import wire
from pdn.client import DEFAULT_ENDPOINT, BadReply, MissionUnknown, PlannerPresence, Watched

from . import options, words
from .connection import connected
from .failures import CommandFailed

REMEMBERED = 6
"""Decisions, and refusals, that stay on the screen."""

SILENT_S = 3.0
"""The state comes once a second; after so long without one the screen says so."""

ENDED = (wire.Phase.COMPLETED, wire.Phase.ABORTED)


def register(app: typer.Typer) -> None:
    """Adds `watch`."""
    app.command()(watch)


def watch(
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
    endpoint: options.Endpoint = DEFAULT_ENDPOINT,
    vehicle: options.Vehicle = "demo",
    zenoh_config: options.ZenohConfig = None,
    as_json: options.Json = False,
    timeout: options.TimeoutS = options.DEFAULT_TIMEOUT_S,
) -> None:
    """Watch a vehicle's mission: phase, uncertainty, coverage, decisions, refusals.

    On a terminal one screen, elsewhere a line for each change; with --json an object a line:
    {"state"|"decision"|"rejected"| "planner": ...}.
    """
    screen = Screen(vehicle, endpoint)
    until_s = None if seconds is None else time.monotonic() + seconds
    with (
        connected(endpoint, vehicle, timeout, zenoh_config, console=name) as client,
        client.watch() as watched,
    ):
        with contextlib.suppress(MissionUnknown):
            screen.take_in(client.mission())
        live = sys.stdout.isatty() and not as_json
        with (
            Live(screen.render(), console=Console(), auto_refresh=False, screen=False)
            if live
            else _Plain() as view
        ):
            if not live and screen.state is not None:
                _print_line(screen.state, as_json)
            while not (until_ended and screen.state is not None and screen.state.phase in ENDED):
                if until_s is not None and time.monotonic() >= until_s:
                    return
                item = watched.next(
                    0.5 if until_s is None else max(0.0, min(0.5, until_s - time.monotonic()))
                )
                news = item is not None and screen.take_in(item)
                if isinstance(view, Live):
                    view.update(screen.render(), refresh=True)
                elif news and item is not None:
                    _print_line(item, as_json)
    if screen.state is not None and screen.state.phase is wire.Phase.ABORTED:
        raise CommandFailed(f"mission {screen.state.mission} was aborted: {screen.state.reason}")


@dataclass
class Screen:
    """What is known about the vehicle, and how it looks."""

    vehicle: str
    endpoint: str
    state: wire.MissionState | None = None
    state_at_s: float = 0.0
    planner_present: bool = True
    decisions: deque[str] = field(default_factory=lambda: deque(maxlen=REMEMBERED))
    refusals: deque[str] = field(default_factory=lambda: deque(maxlen=REMEMBERED))
    refused: int = 0

    def take_in(self, item: Watched) -> bool:
        """Takes in a publication; False for a state that repeats the one before."""
        clock = time.strftime("%H:%M:%S")
        match item:
            case wire.MissionState():
                news = item != self.state
                self.state, self.state_at_s = item, time.monotonic()
                return news
            case wire.Decision():
                self.decisions.append(f"{clock}  {words.decision(item)}")
            case wire.Problem():
                self.refused += 1
                self.refusals.append(f"{clock}  {words.refusal(item)}")
            case PlannerPresence(present=present):
                news = present != self.planner_present
                self.planner_present = present
                return news
            case BadReply():
                self.refusals.append(f"{clock}  {item}")
        return True

    def render(self) -> Panel:
        """The whole screen."""
        table = Table(box=None, show_header=False, pad_edge=False)
        if self.state is None:
            table.add_row("mission", "none yet: `pdn mission configure FILE` makes one")
        else:
            colours = {
                wire.Phase.RUNNING: "green",
                wire.Phase.PAUSED: "yellow",
                wire.Phase.HELD: "yellow",
                wire.Phase.ABORTED: "red",
            }
            over = self.state.uncertainty is not None and self.state.uncertainty >= 1.0
            styles = {"phase": colours.get(self.state.phase, ""), "uncertainty": "red" if over else "green"}
            for heading, line in words.summary(self.state):
                style = "bold red" if heading == "attention" else styles.get(heading, "")
                table.add_row(heading, Text(line, style=style))
        return Panel(
            Group(table, *self._lists()),
            title=f"pdn  {self.vehicle} at {self.endpoint}",
            subtitle=self._footing(),
        )

    def _lists(self) -> list[Text]:
        lines = [Text("\nDecisions", style="bold")]
        lines += [Text(line) for line in reversed(self.decisions)] or [Text("none since this console opened")]
        if self.refusals:
            lines.append(Text(f"\nRefused ({self.refused})", style="bold red"))
            lines += [Text(line) for line in reversed(self.refusals)]
        return lines

    def _footing(self) -> str:
        if not self.planner_present:
            return "THE PLANNER IS GONE; waiting for it"
        silent_s = time.monotonic() - self.state_at_s
        if self.state is not None and self.state.phase not in ENDED and silent_s > SILENT_S:
            return f"no state for {silent_s:.0f} s"
        return "Ctrl-C ends the view, not the mission"


class _Plain:
    """Stands where a live screen would, and shows nothing by itself."""

    def __enter__(self) -> _Plain:
        return self

    def __exit__(self, *_: object) -> None:
        return None


def _print_line(item: Watched, as_json: bool) -> None:
    clock = time.strftime("%H:%M:%S")
    match item:
        case wire.MissionState():
            kind, line, plain = "state", words.in_one_line(item), wire.to_plain(item)
        case wire.Decision():
            kind, line, plain = "decision", words.decision(item), wire.to_plain(item)
        case wire.Problem():
            kind, line, plain = "rejected", words.refusal(item), wire.to_plain(item)
        case PlannerPresence(present=present):
            kind, line, plain = "planner", f"the planner {'is there' if present else 'is gone'}", present
        case _:
            kind, line, plain = "unreadable", str(item), str(item)
    text = msgspec.json.encode({kind: plain}).decode() if as_json else f"{clock}  {line}"
    print(text, flush=True)
