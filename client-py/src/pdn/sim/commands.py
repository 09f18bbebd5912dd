"""The command ``pdn sim``: fly one scenario against a running daemon."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pdn.client import DEFAULT_ENDPOINT, DEFAULT_VEHICLE

if TYPE_CHECKING:
    from pdn.client import Client
    from pdn.sim.scenario import Scenario


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("sim", help=_HELP)(sim)


_HELP = """Fly a simulated vehicle through a scenario, against a running daemon.

SCENARIO is the name of one that comes with pdn (see --list) or the path of a TOML file of one's own. The
vehicle configures a mission, starts it, flies the survey by its estimate under the policy, and completes the
mission; with --await-operator it leaves configuring and starting to an operator. At the end the mission's
figures are printed; --out keeps the whole course for `pdn plot`."""


def sim(
    scenario: Annotated[str | None, typer.Argument(help="Name or path.", show_default=False)] = None,
    list_: Annotated[bool, typer.Option("--list", help="List the scenarios and stop.")] = False,
    policy: Annotated[str, typer.Option(help="open-loop, exhaustive or pdn.")] = "pdn",
    alpha: Annotated[
        float, typer.Option(min=0.0, max=1.0, help="Weight of the uncertainty against the area.")
    ] = 1.0,
    seed: Annotated[int, typer.Option(min=0, help="Of all noise: same seed, same mission.")] = 1,
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the run (figures and course) as JSON.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON; no progress.")] = False,
    connect: Annotated[
        str,
        typer.Option(
            "-e", "--connect", metavar="ENDPOINT", envvar="PDN_CONNECT", help="Where the daemon listens."
        ),
    ] = DEFAULT_ENDPOINT,
    zenoh_config: Annotated[
        Path | None,
        typer.Option(
            "--zenoh-config", metavar="FILE", envvar="ZENOH_CONFIG", help="Zenoh configuration (JSON5)."
        ),
    ] = None,
    certificate: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            envvar="PDN_CERTIFICATE",
            help="This vehicle's certificate for tls/... (PEM); its key (.key) and ca.pem stand beside it.",
        ),
    ] = None,
    vehicle: Annotated[
        str, typer.Option(metavar="ID", envvar="PDN_VEHICLE", help="The vehicle's name.")
    ] = DEFAULT_VEHICLE,
    mission: Annotated[
        str | None, typer.Option(metavar="ID", help="The mission's name; made from the rest if not given.")
    ] = None,
    outbox: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            envvar="PDN_OUTBOX",
            help="Keep events in this folder until they are durable. Started again with the same --mission, "
            "the command brings what a killed one left, and stops.",
        ),
    ] = None,
    print_config: Annotated[
        bool, typer.Option("--print-config", help="Print the mission's configuration as JSON and stop.")
    ] = False,
    await_operator: Annotated[
        float | None,
        typer.Option(
            "--await-operator",
            metavar="SECONDS",
            min=0.0,
            help="Configure and start nothing: wait so long for an operator's running mission, and fly it.",
        ),
    ] = None,
) -> None:
    """See ``_HELP``."""
    from pdn.client.outbox_file import left_behind
    from pdn.sim.policies import POLICIES
    from pdn.sim.scenario import ScenarioError
    from pdn.sim.scenario_file import load

    if list_:
        _list(as_json)
        return
    if scenario is None:
        raise typer.BadParameter("name a scenario, or ask for --list", param_hint="SCENARIO")
    if policy not in POLICIES:
        raise typer.BadParameter(f"{policy!r} is none of {', '.join(POLICIES)}", param_hint="--policy")
    try:
        loaded = load(scenario)
    except ScenarioError as error:
        raise typer.BadParameter(str(error), param_hint="SCENARIO") from error
    name = mission or mission_name(loaded.name, policy, alpha, seed)
    if print_config:
        from pdn.sim.flight import mission_config

        print(json.dumps(mission_config(loaded, name, alpha)))
        return
    import pdn.client

    connected = partial(
        pdn.client.connect, vehicle, connect, config_file=zenoh_config, certificate=certificate, outbox=outbox
    )
    if outbox is not None and left_behind(outbox, vehicle, name):
        _deliver(connected, name, as_json)
        return
    _fly(loaded, policy, alpha, seed, out, as_json, connected, name, await_operator)


def _deliver(connected: Callable[[], Client], mission: str, as_json: bool) -> None:
    with connected() as client, client.mission_stream(mission, on_rejected="collect") as events:
        brought = {"mission": mission, "brought": events.resumed, "next_seq": events.next_seq}
    if as_json:
        print(json.dumps(brought))
        return
    print(
        f"{events.resumed} events that an interrupted flight of {mission} had left were brought; "
        f"{events.next_seq} events are with the planner. "
        "The simulated vehicle itself is gone: complete or abort the mission."
    )


def _list(as_json: bool) -> None:
    from pdn.sim.scenario_file import load, packaged

    entries = {name: load(name).description for name in packaged()}
    if as_json:
        print(json.dumps(entries))
        return
    for name, description in entries.items():
        print(f"{name:10} {description}")


def _fly(
    scenario: Scenario,
    policy: str,
    alpha: float,
    seed: int,
    out: Path | None,
    as_json: bool,
    connected: Callable[[], Client],
    mission: str,
    await_operator_s: float | None,
) -> None:
    from pdn.sim import flight, record, remote
    from pdn.sim.progress import shown

    with (
        connected() as client,
        remote.mission(client, scenario, mission, alpha)
        if await_operator_s is None
        else remote.operators_mission(client, await_operator_s) as planner,
        shown(f"{scenario.name} {policy}", visible=not as_json) as progress,
    ):
        run = flight.fly(scenario, policy, alpha, seed, planner, progress)
    if out is not None:
        record.save(run, out)
    if as_json:
        print(json.dumps(asdict(run.result)))
        return
    for key, value in asdict(run.result).items():
        print(f"{key:20} {value:.4g}" if isinstance(value, float) else f"{key:20} {value}")
    for line in run.refused:
        print(f"refused: {line}")
    if out is not None:
        print(f"the run is in {out}; draw it with: pdn plot {out} --figure mission")


def mission_name(scenario: str, policy: str, alpha: float, seed: int) -> str:
    """A name that is new for each flight, since a vehicle never uses one twice."""
    stem = "".join(c if c.isalnum() or c in "-_" else "-" for c in scenario.lower())
    weight = f"-a{round(100 * alpha):03d}" if policy == "pdn" else ""
    return f"{stem[:20]}-{policy}{weight}-s{seed}-{time.time_ns() // 1_000_000:x}"
