"""How soon the daemon misses a client that is frozen: the client's own lease decides, not the daemon's."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest
import zenoh
from running import Daemon

from pdn.client.session import LEASE_MS, ZENOH_LEASE_MS, _configuration

WAIT_S = 60.0

OURS = """
import sys, time
from pdn.client import connect
client = connect("ours", sys.argv[1])
client.announce("pdn/ours/v1/alive/vehicle")
print("ready", flush=True)
time.sleep(600)
"""
OTHERS = """
import json, sys, time, zenoh
config = zenoh.Config()
settings = {"mode": "client", "connect/endpoints": [sys.argv[1]], "scouting/multicast/enabled": False}
for key, value in settings.items():
    config.insert_json5(key, json.dumps(value))
session = zenoh.open(config)
token = session.liveliness().declare_token("pdn/others/v1/alive/vehicle")
print("ready", flush=True)
time.sleep(600)
"""


def test_a_frozen_client_is_missed_before_one_of_zenohs_own_lease(daemon: Daemon) -> None:
    """Both are frozen at once, and which is missed first is no matter of the machine's load: alone on it ours
    was missed after 4.8 s, the other after 8.5 s.
    """
    config = zenoh.Config()
    for key, value in {"mode": "client", "connect/endpoints": [daemon.endpoint]}.items():
        config.insert_json5(key, json.dumps(value))
    present: list[str] = []
    gone: list[str] = []
    both_present, both_gone = threading.Event(), threading.Event()

    def heard(sample: zenoh.Sample) -> None:
        names, both = (gone, both_gone) if sample.kind == zenoh.SampleKind.DELETE else (present, both_present)
        names.append(str(sample.key_expr).split("/")[1])
        if len(names) == 2:
            both.set()

    clients = []
    with zenoh.open(config) as session:
        watching = session.liveliness().declare_subscriber("pdn/*/v1/alive/vehicle", heard, history=True)
        try:
            for program in (OTHERS, OURS):
                command = [sys.executable, "-c", program, daemon.endpoint]
                clients.append(subprocess.Popen(command, stdout=subprocess.PIPE, text=True))
            for client in clients:
                assert client.stdout is not None
                assert client.stdout.readline() == "ready\n"
            # What is frozen before its token has arrived is never missed.
            assert both_present.wait(WAIT_S)
            for client in clients:
                client.send_signal(signal.SIGSTOP)
            assert both_gone.wait(WAIT_S)
        finally:
            for client in clients:
                client.kill()
                client.wait()
            watching.undeclare()  # type: ignore[no-untyped-call]
    assert gone == ["ours", "others"]


@pytest.mark.parametrize(
    ("text", "lease_ms"),
    [
        ("{}", LEASE_MS),
        ("{ // lease: 7000\n }", LEASE_MS),
        ("{ transport: { link: { tx: { lease: 7000 } } } }", 7000),
        ("{ transport: { link: { tx: { lease: 10000 } } } }", ZENOH_LEASE_MS),
        ('{ "transport": { "link": { "tx": { "lease": 10000 } } } }', ZENOH_LEASE_MS),
    ],
)
def test_what_a_configuration_says_of_the_lease_counts(tmp_path: Path, text: str, lease_ms: int) -> None:
    file = tmp_path / "zenoh.json5"
    file.write_text(text)
    config = _configuration(["tcp/127.0.0.1:7447"], 1.0, file, None)
    assert json.loads(config.get_json("transport/link/tx/lease")) == lease_ms
