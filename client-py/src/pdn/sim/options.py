"""What the command ``pdn sim`` is asked for: the fields are its argument and options."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from pdn.client import DEFAULT_ENDPOINT, DEFAULT_VEHICLE, Client, connect, split_endpoints


@dataclass(frozen=True)
class SimOptions:
    """One flight and how it is told, or one of the other things that the command does and then stops."""

    scenario: Annotated[str | None, typer.Argument(help="Name or path.", show_default=False)] = None
    list_: Annotated[bool, typer.Option("--list", help="List the scenarios and stop.")] = False
    policy: Annotated[str, typer.Option(help="open-loop, exhaustive or pdn.")] = "pdn"
    alpha: Annotated[
        float, typer.Option(min=0.0, max=1.0, help="Weight of the uncertainty against the area.")
    ] = 1.0
    seed: Annotated[int, typer.Option(min=0, help="Of all noise: same seed, same mission.")] = 1
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the run (figures and course) as JSON.")
    ] = None
    as_json: Annotated[bool, typer.Option("--json", help="Print the figures as JSON; no progress.")] = False
    endpoint: Annotated[
        str,
        typer.Option(
            "-e", "--connect", metavar="ENDPOINT", envvar="PDN_CONNECT", help="Where the daemon listens."
        ),
    ] = DEFAULT_ENDPOINT
    zenoh_config: Annotated[
        Path | None,
        typer.Option(
            "--zenoh-config", metavar="FILE", envvar="ZENOH_CONFIG", help="Zenoh configuration (JSON5)."
        ),
    ] = None
    certificate: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            envvar="PDN_CERTIFICATE",
            help="This vehicle's certificate for tls/... (PEM); its key (.key) and ca.pem stand beside it.",
        ),
    ] = None
    vehicle: Annotated[str, typer.Option(metavar="ID", envvar="PDN_VEHICLE", help="The vehicle's name.")] = (
        DEFAULT_VEHICLE
    )
    mission: Annotated[
        str | None, typer.Option(metavar="ID", help="The mission's name; made from the rest if not given.")
    ] = None
    outbox: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            envvar="PDN_OUTBOX",
            help="Keep events in this folder until they are durable. Started again with the same --mission, "
            "the command brings what a killed one left, and stops.",
        ),
    ] = None
    print_config: Annotated[
        bool, typer.Option("--print-config", help="Print the mission's configuration as JSON and stop.")
    ] = False
    await_operator_s: Annotated[
        float | None,
        typer.Option(
            "--await-operator",
            metavar="SECONDS",
            min=0.0,
            help="Configure and start nothing: wait so long for an operator's running mission, and fly it.",
        ),
    ] = None

    def connect(self) -> Client:
        """A client for this vehicle; see `pdn.client.connect`."""
        return connect(
            self.vehicle,
            split_endpoints([self.endpoint]),
            config_file=self.zenoh_config,
            certificate=self.certificate,
            outbox=self.outbox,
        )


def command(run: Callable[[SimOptions], None]) -> Callable[..., None]:
    """The function that Typer makes the command of: it takes the fields of `SimOptions` and runs `run`."""

    def sim(**given: object) -> None:
        run(SimOptions(**given))  # type: ignore[arg-type]

    signature = inspect.signature(SimOptions, eval_str=True)
    # Typer makes the options from these.
    sim.__signature__ = signature  # type: ignore[attr-defined]
    sim.__annotations__ = {name: field.annotation for name, field in signature.parameters.items()}
    return sim
