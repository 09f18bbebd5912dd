"""Opening a Zenoh session with the daemon, and saying what is probably wrong when that fails."""

from __future__ import annotations

import json
import os
import socket
from pathlib import Path

import zenoh

from .errors import ConnectionFailed

DEFAULT_ENDPOINT = "tcp/127.0.0.1:7447"
DEFAULT_VEHICLE = "vehicle"
"""Who is meant on the command line where no vehicle is named."""
"""Where `pdnd` listens when nothing else is said."""

PUT_MAY_BLOCK_US = 3_600_000_000
"""How long a publication may wait for a slow link, us. Zenoh's default of 5 s then closes the link and
loses what was under way; the library has its own bounds for the caller.
"""

RECONNECT_FIRST_MS = 200
RECONNECT_LAST_MS = 2_000
"""Pauses between attempts to reach a daemon that went away, ms, doubling from first to last."""


def open_session(endpoint: str, timeout_s: float, config_file: str | Path | None = None) -> zenoh.Session:
    """A session with the daemon at `endpoint`, as a Zenoh client; raises `ConnectionFailed`.

    `config_file` is a Zenoh configuration (JSON5), for instance with certificates; without it the environment
    variable `ZENOH_CONFIG` may name one. Mode, endpoint and scouting are set here in any case.
    """
    config = _configuration(endpoint, timeout_s, config_file)
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        raise ConnectionFailed(f"No connection to {endpoint}: {_probable_cause(endpoint)}") from error


def _configuration(endpoint: str, timeout_s: float, config_file: str | Path | None) -> zenoh.Config:
    source = config_file or os.environ.get("ZENOH_CONFIG")
    try:
        config = zenoh.Config.from_file(str(source)) if source else zenoh.Config()
    except zenoh.ZError as error:
        raise ConnectionFailed(
            f"The Zenoh configuration {source} cannot be read: {_first_line(error)}"
        ) from error
    settings = {
        "mode": "client",
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
        "transport/link/tx/queue/congestion_control/block/wait_before_close": PUT_MAY_BLOCK_US,
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


def _probable_cause(endpoint: str) -> str:
    """One sentence on why a session could not be opened, found by a plain socket."""
    protocol, _, address = endpoint.partition("/")
    address = address.split("?")[0].split("#")[0]
    if protocol == "unixsock-stream":
        if not Path(address).exists():
            return f"the socket {address} does not exist; is pdnd running, and does it listen there?"
        return "nobody answers on the socket; is pdnd running, and may this user open the socket?"
    host, _, port = address.rpartition(":")
    if protocol not in ("tcp", "tls") or not port.isdigit():
        return f"is that the address? The usual form is {DEFAULT_ENDPOINT}."
    host = host.strip("[]")
    try:
        socket.create_connection((host, int(port)), timeout=1.0).close()
    except ConnectionRefusedError:
        return "nothing listens there. Is the daemon running (start it with `pdnd`), and is the port right?"
    except socket.gaierror:
        return f"the host name {host!r} is not known."
    except TimeoutError:
        return f"{host} does not answer; is the address right, and does a firewall stand between?"
    except OSError as error:
        return f"{error.strerror or error}."
    if protocol == "tls":
        return (
            "the port is open but no secure session came about: check that the certificate names this "
            "address, that its authority is the one configured here, and that a client certificate is set "
            "if the daemon asks for one."
        )
    return "the port is open, but what listens there does not speak plain Zenoh; is it pdnd, and without TLS?"


def _first_line(error: Exception) -> str:
    return str(error).splitlines()[0] if str(error) else type(error).__name__
