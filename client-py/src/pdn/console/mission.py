"""`pdn mission`: configure a mission, command it, look at it."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from pdn import wire
from pdn.client import Client

from . import options, questions, tables
from .failures import CommandFailed
from .planner import Planner, of_planner


def register(app: typer.Typer) -> None:
    """Adds `mission` with its commands."""
    mission = typer.Typer(
        no_args_is_help=True,
        help=f"Configure missions, command them, ask about them.\n\n{options.EXIT_CODES}",
    )
    mission.command()(of_planner(configure))
    for name, doc, command in _TRANSITIONS:
        mission.command(name, help=doc)(of_planner(_transition(command)))
    mission.command()(of_planner(show))
    questions.register(mission)
    app.add_typer(mission, name="mission")


def configure(
    planner: Planner,
    file: Annotated[
        Path, typer.Argument(exists=True, dir_okay=False, help="The mission's configuration, TOML or JSON.")
    ],
    mission: Annotated[
        str | None,
        typer.Option("--mission", metavar="ID", help="Id instead of the file's; never used twice."),
    ] = None,
    start: Annotated[bool, typer.Option("--start", help="Start it as well.")] = False,
) -> None:
    """Configure a new mission from a file; the planner fills in defaults and checks everything."""
    config = read_config(file)
    if mission is not None:
        config["mission"] = mission
    with planner.connected() as client:
        state = client.configure(config)
        if start:
            state = client.start("started when configured", mission=state.mission)
        planner.show(state, tables.print_state)


def show(
    planner: Planner,
    mission: options.Mission = None,
) -> None:
    """Show the mission as it stands."""
    with planner.connected() as client:
        planner.show(client.mission(mission=mission), tables.print_state)


def read_config(file: Path) -> dict[str, Any]:
    """A configuration as the planner takes it; raises `CommandFailed`."""
    try:
        text = file.read_text(encoding="utf-8")
        config = json.loads(text) if file.suffix.lower() == ".json" else tomllib.loads(text)
        json.dumps(config, allow_nan=False)
    except (tomllib.TOMLDecodeError, ValueError, TypeError) as error:
        raise CommandFailed(f"{file} cannot be read: {error}") from error
    if not isinstance(config, dict):
        raise CommandFailed(f"{file} holds no table of settings")
    return config


Command = Callable[..., wire.MissionState]

_TRANSITIONS: tuple[tuple[str, str, Callable[[Client], Command]], ...] = (
    ("start", "Start the mission: from `configured` to `running`.", lambda client: client.start),
    ("pause", "Pause decisions for a while; events still count.", lambda client: client.pause),
    ("resume", "Go on from `paused` or `held`.", lambda client: client.resume),
    ("hold", "Stop decisions until someone resumes; events still count.", lambda client: client.hold),
    ("complete", "End the mission as planned.", lambda client: client.complete),
    ("abort", "End the mission before its end.", lambda client: client.abort),
)


def _transition(command: Callable[[Client], Command]) -> Callable[..., None]:
    def run(
        planner: Planner,
        mission: options.Mission = None,
        reason: options.Reason = "",
    ) -> None:
        with planner.connected() as client:
            planner.show(command(client)(reason, mission=mission), tables.print_state)

    return run
