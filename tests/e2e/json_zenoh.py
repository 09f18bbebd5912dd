"""A vehicle that knows of pdn only what the contract's page says: JSON over Zenoh, and nothing of ours."""

import json
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import zenoh

Json = dict[str, Any]


class ErrorReply(Exception):
    """The service refused a query."""

    def __init__(self, problem: Json) -> None:
        super().__init__(f"{problem['code']}: {problem['message']}")
        self.code = problem["code"]
        self.problem = problem


class JsonVehicle:
    """Publishes events and asks questions for one vehicle and one mission."""

    def __init__(self, session: zenoh.Session, vehicle: str, mission: str) -> None:
        self.session = session
        self.root = f"pdn/{vehicle}/v1"
        self.mission = mission
        self.seq = 0
        self.events: list[tuple[str, Json]] = []

    def ask(self, key: str, payload: Json | None = None, timeout_s: float = 30.0, **parameters: Any) -> Json:
        """One query and its reply, as JSON; empty reply streams are asked again until the time-out."""
        end = time.monotonic() + timeout_s
        selector = f"{self.root}/{key}" + ("?" if parameters else "")
        selector += ";".join(f"{name}={value}" for name, value in parameters.items())
        body = (
            {}
            if payload is None
            else {"payload": json.dumps(payload), "encoding": zenoh.Encoding.APPLICATION_JSON}
        )
        while True:
            for reply in self.session.get(selector, timeout=max(0.1, end - time.monotonic()), **body):
                if reply.ok is not None:
                    return json.loads(reply.ok.payload.to_bytes())
                raise ErrorReply(json.loads(reply.err.payload.to_bytes()))
            assert time.monotonic() < end, f"no reply to {selector} in {timeout_s} s"
            time.sleep(0.02)

    def put(self, key: str, payload: bytes, encoding: zenoh.Encoding) -> None:
        """Publishes raw bytes on a key below the vehicle's root, without congestion drops."""
        self.session.put(
            f"{self.root}/{key}", payload, encoding=encoding, congestion_control=zenoh.CongestionControl.BLOCK
        )

    def event(self, kind: str, body: Json) -> int:
        """Publishes one event with the next seq, which it returns."""
        seq, self.seq = self.seq, self.seq + 1
        message = {"mission": self.mission, "seq": seq, "stamp_ns": time.time_ns(), **body}
        self.events.append((kind, message))
        self.put(f"in/{kind}", json.dumps(message).encode(), zenoh.Encoding.APPLICATION_JSON)
        return seq

    def wait_applied(self) -> Json:
        """The mission's state once every event sent so far is applied."""
        return self.ask("rpc/mission", after=self.seq - 1)


@contextmanager
def open_session(endpoint: str) -> Iterator[zenoh.Session]:
    """A Zenoh session in client mode at the endpoint."""
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([endpoint]))
    config.insert_json5("scouting/multicast/enabled", "false")
    with zenoh.open(config) as session:
        yield session
