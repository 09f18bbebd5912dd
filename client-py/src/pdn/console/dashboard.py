"""The operator's one screen: what is known about a vehicle, and how it looks."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass, field

from rich.console import Group
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from pdn import wire
from pdn.client import BadReply, PlannerPresence, Watched

from . import formatting

REMEMBERED = 6
"""Decisions, and refusals, that stay on the screen."""

SILENT_S = 3.0
"""The state comes once a second; after so long without one the screen says so."""

ENDED = (wire.Phase.COMPLETED, wire.Phase.ABORTED)

COLOURS = {
    wire.Phase.RUNNING: "green",
    wire.Phase.PAUSED: "yellow",
    wire.Phase.HELD: "yellow",
    wire.Phase.ABORTED: "red",
}


@dataclass
class Dashboard:
    """What is known about the vehicle, and how it looks."""

    vehicle: str
    endpoint: str
    state: wire.MissionState | None = None
    state_at_s: float = 0.0
    planner_present: bool = True
    decisions: deque[str] = field(default_factory=lambda: deque(maxlen=REMEMBERED))
    refusals: deque[str] = field(default_factory=lambda: deque(maxlen=REMEMBERED))
    refused: int = 0

    def update(self, item: Watched) -> bool:
        """Takes in a publication; False for a state that repeats the one before."""
        clock = time.strftime("%H:%M:%S")
        match item:
            case wire.MissionState():
                news = item != self.state
                self.state, self.state_at_s = item, time.monotonic()
                return news
            case wire.Decision():
                self.decisions.append(f"{clock}  {formatting.decision(item)}")
            case wire.Problem():
                self.refused += 1
                self.refusals.append(f"{clock}  {formatting.refusal(item)}")
            case PlannerPresence(present=present):
                news = present != self.planner_present
                self.planner_present = present
                return news
            case BadReply():
                self.refusals.append(f"{clock}  {item}")
        return True

    def ended(self, matters: bool) -> bool:
        """Whether the mission has ended, if that matters."""
        return matters and self.state is not None and self.state.phase in ENDED

    def render(self) -> Panel:
        """The whole screen."""
        table = Table(box=None, show_header=False, pad_edge=False)
        if self.state is None:
            table.add_row("mission", "none yet: `pdn mission configure FILE` makes one")
        else:
            over = self.state.uncertainty is not None and self.state.uncertainty >= 1.0
            styles = {"phase": COLOURS.get(self.state.phase, ""), "uncertainty": "red" if over else "green"}
            for heading, line in formatting.summary(self.state):
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
