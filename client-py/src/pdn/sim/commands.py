"""The command ``pdn sim``: fly one scenario against a running daemon."""

from __future__ import annotations

import json
import time
from dataclasses import asdict
from typing import TYPE_CHECKING

import typer

from pdn.sim.options import SimOptions, command

if TYPE_CHECKING:
    from pdn.sim.record import Run
    from pdn.sim.scenario import Scenario


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("sim", help=_HELP)(command(sim))


_HELP = """Fly a simulated vehicle through a scenario, against a running daemon.

SCENARIO is the name of one that comes with pdn (see --list) or the path of a TOML file of one's own. The
vehicle configures a mission, starts it, flies the survey by its estimate under the policy, and completes the
mission; with --await-operator it leaves configuring and starting to an operator. At the end the mission's
figures are printed; --out keeps the whole course for `pdn plot`."""


def sim(options: SimOptions) -> None:
    """See ``_HELP``."""
    from pdn.client.outbox_file import outbox_exists
    from pdn.sim.flight import mission_config

    if options.list_:
        _list(options.as_json)
        return
    scenario = _scenario(options)
    mission = options.mission or mission_name(scenario.name, options.policy, options.alpha, options.seed)
    if options.print_config:
        print(json.dumps(mission_config(scenario, mission, options.alpha)))
    elif options.outbox is not None and outbox_exists(options.outbox, options.vehicle, mission):
        _deliver(options, mission)
    else:
        run = _fly(options, scenario, mission)
        _report(options, run)


def _scenario(options: SimOptions) -> Scenario:
    """The scenario that was asked for; raises `typer.BadParameter` if it or the policy is none."""
    from pdn.sim.policies import POLICIES
    from pdn.sim.scenario import ScenarioError
    from pdn.sim.scenario_file import load

    if options.scenario is None:
        raise typer.BadParameter("name a scenario, or ask for --list", param_hint="SCENARIO")
    if options.policy not in POLICIES:
        known = ", ".join(POLICIES)
        raise typer.BadParameter(f"{options.policy!r} is none of {known}", param_hint="--policy")
    try:
        return load(options.scenario)
    except ScenarioError as error:
        raise typer.BadParameter(str(error), param_hint="SCENARIO") from error


def _list(as_json: bool) -> None:
    from pdn.sim.scenario_file import load, packaged

    entries = {name: load(name).description for name in packaged()}
    if as_json:
        print(json.dumps(entries))
        return
    for name, description in entries.items():
        print(f"{name:10} {description}")


def _deliver(options: SimOptions, mission: str) -> None:
    """Send what an interrupted flight left in its outbox."""
    with options.connect() as client, client.mission_stream(mission, on_rejected="collect") as events:
        brought = {"mission": mission, "brought": events.resumed, "next_seq": events.next_seq}
    if options.as_json:
        print(json.dumps(brought))
        return
    print(
        f"{events.resumed} events that an interrupted flight of {mission} had left were brought; "
        f"{events.next_seq} events are with the planner. "
        "The simulated vehicle itself is gone: complete or abort the mission."
    )


def _fly(options: SimOptions, scenario: Scenario, mission: str) -> Run:
    from pdn.sim import flight, remote
    from pdn.sim.progress import progress_bar

    with (
        options.connect() as client,
        remote.mission(client, scenario, mission, options.alpha)
        if options.await_operator_s is None
        else remote.operators_mission(client, options.await_operator_s) as planner,
        progress_bar(f"{scenario.name} {options.policy}", visible=not options.as_json) as progress,
    ):
        return flight.fly(scenario, options.policy, options.alpha, options.seed, planner, progress)


def _report(options: SimOptions, run: Run) -> None:
    from pdn.sim import record

    if options.out is not None:
        record.save(run, options.out)
    if options.as_json:
        print(json.dumps(asdict(run.result)))
        return
    for key, value in asdict(run.result).items():
        print(f"{key:20} {value:.4g}" if isinstance(value, float) else f"{key:20} {value}")
    for line in run.refused:
        print(f"refused: {line}")
    if options.out is not None:
        print(f"the run is in {options.out}; draw it with: pdn plot {options.out} --figure mission")


def mission_name(scenario: str, policy: str, alpha: float, seed: int) -> str:
    """A name that is new for each flight, since a vehicle never uses one twice."""
    stem = "".join(c if c.isalnum() or c in "-_" else "-" for c in scenario.lower())
    weight = f"-a{round(100 * alpha):03d}" if policy == "pdn" else ""
    return f"{stem[:20]}-{policy}{weight}-s{seed}-{time.time_ns() // 1_000_000:x}"
