"""From the options of a command to a client, and from an answer to standard output."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import typer

from pdn import wire
from pdn.client import Client, connect

CONNECT_TIMEOUT_S = 5.0


@contextmanager
def connected(
    endpoint: str,
    vehicle: str,
    timeout_s: float,
    zenoh_config: Path | None = None,
    certificate: Path | None = None,
    console: str | None = None,
) -> Iterator[Client]:
    """A client for the length of a command; `console` announces an operator's console of that name."""
    if not re.fullmatch(r"[a-z0-9_-]{1,64}", vehicle):
        raise typer.BadParameter(
            f"{vehicle!r} is no id of a vehicle: 1 to 64 of a-z, 0-9, - and _", param_hint="--vehicle"
        )
    with connect(
        vehicle,
        endpoint,
        timeout_s=timeout_s,
        connect_timeout_s=min(timeout_s, CONNECT_TIMEOUT_S),
        config_file=zenoh_config,
        certificate=certificate,
        console=console,
    ) as client:
        yield client


def print_json(message: object) -> None:
    """One line of JSON in the form of the wire."""
    print(wire.to_json(message))
