"""A daemon as `deploy/secured` sets it up, and sessions with it as any client could open them, without our
library's politeness.
"""

import json
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import zenoh

from conftest import ROOT, Daemon, start_daemon

REMOTE = zenoh.Locality.REMOTE
"""What a session says is heard within its own program in any case; what matters is who else does."""

SHIPPED = ROOT / "deploy/secured"
ROLES = ("vehicle", "operator", "observer")
HULL = "pdn/hull/v1"


@dataclass
class Secured:
    """The daemon, the certificates, and who is connected."""

    daemon: Daemon
    certificates: Path
    sessions: dict[str, zenoh.Session]

    def ask(self, key: str) -> dict:
        """What the daemon says to an operator."""
        for reply in self.sessions["operator"].get(f"{HULL}/{key}", timeout=10.0):
            return json.loads(reply.ok.payload.to_bytes())
        raise AssertionError(f"{key} is not answered")


def make_certificates(folder: Path, *arguments: str) -> Path:
    """Runs the shipped script."""
    subprocess.run([SHIPPED / "make-certificates.sh", folder, *arguments], check=True, stdout=subprocess.PIPE)
    return folder


def shipped_configuration(certificates: Path, folder: Path) -> Path:
    """The shipped configuration with these certificates."""
    text = (SHIPPED / "zenoh.json5").read_text()
    assert "/etc/pdn/tls/" in text
    path = folder / "zenoh.json5"
    path.write_text(text.replace("/etc/pdn/tls", str(certificates)))
    return path


def start_secured(certificates: Path, folder: Path, *arguments: str) -> Daemon:
    configuration = shipped_configuration(certificates, folder)
    options = ("--config", str(SHIPPED / "pdnd.toml"), "--zenoh-config", str(configuration))
    return start_daemon(folder, *options, *arguments, protocol="tls")


@contextmanager
def session_as(
    name: str, certificates: Path, endpoint: str, authority: Path | None = None
) -> Iterator[zenoh.Session]:
    """A session of whoever has that certificate; of nobody if the name is empty."""
    config = zenoh.Config()
    tls = {"root_ca_certificate": str(authority or certificates / "ca.pem"), "enable_mtls": bool(name)}
    if name:
        tls |= {
            "connect_certificate": str(certificates / f"{name}.pem"),
            "connect_private_key": str(certificates / f"{name}.key"),
        }
    for key, value in {
        "mode": "client",
        "connect/endpoints": [endpoint],
        "connect/timeout_ms": 1500,
        "connect/exit_on_failure": True,
        "scouting/multicast/enabled": False,
        "transport/link/tls": tls,
    }.items():
        config.insert_json5(key, json.dumps(value))
    with zenoh.open(config) as session:
        yield session


def answers(
    session: zenoh.Session, selector: str, payload: object = None, timeout_s: float = 5.0
) -> list[str]:
    """What comes back over the network: "answered", or the code of a refusal; nothing if nobody heard it."""
    body = (
        {}
        if payload is None
        else {"payload": json.dumps(payload), "encoding": zenoh.Encoding.APPLICATION_JSON}
    )
    replies = session.get(
        selector,
        timeout=timeout_s,
        consolidation=zenoh.ConsolidationMode.NONE,
        allowed_destination=REMOTE,
        **body,
    )
    return [
        "answered" if reply.ok is not None else json.loads(reply.err.payload.to_bytes())["code"]
        for reply in replies
    ]
