"""Options that several commands share, and what a command makes of them."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pdn.client import DEFAULT_ENDPOINT

DEFAULT_TIMEOUT_S = 10.0

Endpoints = Annotated[
    list[str] | None,
    typer.Option(
        "-e",
        "--connect",
        metavar="ENDPOINT",
        envvar="PDN_CONNECT",
        show_default=DEFAULT_ENDPOINT,
        help="Where the daemon listens, as a Zenoh endpoint. More than one (given again, or after commas) "
        "are tried in turn.",
    ),
]
Vehicle = Annotated[
    str,
    typer.Option("--vehicle", metavar="ID", envvar="PDN_VEHICLE", help="Whose missions: a-z, 0-9, - and _."),
]
ZenohConfig = Annotated[
    Path | None,
    typer.Option(
        "--zenoh-config",
        metavar="FILE",
        envvar="ZENOH_CONFIG",
        help="Zenoh configuration (JSON5).",
    ),
]
Certificate = Annotated[
    Path | None,
    typer.Option(
        "--certificate",
        metavar="FILE",
        envvar="PDN_CERTIFICATE",
        help="This client's certificate for tls/... (PEM); its key (.key) and ca.pem stand beside it.",
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON for programs, in the form of the wire.")]
TimeoutS = Annotated[
    float, typer.Option("--timeout", metavar="SECONDS", min=0.1, help="Longest wait for an answer.")
]
Mission = Annotated[
    str | None, typer.Option("--mission", metavar="ID", help="Another mission than the one configured last.")
]
Reason = Annotated[str, typer.Option("--reason", metavar="TEXT", help="Why, for whoever reads the record.")]
After = Annotated[
    int | None,
    typer.Option("--after", metavar="SEQ", min=0, help="Answer once the event of this number is applied."),
]

EXIT_CODES = (
    """Exit codes: 0 done, 1 refused or failed, 2 wrong usage, 3 no connection or no planner, 4 timed out."""
)
