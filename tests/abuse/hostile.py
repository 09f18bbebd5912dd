"""Clients that do what no client should; each is a program of its own: `hostile.py NAME ENDPOINT [ARGUMENT]`.

Each prints a line once it has begun, and goes on until it is killed or has done what it came for.
"""

import json
import socket
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

import zenoh

sys.path.insert(0, str(Path(__file__).parents[1] / "e2e"))
from json_zenoh import ErrorReply, JsonVehicle, open_session
from survey import config

JSON = zenoh.Encoding.APPLICATION_JSON
FOR_EVER = threading.Event()


def begun(word: object = "begun") -> None:
    print(word, flush=True)


def never_reads(endpoint: str, pattern: str) -> None:
    """Subscribes and blocks in the first callback: from then on nothing is read from the living link."""
    with open_session(endpoint) as session:

        def block(_: zenoh.Sample) -> None:
            begun("blocked")
            FOR_EVER.wait()

        session.declare_subscriber(pattern, block)
        begun()
        FOR_EVER.wait()


def listens(endpoint: str, pattern: str) -> None:
    """Subscribes as anyone may; to be stopped by a signal."""
    with open_session(endpoint) as session:
        session.declare_subscriber(pattern, lambda _: None)
        begun()
        FOR_EVER.wait()


def says_nothing(endpoint: str, count: str) -> None:
    """Opens TCP connections and is silent on them."""
    host, _, port = endpoint.removeprefix("tcp/").rpartition(":")
    sockets = [socket.create_connection((host, int(port))) for _ in range(int(count))]
    begun(len(sockets))
    FOR_EVER.wait()


def asks_and_never_reads(endpoint: str, vehicle: str) -> None:
    """Asks for the whole graph again and again and reads no answer."""
    with open_session(endpoint) as session:

        def block(_: zenoh.Reply) -> None:
            FOR_EVER.wait()

        begun()
        while True:
            session.get(f"pdn/{vehicle}/v1/rpc/graph?marginals=true", block, timeout=60.0)
            time.sleep(0.001)


def sends_10_mb(endpoint: str, vehicle: str) -> None:
    """Events, questions and commands of 10 MB each."""
    with open_session(endpoint) as session:
        payload = b"[" * 10_000_000
        begun()
        for _ in range(20):
            put(session, f"pdn/{vehicle}/v1/in/keyframe", payload)
            for key in ("rpc/evaluate", "op/configure"):
                for _ in session.get(f"pdn/{vehicle}/v1/{key}", payload=payload, encoding=JSON, timeout=10.0):
                    pass
        begun("done")


def sends_rubbish(endpoint: str, vehicle: str, count: str) -> None:
    """So many messages that cannot be read, under keys that exist and keys that do not."""
    with open_session(endpoint) as session:
        begun()
        bincode = zenoh.Encoding("application/octet-stream").with_schema("pdn.v1.Factor+bincode")
        head = {"mission": "good-1", "seq": 10**9, "stamp_ns": 0}
        for number in range(int(count)):
            kind = number % 5
            if kind == 0:
                put(session, f"pdn/{vehicle}/v1/in/factor", b"\xff" * (number % 500), bincode)
            elif kind == 1:
                put(session, f"pdn/{vehicle}/v1/in/keyframe", b"{" * (number % 500))
            elif kind == 2:
                put(session, f"pdn/{vehicle}/v1/in/sonar", b"{}")
            elif kind == 3:
                put(session, f"pdn/nobody{number % 1000}/v1/in/link", json.dumps(head).encode())
            else:
                put(session, f"pdn/{vehicle}/v1/in/link", json.dumps({**head, "from": -1}).encode())
        begun("done")


def sends_far_ahead(endpoint: str, vehicle: str) -> None:
    """Large events of another's mission, far beyond what has come."""
    with open_session(endpoint) as session:
        begun()
        words = json.dumps({"words": [[index, 1] for index in range(50_000)]})
        for seq in range(5_000_000, 5_000_200):
            head = f'"mission":"good-1","seq":{seq},"stamp_ns":0,"id":{seq},"pose":null,"camera":null'
            message = f'{{{head},"appearance":{words}}}'
            put(session, f"pdn/{vehicle}/v1/in/keyframe", message.encode())
        small = '{"mission":"good-1","seq":%d,"stamp_ns":0,"from":1,"to":2,"registered":true}'
        for seq in range(6_000_000, 6_005_000):
            put(session, f"pdn/{vehicle}/v1/in/link", (small % seq).encode())
        begun("done")


def configures(endpoint: str, what: str) -> None:
    """A thousand vehicles, or a thousand missions of one vehicle; prints the codes of the answers."""
    with open_session(endpoint) as session:
        begun()
        codes: dict[str, int] = {}
        for number in range(1000):
            vehicle = f"hostile-{number}" if what == "vehicles" else "hostile"
            code = "ok"
            try:
                JsonVehicle(session, vehicle, "").ask("op/configure", config(f"m-{number}"))
            except ErrorReply as refusal:
                code = refusal.code
            codes[code] = codes.get(code, 0) + 1
        begun(json.dumps(codes))


def put(session: zenoh.Session, key: str, payload: bytes, encoding: zenoh.Encoding = JSON) -> None:
    session.put(key, payload, encoding=encoding, congestion_control=zenoh.CongestionControl.BLOCK)


CLIENTS: dict[str, Callable[..., None]] = {
    client.__name__: client
    for client in (
        never_reads,
        listens,
        says_nothing,
        asks_and_never_reads,
        sends_10_mb,
        sends_rubbish,
        sends_far_ahead,
        configures,
    )
}

if __name__ == "__main__":
    CLIENTS[sys.argv[1]](*sys.argv[2:])
