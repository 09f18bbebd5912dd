"""Opening a Zenoh session with the daemon, and saying what is probably wrong when that fails."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import zenoh

from .certificates import Certificate
from .diagnosis import DEFAULT_ENDPOINT, why_no_session
from .errors import ConnectionFailed

PUT_TIMEOUT_US = 3_600_000_000
"""How long a publication may wait for a slow link, us. Zenoh's default of 5 s then closes the link and
loses what was under way; the library has its own bounds for the caller.
"""

RECONNECT_FIRST_MS = 200
RECONNECT_LAST_MS = 2_000
"""Pauses between attempts to reach a daemon that went away, ms, doubling from first to last."""


def open_session(
    endpoint: str,
    timeout_s: float,
    config_file: str | Path | None = None,
    certificate: str | Path | None = None,
) -> tuple[zenoh.Session, Certificate | None]:
    """A session with the daemon at `endpoint`, as a Zenoh client, and the certificate that it shows; raises
    `ConnectionFailed`.

    `certificate` is the client's, with its key and the authority's beside it; without it the environment
    variable `PDN_CERTIFICATE` may name one. `config_file` is a Zenoh configuration (JSON5), or `ZENOH_CONFIG`
    names one. Mode, endpoint and scouting are set here in any case.
    """
    named = certificate or os.environ.get("PDN_CERTIFICATE")
    presented = Certificate.beside(named) if named else None
    config = _configuration(endpoint, timeout_s, config_file, presented)
    if presented is None:
        presented = Certificate.of_settings(json.loads(config.get_json("transport/link/tls")))
    elif endpoint.startswith("tls/"):
        presented.context()  # Files that are no use are told before the network is touched.
    try:
        return zenoh.open(config), presented
    except zenoh.ZError as error:
        raise ConnectionFailed(
            f"No connection to {endpoint}: {why_no_session(endpoint, presented)}"
        ) from error


def _configuration(
    endpoint: str, timeout_s: float, config_file: str | Path | None, certificate: Certificate | None
) -> zenoh.Config:
    source = config_file or os.environ.get("ZENOH_CONFIG")
    try:
        config = zenoh.Config.from_file(str(source)) if source else zenoh.Config()
    except zenoh.ZError as error:
        raise ConnectionFailed(
            f"The Zenoh configuration {source} cannot be read: {_first_line(error)}"
        ) from error
    settings: dict[str, Any] = {
        "mode": "client",
        "listen/endpoints": [],
        "connect/endpoints": [endpoint],
        "connect/timeout_ms": max(1, round(timeout_s * 1000)),
        "connect/exit_on_failure": True,
        "connect/retry": {
            "period_init_ms": RECONNECT_FIRST_MS,
            "period_max_ms": RECONNECT_LAST_MS,
            "period_increase_factor": 2,
        },
        "scouting/delay": 0,
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "transport/link/tx/queue/congestion_control/block/wait_before_close": PUT_TIMEOUT_US,
        # The daemon's own file may have been named: its certificates serve, its rules are not for clients.
        "qos/network": [],
        "access_control": {"enabled": False},
        **(certificate.settings() if certificate else {}),
    }
    try:
        for key, value in settings.items():
            config.insert_json5(key, json.dumps(value))
    except zenoh.ZError as error:
        raise ConnectionFailed(
            f"{endpoint!r} is no Zenoh endpoint; write it like {DEFAULT_ENDPOINT}, tls/host:7447 "
            "or unixsock-stream//run/pdn.sock"
        ) from error
    return config


def _first_line(error: Exception) -> str:
    return str(error).splitlines()[0] if str(error) else type(error).__name__
