"""One vehicle's keys over one Zenoh session: questions with a deadline, publications, subscriptions."""

from __future__ import annotations

import contextlib
import logging
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, TypeVar

import zenoh

from pdn import wire

from .certificates import Certificate
from .diagnosis import why_not_allowed
from .errors import BadReply, ConnectionFailed, NotAllowed, Overloaded, PlannerAbsent, Timeout, refused
from .lifetime import Lifetime
from .outbox import Entry

M = TypeVar("M")

RETRY_FIRST_S = 0.02
RETRY_LAST_S = 0.5
"""Pauses between questions that nobody answered, s, doubling from first to last."""

OVERLOADED_RETRY_S = 0.05
"""Pause before a planner that has no room for questions is asked again, s."""

DENIED_S = 1.0
"""A planner that is there and has not heard a question for so long is kept from hearing it, s."""

ANSWER_MARGIN_S = 0.25
"""How long before the time-out the planner is told to answer, s."""

HEARD_CAPACITY = 256
"""Publications that a subscription holds until its thread takes them; beyond, Zenoh waits."""

_log = logging.getLogger("pdn.client")


class VehicleSession:
    """What a vehicle, or a console of its operator, publishes, asks and subscribes to."""

    def __init__(
        self,
        session: zenoh.Session,
        vehicle: str,
        endpoint: str,
        form: wire.Format,
        certificate: Certificate | None = None,
        endpoints: Sequence[str] = (),
    ) -> None:
        self.certificate = certificate
        self.lifetime = Lifetime(session)
        self.vehicle = vehicle
        self.form = form
        self._session = session
        self._endpoint = endpoint
        self._endpoints = endpoints

    @property
    def endpoint(self) -> str:
        """The one of the endpoints that the session is linked with, or was last.

        After a break Zenoh may go to another of several; where that is written with a host's name it cannot
        be told apart from the link, and the one of the beginning stands.
        """
        if len(self._endpoints) > 1 and not self.lifetime.closed:
            linked = [str(link.dst) for link in self._session.info.links()]
            self._endpoint = next((one for one in self._endpoints if one in linked), self._endpoint)
        return self._endpoint

    def ask(
        self,
        topic: wire.Topic,
        reply_kind: type[M],
        timeout_s: float,
        *,
        payload: bytes | None = None,
        encoding: str | None = None,
        parameters: Mapping[str, object] | None = None,
    ) -> M:
        """Asks, and asks again while nobody answers or the planner has no room for the question; parameters
        that are None are left out.

        Raises `Refused` with the planner's reason, `Timeout` if it was asked and did not answer,
        `PlannerAbsent` if nobody was there to ask, `NotAllowed` if access rules keep the question from it,
        `BadReply` if the answer cannot be read.
        """
        selector = self._selector(topic, parameters or {})
        deadline_s = time.monotonic() + timeout_s
        pause_s = RETRY_FIRST_S
        overloaded: Overloaded | None = None
        presence_checked = False
        while (left_s := deadline_s - time.monotonic()) > 0.0:
            with self._in_use("ask the planner"):
                replies = self._session.get(
                    selector,
                    timeout=left_s,
                    payload=payload,
                    encoding=encoding,
                    consolidation=zenoh.ConsolidationMode.NONE,
                    congestion_control=zenoh.CongestionControl.BLOCK,
                )
            overloaded = None
            for reply in replies:
                try:
                    return self._read(reply, reply_kind, topic, timeout_s)
                except Overloaded as error:
                    overloaded = error
            wait_s = pause_s if overloaded is None else OVERLOADED_RETRY_S
            if (
                overloaded is None
                and not presence_checked
                and deadline_s - time.monotonic() < timeout_s - DENIED_S
            ):
                presence_checked = True
                if self.planner_is_alive():
                    raise self._not_allowed(topic)
            self.lifetime.pause(max(0.0, min(wait_s, deadline_s - time.monotonic())))
            pause_s = min(2.0 * pause_s, RETRY_LAST_S)
        self.lifetime.require_open()
        if overloaded is not None:
            raise overloaded
        if self.planner_is_alive():
            raise self._not_allowed(topic)
        raise PlannerAbsent(
            f"Nobody answers {wire.key(self.vehicle, topic)} at {self.endpoint}: {self._absence_reason()}"
        )

    def send(self, entry: Entry) -> None:
        """Publishes an event. On a broken link it vanishes, which the sender notices."""
        with contextlib.suppress(zenoh.ZError):
            self._session.put(
                entry.key,
                entry.payload,
                encoding=entry.encoding,
                congestion_control=zenoh.CongestionControl.BLOCK,
            )

    def require_subscriber(self, topic: wire.Topic, timeout_s: float = 2.0) -> None:
        """Makes sure that somebody takes what is published there; raises `NotAllowed`.

        Publications that access rules keep away vanish without a word, but so does then the daemon's word
        that it listens, and that can be seen.
        """
        key = wire.key(self.vehicle, topic)
        with self._in_use("publish"):
            publisher = self._session.declare_publisher(key)
        try:
            give_up_s = time.monotonic() + timeout_s
            while not publisher.matching_status.matching:  # type: ignore[attr-defined]
                self.lifetime.require_open()
                if time.monotonic() > give_up_s:
                    raise self._not_allowed(topic)
                self.lifetime.pause(RETRY_FIRST_S)
        finally:
            with contextlib.suppress(zenoh.ZError):
                publisher.undeclare()  # type: ignore[no-untyped-call]

    def subscribe(self, topic: wire.Topic, callback: Callable[[zenoh.Sample], None]) -> Subscription:
        """Hears the planner's publications; `callback` runs on a thread of its own and must not block."""
        with self._in_use("subscribe"):
            return Subscription(
                self.lifetime,
                self._session.declare_subscriber(
                    wire.key(self.vehicle, topic), zenoh.handlers.FifoChannel(HEARD_CAPACITY)
                ),
                callback,
            )

    def subscribe_presence(self, callback: Callable[[bool], None], *, history: bool) -> Subscription:
        """Hears the planner come (True) and go (False); with `history` also that it is there already."""
        with self._in_use("subscribe"):
            return Subscription(
                self.lifetime,
                self._session.liveliness().declare_subscriber(
                    wire.key(self.vehicle, wire.Topic.ALIVE_PLANNER),
                    zenoh.handlers.FifoChannel(HEARD_CAPACITY),
                    history=history,
                ),
                lambda sample: callback(sample.kind == zenoh.SampleKind.PUT),
            )

    def announce(self, key: str) -> zenoh.LivelinessToken:
        """A liveliness token of that key."""
        with self._in_use("announce"):
            return self._session.liveliness().declare_token(key)

    def planner_is_alive(self, timeout_s: float = 1.0) -> bool:
        """Whether the planner's liveliness token is seen."""
        with self._in_use("look for the planner"):
            tokens = self._session.liveliness().get(
                wire.key(self.vehicle, wire.Topic.ALIVE_PLANNER), timeout=timeout_s
            )
            return any(reply.ok is not None for reply in tokens)

    @contextlib.contextmanager
    def _in_use(self, purpose: str) -> Iterator[None]:
        """A call of Zenoh, which knows one kind of error; raises `Closed`, `Forked` or `ConnectionFailed`."""
        self.lifetime.require_open()
        try:
            yield
        except zenoh.ZError as error:
            self.lifetime.require_open()
            raise ConnectionFailed(f"Zenoh cannot {purpose} at {self.endpoint}: {error}") from error

    def _selector(self, topic: wire.Topic, parameters: Mapping[str, object]) -> str:
        given = {name: value for name, value in parameters.items() if value is not None}
        if self.form is wire.Format.BINCODE:
            given["encoding"] = "bincode"
        text = ";".join(f"{name}={value}" for name, value in given.items())
        return f"{wire.key(self.vehicle, topic)}?{text}" if text else wire.key(self.vehicle, topic)

    def _read(self, reply: zenoh.Reply, kind: type[M], topic: wire.Topic, timeout_s: float) -> M:
        if reply.ok is not None:
            return decode_sample(reply.ok, kind)
        assert reply.err is not None, "a reply is one of the two"
        if str(reply.err.encoding) == "application/json":
            raise refused(_problem(reply.err.payload.to_bytes()))
        if reply.err.payload.to_bytes() == b"Timeout":
            raise Timeout(f"The planner did not answer {topic} within {timeout_s:g} s.")
        raise BadReply(
            f"{topic} was answered by an error that is not of this contract ({reply.err.encoding})"
        )

    def _not_allowed(self, topic: wire.Topic) -> NotAllowed:
        return NotAllowed(
            f"The planner at {self.endpoint} is there, but does not hear this client under "
            f"{wire.key(self.vehicle, topic)}: {why_not_allowed(topic, self.certificate)}"
        )

    def _absence_reason(self) -> str:
        if self._session.is_closed() or not any(self._session.info.routers_zid()):
            return "the connection to the daemon is gone. Is it still running?"
        return (
            "the daemon is there, but no planner has announced itself for this vehicle. "
            "Is it starting, or may this client not see it (certificate, role)?"
        )


class Subscription:
    """What is heard, handed to a function on a daemon thread, until this is closed or dropped.

    Zenoh's own thread for a function is none that a program may end beside.
    """

    def __init__(self, lifetime: Lifetime, subscriber: Any, callback: Callable[[zenoh.Sample], None]) -> None:
        self._lifetime = lifetime
        self._subscriber: Any = subscriber
        reader = threading.Thread(
            target=_hand_over, args=(subscriber.handler, callback), name="pdn-heard", daemon=True
        )
        lifetime.start_reader(reader)

    def close(self) -> None:
        """Hears no more."""
        subscriber, self._subscriber = self._subscriber, None
        if subscriber is not None and not self._lifetime.closed:
            with contextlib.suppress(zenoh.ZError):
                subscriber.undeclare()


def _hand_over(heard: Any, callback: Callable[[zenoh.Sample], None]) -> None:
    for sample in heard:
        try:
            callback(sample)
        except Exception:
            _log.exception("what came under %s could not be handled", sample.key_expr)


def decode_sample(sample: zenoh.Sample, kind: type[M]) -> M:
    """Reads a message by the encoding that it came with; raises `BadReply`."""
    encoding = str(sample.encoding)
    try:
        return wire.decode(kind, sample.payload.to_bytes(), wire.format_of(kind, encoding))
    except wire.WireError as error:
        raise BadReply(
            f"{sample.key_expr} cannot be read ({error}). Are daemon and client of the same version?"
        ) from error


def _problem(payload: bytes) -> wire.Problem:
    try:
        return wire.decode(wire.Problem, payload, wire.Format.JSON)
    except wire.WireError as error:
        raise BadReply(f"A refusal cannot be read: {error}") from error
