"""The options that every command of the console has, and what a command makes of them."""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TypeVar

import typer

from pdn import wire
from pdn.client import DEFAULT_ENDPOINT, DEFAULT_VEHICLE, Client, connect, split_endpoints

from . import options

CONNECT_TIMEOUT_S = 5.0

M = TypeVar("M")


@dataclass(frozen=True)
class Planner:
    """Where the planner is, whose missions are meant, how answers are shown: the fields are the options."""

    endpoint: options.Endpoints = None
    vehicle: options.Vehicle = DEFAULT_VEHICLE
    zenoh_config: options.ZenohConfig = None
    certificate: options.Certificate = None
    as_json: options.Json = False
    timeout: options.TimeoutS = options.DEFAULT_TIMEOUT_S

    @contextmanager
    def connected(self, console: str | None = None) -> Iterator[Client]:
        """A client for the length of a command; `console` announces an operator's console of that name."""
        if not re.fullmatch(r"[a-z0-9_-]{1,64}", self.vehicle):
            raise typer.BadParameter(
                f"{self.vehicle!r} is no id of a vehicle: 1 to 64 of a-z, 0-9, - and _",
                param_hint="--vehicle",
            )
        endpoints = split_endpoints(self.endpoint or ()) or [DEFAULT_ENDPOINT]
        with connect(
            self.vehicle,
            endpoints,
            timeout_s=self.timeout,
            connect_timeout_s=min(self.timeout, CONNECT_TIMEOUT_S),
            config_file=self.zenoh_config,
            certificate=self.certificate,
            console=console,
        ) as client:
            if client.endpoint != endpoints[0]:
                print(f"connected to {client.endpoint}; {endpoints[0]} does not serve", file=sys.stderr)
            yield client

    def show(self, message: M, print_text: Callable[[M], None]) -> None:
        """Prints an answer: for programs as one line of JSON in the form of the wire, else in words."""
        if self.as_json:
            print(wire.to_json(message))
        else:
            print_text(message)


def of_planner(command: Callable[..., None]) -> Callable[..., None]:
    """A command of the console from a function that takes a `Planner` first: the planner's options are added.

    An option that the function has under the same name counts instead, and reaches the planner as well.
    """
    _, *own = inspect.signature(command, eval_str=True).parameters.values()
    shared = inspect.signature(Planner, eval_str=True).parameters
    names = {parameter.name for parameter in own}

    def run(**given: object) -> None:
        planner = Planner(**{name: given[name] for name in shared})  # type: ignore[arg-type]
        command(planner, **{name: given[name] for name in names})

    added = [parameter for name, parameter in shared.items() if name not in names]
    # Typer makes the options from these.
    run.__signature__ = inspect.Signature([*own, *added])  # type: ignore[attr-defined]
    run.__annotations__ = {parameter.name: parameter.annotation for parameter in (*own, *added)}
    run.__name__, run.__doc__ = command.__name__, command.__doc__
    return run
