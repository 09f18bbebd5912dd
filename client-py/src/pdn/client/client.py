"""The client: one vehicle's questions and commands, as methods that return typed messages."""

from __future__ import annotations

import json
import threading
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Self, TypeVar

import zenoh

from pdn import wire

from .errors import PlannerAbsent, Refused, Timeout
from .link import ANSWER_MARGIN_S, Link
from .outbox import WINDOW
from .session import DEFAULT_ENDPOINT, open_session
from .stream import POST_TIMEOUT_S, MissionStream, OnRejected
from .watch import Watch

M = TypeVar("M")

TIMEOUT_S = 10.0
"""Longest wait for an answer unless a call says otherwise, s."""

CLOSE_TIMEOUT_S = 3.0
"""Longest wait for Zenoh to close a session, s; it can hang on a link that stands still."""

Detail = Literal["brief", "full"]


def connect(
    vehicle: str,
    endpoint: str = DEFAULT_ENDPOINT,
    *,
    timeout_s: float = TIMEOUT_S,
    connect_timeout_s: float = 5.0,
    config_file: str | Path | None = None,
    console: str | None = None,
    json_on_wire: bool = False,
) -> Client:
    """Connects to the daemon at `endpoint` and makes sure that its planner answers for `vehicle`.

        with pdn.client.connect("auv-1") as client:
            print(client.mission().phase)

    `timeout_s` bounds each question, `connect_timeout_s` each of the two steps here. `config_file` is a Zenoh
    configuration, for instance with certificates. `console` announces an operator's console of that name. With
    `json_on_wire` messages travel as JSON, to be read on the way. Raises `ConnectionFailed`, `PlannerAbsent` or `Timeout`,
    with what is probably wrong.
    """
    wire.key(vehicle, wire.Topic.RPC_MISSION)  # Refuses an id that would make no key.
    session = open_session(endpoint, connect_timeout_s, config_file)
    form = wire.Format.JSON if json_on_wire else wire.Format.BINCODE
    client = Client(Link(session, vehicle, endpoint, form), timeout_s)
    try:
        client.wait_for_planner(connect_timeout_s)
        if console is not None:
            client.announce(wire.console_key(vehicle, console))
    except BaseException:
        client.close()
        raise
    return client


class Client:
    """A connection for one vehicle, made by `connect`; a context manager.

    Every method that asks takes `timeout_s`, asks again while nobody answers, and raises `Refused` with the planner's
    reason, `Timeout`, or `PlannerAbsent`. `mission` names another mission than the one configured last. Safe to use from
    several threads.
    """

    def __init__(self, link: Link, timeout_s: float) -> None:
        self.vehicle = link.vehicle
        self.endpoint = link.endpoint
        self.timeout_s = timeout_s
        self._link = link
        self._tokens: dict[str, zenoh.LivelinessToken] = {}
        self._stream: MissionStream | None = None

    # -- commands ----------------------------------------------------------------------------------------------------

    def configure(
        self, config: wire.MissionConfig | Mapping[str, Any], *, timeout_s: float | None = None
    ) -> wire.MissionState:
        """A new mission, from a typed configuration or from a mapping as in JSON or TOML, which the planner completes."""
        if isinstance(config, wire.MissionConfig):
            return self._send(wire.Topic.OP_CONFIGURE, config, wire.MissionState, timeout_s)
        payload = json.dumps(config, allow_nan=False).encode()
        return self._link.ask(
            wire.Topic.OP_CONFIGURE,
            wire.MissionState,
            self._patience(timeout_s),
            payload=payload,
            encoding=wire.encoding(wire.MissionConfig, wire.Format.JSON),
        )

    def start(
        self, reason: str = "", *, mission: str | None = None, timeout_s: float | None = None
    ) -> wire.MissionState:
        """From `configured` to `running`."""
        return self._command(wire.Topic.OP_START, reason, mission, timeout_s)

    def pause(
        self, reason: str = "", *, mission: str | None = None, timeout_s: float | None = None
    ) -> wire.MissionState:
        """From `running` to `paused`: events still count, decisions are not given."""
        return self._command(wire.Topic.OP_PAUSE, reason, mission, timeout_s)

    def resume(
        self, reason: str = "", *, mission: str | None = None, timeout_s: float | None = None
    ) -> wire.MissionState:
        """From `paused` or `held` to `running`."""
        return self._command(wire.Topic.OP_RESUME, reason, mission, timeout_s)

    def complete(
        self, reason: str = "", *, mission: str | None = None, timeout_s: float | None = None
    ) -> wire.MissionState:
        """Ends the mission as planned."""
        return self._command(wire.Topic.OP_COMPLETE, reason, mission, timeout_s)

    def abort(
        self, reason: str = "", *, mission: str | None = None, timeout_s: float | None = None
    ) -> wire.MissionState:
        """Ends the mission before its end."""
        return self._command(wire.Topic.OP_ABORT, reason, mission, timeout_s)

    # -- questions ---------------------------------------------------------------------------------------------------

    def decision(
        self,
        *,
        after: int | None = None,
        deadline_ms: int | None = None,
        detail: Detail = "brief",
        alpha: float | None = None,
        sigma_xy_m: float | None = None,
        sigma_depth_m: float | None = None,
        sigma_tilt_deg: float | None = None,
        sigma_heading_deg: float | None = None,
        mission: str | None = None,
        timeout_s: float | None = None,
    ) -> wire.Decision:
        """Explore or revisit? `after` waits for that event; `alpha` or a sigma makes it a what-if, which is not counted.

        When `deadline_ms` comes before all candidates are evaluated, the best of those that were is chosen, and `complete` is
        False. Without it the planner is told to answer shortly before `timeout_s`.
        """
        return self._ask(
            wire.Topic.RPC_DECISION,
            wire.Decision,
            timeout_s,
            deadline_ms=deadline_ms,
            mission=mission,
            after=after,
            detail=detail,
            alpha=alpha,
            sigma_xy_m=sigma_xy_m,
            sigma_depth_m=sigma_depth_m,
            sigma_tilt_deg=sigma_tilt_deg,
            sigma_heading_deg=sigma_heading_deg,
        )

    def evaluate(
        self,
        paths: Sequence[Sequence[Sequence[float]]],
        *,
        after: int | None = None,
        deadline_ms: int | None = None,
        detail: Detail = "brief",
        alpha: float | None = None,
        mission: str | None = None,
        timeout_s: float | None = None,
    ) -> wire.EvaluateReply:
        """Paths of world points [x, y, z], m, from the robot on, evaluated as candidates of a decision."""
        request = wire.EvaluateRequest(paths=tuple(tuple(_point(point) for point in path) for path in paths))
        return self._ask(
            wire.Topic.RPC_EVALUATE,
            wire.EvaluateReply,
            timeout_s,
            message=request,
            deadline_ms=deadline_ms,
            mission=mission,
            after=after,
            detail=detail,
            alpha=alpha,
        )

    def mission(self, *, mission: str | None = None, timeout_s: float | None = None) -> wire.MissionState:
        """The mission as it stands."""
        return self._ask(wire.Topic.RPC_MISSION, wire.MissionState, timeout_s, mission=mission)

    def ingest(self, *, mission: str | None = None, timeout_s: float | None = None) -> wire.IngestStatus:
        """Which events have arrived."""
        return self._ask(wire.Topic.RPC_INGEST, wire.IngestStatus, timeout_s, mission=mission)

    def graph(
        self,
        from_: int | None = None,
        marginals: bool = False,
        *,
        after: int | None = None,
        mission: str | None = None,
        timeout_s: float | None = None,
    ) -> wire.GraphReply:
        """The pose graph: keyframes from id `from_` on, with their covariances if `marginals`."""
        return self._ask(
            wire.Topic.RPC_GRAPH,
            wire.GraphReply,
            timeout_s,
            mission=mission,
            after=after,
            **{"from": from_, "marginals": "true" if marginals else None},
        )

    def waypoints(
        self, *, after: int | None = None, mission: str | None = None, timeout_s: float | None = None
    ) -> wire.WaypointsReply:
        """Clusters of salient keyframes and their representatives."""
        return self._ask(wire.Topic.RPC_WAYPOINTS, wire.WaypointsReply, timeout_s, mission=mission, after=after)

    def coverage(
        self, *, after: int | None = None, mission: str | None = None, timeout_s: float | None = None
    ) -> wire.CoverageReply:
        """The coverage raster of each facet."""
        return self._ask(wire.Topic.RPC_COVERAGE, wire.CoverageReply, timeout_s, mission=mission, after=after)

    def link_model(
        self, *, after: int | None = None, mission: str | None = None, timeout_s: float | None = None
    ) -> wire.LinkModelReply:
        """The table of link probabilities with its counts."""
        return self._ask(wire.Topic.RPC_LINK_MODEL, wire.LinkModelReply, timeout_s, mission=mission, after=after)

    # -- streams -----------------------------------------------------------------------------------------------------

    def mission_stream(
        self,
        mission: str | None = None,
        *,
        on_rejected: OnRejected = "raise",
        window: int = WINDOW,
        timeout_s: float = POST_TIMEOUT_S,
    ) -> MissionStream:
        """Sends the events of a mission (default: the one configured last), going on where they stand; this is the vehicle.

        `on_rejected` is "raise" (a refusal is raised by the next call), "collect" (it stands in `refusals` only), or a function
        called with each on the stream's thread. One stream at a time.
        """
        if self._stream is not None and not self._stream.closed:
            raise ValueError(f"the stream of mission {self._stream.mission} is still open; close it first")
        name = mission if mission is not None else self.mission().mission
        self.announce(wire.key(self.vehicle, wire.Topic.ALIVE_VEHICLE))
        self._stream = MissionStream(
            self._link, name, on_rejected=on_rejected, window=window, timeout_s=timeout_s
        )
        return self._stream

    def watch(self) -> Watch:
        """States, decisions and refusals as they are published, from now on."""
        return Watch(self._link)

    # -- the connection ----------------------------------------------------------------------------------------------

    def wait_for_planner(self, timeout_s: float) -> None:
        """Returns once the planner answers for this vehicle; raises `PlannerAbsent` or `Timeout`."""
        try:
            self.mission(timeout_s=timeout_s)
        except (PlannerAbsent, Timeout):
            raise
        except Refused as refusal:
            if refusal.code == wire.Code.NOT_READY:
                raise PlannerAbsent(f"The planner is not ready: {refusal.message}") from refusal

    def announce(self, key: str) -> None:
        """Holds a liveliness token of that key as long as the client is open."""
        if key not in self._tokens:
            self._tokens[key] = self._link.session.liveliness().declare_token(key)

    def close(self) -> None:
        """Ends the connection; what a stream has not confirmed by then is sent no more."""
        if self._stream is not None:
            self._stream.close()
        self._tokens.clear()
        closing = threading.Thread(target=self._link.session.close, name="pdn-close", daemon=True)
        closing.start()
        closing.join(CLOSE_TIMEOUT_S)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    # -- small parts ---------------------------------------------------------------------------------------------------

    def _command(
        self, topic: wire.Topic, reason: str, mission: str | None, timeout_s: float | None
    ) -> wire.MissionState:
        return self._send(topic, wire.Command(reason=reason), wire.MissionState, timeout_s, mission=mission)

    def _ask(
        self,
        topic: wire.Topic,
        kind: type[M],
        timeout_s: float | None,
        *,
        message: object | None = None,
        deadline_ms: int | None = None,
        **parameters: object,
    ) -> M:
        patience_s = self._patience(timeout_s)
        if deadline_ms is None:
            deadline_ms = max(1, round(1000.0 * max(patience_s - ANSWER_MARGIN_S, 0.5 * patience_s)))
        else:
            patience_s = max(patience_s, 0.001 * deadline_ms + ANSWER_MARGIN_S)
        return self._send(topic, message, kind, patience_s, deadline_ms=deadline_ms, **parameters)

    def _send(
        self,
        topic: wire.Topic,
        message: object | None,
        kind: type[M],
        timeout_s: float | None,
        **parameters: object,
    ) -> M:
        form = self._link.form
        return self._link.ask(
            topic,
            kind,
            self._patience(timeout_s),
            payload=None if message is None else wire.encode(message, form),
            encoding=None if message is None else wire.encoding(type(message), form),
            parameters=parameters,
        )

    def _patience(self, timeout_s: float | None) -> float:
        return self.timeout_s if timeout_s is None else timeout_s


def _point(point: Sequence[float]) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in point)
    return (x, y, z)
