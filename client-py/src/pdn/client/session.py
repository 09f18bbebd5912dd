"""Opening a Zenoh session with the daemon, and saying what is probably wrong when that fails."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import zenoh

from .certificates import Certificate
from .diagnosis import DEFAULT_ENDPOINT, why_no_session
from .errors import ConnectionFailed
from .lifetime import bounded, note_opening, require_unforked

PUT_TIMEOUT_US = 3_600_000_000
"""How long a publication may wait for a slow link, us. Zenoh's default of 5 s then closes the link and
loses what was under way; the library has its own bounds for the caller.
"""

LEASE_MS = 5_000
"""A daemon gives this client up after so long without a word of it, ms: frozen, or its link cut. Each side
tells the other how long its own silence may last, so this has to be said here; Zenoh's default is 10 s.
"""

KEEP_ALIVE = 4
"""Words a lease, when there is nothing else to say."""

ZENOH_LEASE_MS = 10_000
"""What Zenoh's configuration says where nobody has said anything, ms."""

OPEN_MARGIN_S = 5.0
"""How long after its time-out Zenoh may still take to return from opening a session, s."""

RECONNECT_FIRST_MS = 200
RECONNECT_LAST_MS = 2_000
"""Pauses between attempts to reach a daemon that went away, ms, doubling from first to last."""


def open_session(
    endpoint: str,
    timeout_s: float,
    config_file: str | Path | None = None,
    certificate: str | Path | None = None,
    others: Sequence[str] = (),
) -> tuple[zenoh.Session, Certificate | None]:
    """A session with the daemon at `endpoint`, as a Zenoh client, and the certificate that it shows; raises
    `ConnectionFailed` or `Forked`.

    `certificate` is the client's, with its key and the authority's beside it; without it the environment
    variable `PDN_CERTIFICATE` may name one. `config_file` is a Zenoh configuration (JSON5), or `ZENOH_CONFIG`
    names one. Mode, endpoints and scouting are set here in any case. When the link breaks later, Zenoh tries
    `endpoint` and the `others` in turn.
    """
    require_unforked()
    named = certificate or os.environ.get("PDN_CERTIFICATE")
    presented = Certificate.beside(named) if named else None
    config = _configuration([endpoint, *others], timeout_s, config_file, presented)
    if presented is None:
        presented = Certificate.of_settings(json.loads(config.get_json("transport/link/tls")))
    elif endpoint.startswith("tls/"):
        presented.context()  # Files that are no use are told before the network is touched.
    note_opening()
    try:
        session = bounded(lambda: zenoh.open(config), timeout_s + OPEN_MARGIN_S, zenoh.Session.close)
    except zenoh.ZError as error:
        raise ConnectionFailed(
            f"No connection to {endpoint}: {why_no_session(endpoint, presented)}"
        ) from error
    return session, presented


def _configuration(
    endpoints: Sequence[str],
    timeout_s: float,
    config_file: str | Path | None,
    certificate: Certificate | None,
) -> zenoh.Config:
    source = config_file or os.environ.get("ZENOH_CONFIG")
    try:
        config = zenoh.Config.from_file(str(source)) if source else zenoh.Config()
    except zenoh.ZError as error:
        raise ConnectionFailed(
            f"The Zenoh configuration {source} cannot be read: {_first_line(error)}"
        ) from error
    for key, value in (
        _settings(timeout_s) | _lease(config, source) | (certificate.settings() if certificate else {})
    ).items():
        config.insert_json5(key, json.dumps(value))
    for endpoint in endpoints:  # Each alone, to name the one that is none.
        try:
            config.insert_json5("connect/endpoints", json.dumps([endpoint]))
        except zenoh.ZError as error:
            raise ConnectionFailed(
                f"{endpoint!r} is no Zenoh endpoint; write it like {DEFAULT_ENDPOINT}, tls/host:7447 "
                "or unixsock-stream//run/pdn.sock"
            ) from error
    config.insert_json5("connect/endpoints", json.dumps(list(endpoints)))
    return config


def _settings(timeout_s: float) -> dict[str, Any]:
    return {
        "mode": "client",
        "listen/endpoints": [],
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
    }


def _lease(config: zenoh.Config, source: str | Path | None) -> dict[str, Any]:
    """The lease, where the file says nothing of it; what a file says counts, be it Zenoh's default."""
    tx = "transport/link/tx"
    given = json.loads(config.get_json(tx))
    if given["lease"] != ZENOH_LEASE_MS or (source and _names(Path(source), "lease")):
        return {}
    keep_alive = {} if source and _names(Path(source), "keep_alive") else {f"{tx}/keep_alive": KEEP_ALIVE}
    return {f"{tx}/lease": LEASE_MS, **keep_alive}


def _names(file: Path, key: str) -> bool:
    """Whether a JSON5 file has the key, comments left out."""
    token = r""""(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*'|//[^\n]*|/\*[\s\S]*?\*/"""
    text = re.sub(
        token,
        lambda found: "" if found[0].startswith("/") else found[0],
        file.read_text(encoding="utf-8", errors="replace"),
    )
    return re.search(rf"""["']?\b{key}["']?\s*:""", text) is not None


def _first_line(error: Exception) -> str:
    return str(error).split("\n", 1)[0] or type(error).__name__
