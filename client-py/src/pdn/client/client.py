"""Connecting: from an endpoint to a client that asks, commands, streams and watches."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

import zenoh

from pdn import wire

from .commands import Commands
from .diagnosis import DEFAULT_ENDPOINT
from .errors import ConnectionFailed, NotAllowed, PdnError, PlannerAbsent, Refused, Timeout
from .outbox import WINDOW
from .questions import Questions
from .session import open_session
from .stream import POST_TIMEOUT_S, MissionStream, OnRejected
from .vehicle_session import VehicleSession
from .watch import Watch

TIMEOUT_S = 10.0
"""Longest wait for an answer unless a call says otherwise, s."""


def connect(
    vehicle: str,
    endpoint: str | Sequence[str] = DEFAULT_ENDPOINT,
    *others: str,
    timeout_s: float = TIMEOUT_S,
    connect_timeout_s: float = 5.0,
    config_file: str | Path | None = None,
    certificate: str | Path | None = None,
    console: str | None = None,
    outbox: str | Path | None = None,
    json_on_wire: bool = False,
) -> Client:
    """Connects to the daemon at `endpoint` and makes sure that its planner answers for `vehicle`.

        with pdn.client.connect("auv-1") as client:
            print(client.mission().phase)
        with pdn.client.connect("auv-1", "tcp/10.0.0.2:7447", "tcp/10.0.1.2:7447") as client:
            print(client.endpoint)

    Several endpoints, given one after the other or as a sequence, are tried in that order, each for its own
    time; `client.endpoint` is the one that serves. They should be ways to one daemon: when the link breaks
    later, Zenoh tries them all in turn, and goes on with the first that takes it.

    `timeout_s` bounds each question, `connect_timeout_s` each of the two steps here, for each endpoint.
    `certificate` is the client's for a secured daemon (`tls/...`), with its key and the authority's `ca.pem`
    beside it; `config_file` is a Zenoh configuration, for instance with other places for them. `console`
    announces an operator's console of that name. `outbox` is a folder for the streams of this client, see
    `mission_stream`. With `json_on_wire` messages travel as JSON, to be read on the way.
    Raises `ConnectionFailed`, `PlannerAbsent`, `NotAllowed` or `Timeout`, with what is probably wrong;
    `Forked` in a process that was forked from one that had connected.
    """
    wire.key(vehicle, wire.Topic.RPC_MISSION)  # Refuses an id that would make no key.
    given = (endpoint, *others) if isinstance(endpoint, str) else (*endpoint, *others)
    endpoints = tuple(dict.fromkeys(given))
    if not endpoints:
        raise ConnectionFailed(f"No endpoint was given; write one like {DEFAULT_ENDPOINT}")

    def attempt(one: str) -> Client:
        rest = tuple(other for other in endpoints if other != one)
        session, presented = open_session(one, connect_timeout_s, config_file, certificate, rest)
        form = wire.Format.JSON if json_on_wire else wire.Format.BINCODE
        client = Client(VehicleSession(session, vehicle, one, form, presented, endpoints), timeout_s, outbox)
        try:
            client.wait_for_planner(connect_timeout_s)
            if console is not None:
                client.announce(wire.console_key(vehicle, console))
        except BaseException:
            client.close()
            raise
        return client

    return _first_that_serves(vehicle, endpoints, attempt)


def split_endpoints(given: Sequence[str]) -> list[str]:
    """Endpoints from words that may hold several, apart by commas, as on a command line or in `PDN_CONNECT`.

    A comma parts only before the protocol of the next endpoint: paths of sockets may hold others.
    """
    parts = [re.split(r",\s*(?=[a-z][a-z0-9.-]*/)", word) for word in given]
    return [one for words in parts for one in (word.strip().strip(",") for word in words) if one]


def _first_that_serves(vehicle: str, endpoints: Sequence[str], attempt: Callable[[str], Client]) -> Client:
    failures: dict[str, PdnError] = {}
    for endpoint in endpoints:
        try:
            return attempt(endpoint)
        except (ConnectionFailed, PlannerAbsent, NotAllowed, Timeout) as error:
            failures[endpoint] = error
    *_, last = failures.values()
    if len(failures) == 1:
        raise last
    kinds = {type(error) for error in failures.values()}
    kind = (
        kinds.pop() if len(kinds) == 1 and isinstance(last, (PlannerAbsent, NotAllowed)) else ConnectionFailed
    )
    reasons = "".join(f"\n  {endpoint}: {error}" for endpoint, error in failures.items())
    raise kind(f"None of {len(failures)} endpoints serves {vehicle}:{reasons}") from last


class Client(Commands, Questions):
    """A connection for one vehicle, made by `connect`; a context manager.

    Every method that asks takes `timeout_s`, asks again while nobody answers or there is no room for the
    question, and raises `Refused` with the planner's reason, `Timeout`, or `PlannerAbsent`. `mission` names
    another mission than the one configured last. Safe to use from several threads.

    After `close`, by whatever thread, every call raises `Closed`, those under way too; in a process that was
    forked from this one they raise `Forked`. A program that ends with the client open gives its streams a
    few seconds to be confirmed, says what was not, and closes it.
    """

    def __init__(self, session: VehicleSession, timeout_s: float, outbox: str | Path | None = None) -> None:
        super().__init__(session, timeout_s)
        self._outbox = outbox
        self.vehicle = session.vehicle
        self._tokens: dict[str, zenoh.LivelinessToken] = {}
        self._stream: MissionStream | None = None

    @property
    def endpoint(self) -> str:
        """Where the daemon is that serves, as it was written for `connect`."""
        return self._session.endpoint

    def mission_stream(
        self,
        mission: str | None = None,
        *,
        on_rejected: OnRejected = "raise",
        window: int = WINDOW,
        timeout_s: float = POST_TIMEOUT_S,
        outbox: str | Path | None = None,
    ) -> MissionStream:
        """Sends the events of a mission (default: the one configured last), going on where they stand;
        this is the vehicle.

        `on_rejected` is "raise" (a refusal is raised by the next call), "collect" (it stands in `refusals`
        only), or a function called with each on the stream's thread. `outbox` is a folder in which events are
        kept until they are durable: a program that ends before, however it ends, and is started again goes on
        with `next_seq` of the stream, nothing lost and nothing counted twice. One stream at a time.
        """
        self._session.lifetime.require_open()
        if self._stream is not None and not self._stream.closed:
            raise ValueError(f"the stream of mission {self._stream.mission} is still open; close it first")
        name = mission if mission is not None else self.mission().mission
        self.announce(wire.key(self.vehicle, wire.Topic.ALIVE_VEHICLE))
        self._stream = MissionStream(
            self._session,
            name,
            on_rejected=on_rejected,
            window=window,
            timeout_s=timeout_s,
            outbox=outbox or self._outbox,
        )
        return self._stream

    def watch(self) -> Watch:
        """States, decisions and refusals as they are published, from now on."""
        return Watch(self._session)

    def wait_for_planner(self, timeout_s: float) -> None:
        """Returns once the planner answers for this vehicle, or is announced and only busy.

        Raises `PlannerAbsent`, or `Timeout` if something there hears questions but no planner is announced.
        """
        try:
            self.mission(timeout_s=timeout_s)
        except PlannerAbsent:
            raise
        except Timeout:
            if not self._session.planner_is_alive():
                raise
        except Refused as refusal:
            if refusal.code == wire.Code.NOT_READY:
                raise PlannerAbsent(f"The planner is not ready: {refusal.message}") from refusal

    def announce(self, key: str) -> None:
        """Holds a liveliness token of that key as long as the client is open."""
        if key not in self._tokens:
            self._tokens[key] = self._session.announce(key)

    def close(self) -> None:
        """Ends the connection; what a stream has not confirmed by then is sent no more.

        Calls under way in other threads end with `Closed`. Takes some seconds at most; the second time does
        nothing, and so does a call in a process that was forked from this one.
        """
        self._session.lifetime.begin_closing()
        if self._stream is not None:
            self._stream.close()
        self._tokens.clear()
        self._session.lifetime.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()
