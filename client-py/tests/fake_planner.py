"""A planner for tests of the client: it speaks the contract over Zenoh, plans nothing, and fails in the
ways asked for.

It keeps what it has applied across `restart`, cut back to what was durable, as a daemon with a journal
does.
"""

from __future__ import annotations

import json
import queue
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import zenoh

from pdn import wire

Fate = Callable[[int, int], str]
"""What becomes of a copy of an event (seq, copies seen): "apply", "lose", "repeat", "refuse" or "refuse
silently".
"""


def plain_fate(seq: int, copy: int) -> str:
    del seq, copy
    return "apply"


@dataclass
class Applied:
    """What the fake has taken in of one mission."""

    events: list[wire.Keyframe | wire.Factor | wire.LinkOutcome] = field(default_factory=list)
    rejected: int = 0


EVENTS = {
    wire.Topic.IN_KEYFRAME: wire.Keyframe,
    wire.Topic.IN_FACTOR: wire.Factor,
    wire.Topic.IN_LINK: wire.LinkOutcome,
}


class FakePlanner:
    """An embedded router with one vehicle's planner behind it."""

    def __init__(self, endpoint: str, vehicle: str = "auv") -> None:
        self.endpoint = endpoint
        self.vehicle = vehicle
        self.fate: Fate = plain_fate
        self.durable_lag = 0
        self.acknowledges = True
        self.refusal: wire.Problem | None = None
        self.hears_events = True
        self.silent_topics: set[wire.Topic] = set()
        self.frozen = threading.Event()
        self.encoding: str | None = None
        self.asked: list[tuple[str, dict[str, str]]] = []
        self.config: wire.MissionConfig | None = None
        self.phase = wire.Phase.CONFIGURED
        self.applied = Applied()
        self.copies: dict[int, int] = {}
        self._lock = threading.Lock()
        self._work: queue.Queue[Callable[[], None] | None] = queue.Queue()
        self._worker: threading.Thread | None = None
        self._session: zenoh.Session | None = None

    def start(self) -> None:
        """Listens, and announces itself last."""
        config = zenoh.Config()
        for key, value in {
            "mode": "router",
            "listen/endpoints": [self.endpoint],
            "scouting/delay": 0,
            "scouting/multicast/enabled": False,
            "scouting/gossip/enabled": False,
        }.items():
            config.insert_json5(key, json.dumps(value))
        session = self._session = zenoh.open(config)
        self._work = queue.Queue()
        self._worker = threading.Thread(target=self._run, args=(self._work,), daemon=True)
        self._worker.start()
        work = self._work
        for topic in EVENTS if self.hears_events else ():
            session.declare_subscriber(
                wire.key(self.vehicle, topic),
                lambda sample, topic=topic: work.put(lambda: self._event(topic, sample)),
            )
        for topic in wire.Topic:
            if topic.startswith(("rpc/", "op/")):
                session.declare_queryable(
                    wire.key(self.vehicle, topic),
                    lambda query, topic=topic: work.put(lambda: self._query(topic, query)),
                )
        self._token = session.liveliness().declare_token(wire.key(self.vehicle, wire.Topic.ALIVE_PLANNER))

    def stop(self) -> None:
        """Goes away as a killed process does; what was not durable is forgotten."""
        session, self._session = self._session, None
        if session is not None:
            session.close()
            self._work.put(None)
        if self._worker is not None:
            self._worker.join(5.0)
        with self._lock:
            del self.applied.events[self.durable_seq :]

    @property
    def next_seq(self) -> int:
        return len(self.applied.events)

    @property
    def durable_seq(self) -> int:
        return max(0, self.next_seq - self.durable_lag)

    def persist(self) -> None:
        """Makes durable what is applied, and says so."""
        self.durable_lag = 0
        self._acknowledge()

    def publish(self, topic: wire.Topic, message: object) -> None:
        assert self._session is not None
        kind = type(message)
        self._session.put(
            wire.key(self.vehicle, topic),
            wire.encode(message, wire.Format.JSON),
            encoding=wire.encoding(kind, wire.Format.JSON),
            congestion_control=zenoh.CongestionControl.BLOCK,
        )

    def state(self) -> wire.MissionState:
        assert self.config is not None
        return wire.MissionState(
            mission=self.config.mission,
            phase=self.phase,
            robot=None,
            reason="as the test wants it",
            since_ns=0,
            config=self.config,
            next_seq=self.next_seq,
            keyframes=sum(isinstance(event, wire.Keyframe) for event in self.applied.events),
            factors=sum(isinstance(event, wire.Factor) for event in self.applied.events),
            covered_m2=25.0,
            target_m2=100.0,
            uncertainty=0.5,
            decisions=0,
            revisits=0,
            estimated_remaining_m=None,
            health=wire.Health(ok=True, findings=()),
        )

    def _run(self, work: queue.Queue[Callable[[], None] | None]) -> None:
        while (task := work.get()) is not None:
            if self._session is not None:
                try:
                    task()
                except zenoh.ZError:
                    continue

    def _event(self, topic: wire.Topic, sample: zenoh.Sample) -> None:
        kind = EVENTS[topic]
        event = wire.decode(kind, sample.payload.to_bytes(), wire.format_of(kind, str(sample.encoding)))
        copy = self.copies[event.seq] = self.copies.get(event.seq, 0) + 1
        match self.fate(event.seq, copy):
            case "apply":
                self._apply(event)
            case "repeat":
                self._apply(event)
                self._apply(event)
            case "refuse" | "refuse silently" as fate:
                if self._apply(event):
                    self.applied.rejected += 1
                    if fate == "refuse":
                        problem = wire.Problem(code="not_unit", message="Normalise it.", seq=event.seq)
                        self.publish(wire.Topic.OUT_REJECTED, problem)
        self._acknowledge()

    def _apply(self, event: wire.Keyframe | wire.Factor | wire.LinkOutcome) -> bool:
        with self._lock:
            due = event.seq == self.next_seq
            if due:
                self.applied.events.append(event)
            return due

    def _acknowledge(self) -> None:
        if self.acknowledges and self.config is not None:
            ack = wire.Ack(mission=self.config.mission, next_seq=self.next_seq, durable_seq=self.durable_seq)
            self.publish(wire.Topic.OUT_ACK, ack)

    def _query(self, topic: wire.Topic, query: zenoh.Query) -> None:
        with query:
            parameters = dict(item.split("=", 1) for item in str(query.parameters).split(";") if item)
            self.asked.append((str(topic), parameters))
            if topic in self.silent_topics:
                return
            while self.frozen.is_set():
                time.sleep(0.01)
            reply = self.refusal or self._answer(topic, query)
            if isinstance(reply, wire.Problem):
                query.reply_err(wire.encode(reply, wire.Format.JSON), encoding="application/json")
                return
            form = wire.Format.BINCODE if parameters.get("encoding") == "bincode" else wire.Format.JSON
            query.reply(
                str(query.key_expr),
                wire.encode(reply, form),
                encoding=self.encoding or wire.encoding(type(reply), form),
            )

    def _answer(self, topic: wire.Topic, query: zenoh.Query) -> object:
        if topic is wire.Topic.OP_CONFIGURE:
            assert query.payload is not None
            form = wire.format_of(wire.MissionConfig, str(query.encoding))
            self.config = wire.decode(wire.MissionConfig, query.payload.to_bytes(), form)
            self.phase, self.applied, self.copies = wire.Phase.CONFIGURED, Applied(), {}
            return self.state()
        if self.config is None:
            return wire.Problem(code="no_mission", message="Configure one with op/configure.", seq=None)
        match topic:
            case wire.Topic.OP_START | wire.Topic.OP_RESUME:
                if self.phase is wire.Phase.RUNNING:
                    return wire.Problem(code="illegal_transition", message="It is running.", seq=None)
                self.phase = wire.Phase.RUNNING
            case wire.Topic.OP_PAUSE:
                self.phase = wire.Phase.PAUSED
            case wire.Topic.OP_HOLD:
                self.phase = wire.Phase.HELD
            case wire.Topic.OP_COMPLETE:
                self.phase = wire.Phase.COMPLETED
            case wire.Topic.OP_ABORT:
                self.phase = wire.Phase.ABORTED
            case wire.Topic.RPC_INGEST:
                return wire.IngestStatus(
                    mission=self.config.mission,
                    next_seq=self.next_seq,
                    durable_seq=self.durable_seq,
                    buffered=0,
                    missing=(),
                    rejected=self.applied.rejected,
                )
            case wire.Topic.RPC_MISSION:
                pass
            case wire.Topic.RPC_GRAPH:
                return self._graph()
            case _:
                return wire.Problem(code="unsupported", message="The fake plans nothing.", seq=None)
        return self.state()

    def _graph(self) -> wire.GraphReply:
        """The keyframes, all at the origin."""
        origin = wire.Pose(translation=(0.0, 0.0, 0.0), rotation=(0.0, 0.0, 0.0, 1.0))
        keyframes = tuple(
            wire.GraphKeyframe(
                id=event.id,
                pose=origin,
                linearization=origin,
                local_saliency=0.0,
                global_saliency=0.0,
                covariance=wire.row_major(np.eye(6)),
            )
            for event in self.applied.events
            if isinstance(event, wire.Keyframe)
        )
        return wire.GraphReply(
            mission=self.state().mission, graph_seq=self.next_seq, keyframes=keyframes, factors={}, chi2=0.0
        )
