"""The client over Zenoh, against a fake planner on loopback.

Waits are on conditions with a bound of `WAIT_S`, far above what a case takes (a reconnection takes up
to 2 s).
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest
from fake_planner import FakePlanner
from proxy import Proxy

from pdn import wire
from pdn.client import (
    BadReply,
    Client,
    ConnectionFailed,
    EventsRefused,
    IllegalTransition,
    MissionLost,
    MissionUnknown,
    NotAllowed,
    OutboxFull,
    PlannerAbsent,
    PlannerPresence,
    Refused,
    Timeout,
    connect,
)

WAIT_S = 30.0
LONG_S = 60.0
"""A time-out that a question must not wait for, whatever else makes it slow."""

FACET = {"origin": [0, 0, 0], "u": [1, 0, 0], "v": [0, 1, 0], "length_u_m": 10, "length_v_m": 10}
CONFIG = {"mission": "m", "target": {"facets": [FACET]}}
IDENTITY = wire.Pose(translation=(0.0, 0.0, 0.0), rotation=(0.0, 0.0, 0.0, 1.0))


def wait_until(condition: Callable[[], bool], what: str) -> None:
    end = time.monotonic() + WAIT_S
    while not condition():
        assert time.monotonic() < end, f"waited {WAIT_S} s in vain for {what}"
        time.sleep(0.01)


@pytest.fixture
def client(planner: FakePlanner) -> Iterator[Client]:
    with connect("auv", planner.endpoint, timeout_s=5.0) as connected:
        connected.configure(CONFIG)
        yield connected


# --- connecting ---


def test_without_a_daemon_the_error_says_what_is_probably_wrong(endpoint: str) -> None:
    with pytest.raises(ConnectionFailed, match=r"nothing listens there.*pdnd"):
        connect("auv", endpoint, connect_timeout_s=0.3)


def test_an_endpoint_that_is_none_is_named() -> None:
    with pytest.raises(ConnectionFailed, match=r"'localhost:7447' is no Zenoh endpoint"):
        connect("auv", "localhost:7447")


def test_a_vehicle_that_nobody_plans_for_is_absent(planner: FakePlanner) -> None:
    with pytest.raises(PlannerAbsent, match="no planner has announced itself"):
        connect("other", planner.endpoint, connect_timeout_s=0.3)


def test_a_planner_that_does_not_answer_though_announced(planner: FakePlanner) -> None:
    planner.silent_topics = {wire.Topic.RPC_MISSION}
    with pytest.raises(NotAllowed, match="access rules probably keep this client from rpc/mission"):
        connect("auv", planner.endpoint, connect_timeout_s=0.5)


def test_events_that_nobody_takes_are_noticed_before_they_are_sent(planner: FakePlanner) -> None:
    planner.stop()
    planner.hears_events = False
    planner.start()
    with connect("auv", planner.endpoint) as client:
        client.configure({"mission": "m", "target": {"facets": []}})
        with pytest.raises(NotAllowed, match="it takes a certificate of the role vehicle"):
            client.mission_stream()


def test_a_planner_that_starts_later_is_waited_for(endpoint: str) -> None:
    fake = FakePlanner(endpoint)
    starting = threading.Timer(0.5, fake.start)
    starting.start()
    try:
        with connect("auv", endpoint, connect_timeout_s=WAIT_S) as client, pytest.raises(MissionUnknown):
            client.mission()
    finally:
        starting.join()
        fake.stop()


def test_a_planner_that_is_busy_is_there(planner: FakePlanner) -> None:
    planner.frozen.set()
    with connect("auv", planner.endpoint, connect_timeout_s=0.3) as client:
        planner.frozen.clear()
        with pytest.raises(MissionUnknown):
            client.mission()


@pytest.mark.parametrize("vehicle", ["", "AUV", "a/b", "*", "x" * 65])
def test_an_id_that_would_be_no_key_is_refused(vehicle: str) -> None:
    with pytest.raises(wire.WireError):
        connect(vehicle)


# --- questions and commands ---


@pytest.mark.parametrize("json_on_wire", [False, True])
def test_a_mission_is_configured_and_commanded(planner: FakePlanner, json_on_wire: bool) -> None:
    with connect("auv", planner.endpoint, json_on_wire=json_on_wire) as client:
        typed = wire.from_plain(wire.MissionConfig, CONFIG | {"alpha": 0.5})
        assert client.configure(typed).config == typed
        assert client.configure(CONFIG).phase is wire.Phase.CONFIGURED
        assert client.start("go").phase is wire.Phase.RUNNING
        assert client.pause().phase is wire.Phase.PAUSED
        assert client.resume().phase is wire.Phase.RUNNING
        with pytest.raises(IllegalTransition, match=r"It is running. \[illegal_transition\]"):
            client.start()
        assert client.hold().phase is wire.Phase.HELD
        assert client.complete().phase is wire.Phase.COMPLETED
        assert client.abort().phase is wire.Phase.ABORTED
        assert client.mission().mission == "m"


def test_parameters_travel_as_the_contract_says(planner: FakePlanner, client: Client) -> None:
    with pytest.raises(Refused) as caught:
        client.decision(after=12, deadline_ms=500, detail="full", alpha=0.25, mission="m")
    assert caught.value.code == "unsupported"
    assert planner.asked[-1] == (
        "rpc/decision",
        {
            "after": "12",
            "deadline_ms": "500",
            "detail": "full",
            "alpha": "0.25",
            "mission": "m",
            "encoding": "bincode",
        },
    )
    with pytest.raises(Refused):
        client.evaluate([[(0, 0, 0), (1, 0, 0)]], after=3)
    client.graph(7, True, timeout_s=2.0)
    assert planner.asked[-1] == (
        "rpc/graph",
        {"from": "7", "marginals": "true", "deadline_ms": "1750", "encoding": "bincode"},
    )


def test_a_question_that_is_heard_by_nobody_ends_at_its_own_deadline(
    planner: FakePlanner, client: Client
) -> None:
    planner.silent_topics = {wire.Topic.RPC_WAYPOINTS}
    client.timeout_s = LONG_S
    began_s = time.monotonic()
    with pytest.raises(NotAllowed):
        client.waypoints(timeout_s=0.4)
    assert 0.4 <= time.monotonic() - began_s < 0.5 * LONG_S, "it waited for the client's time-out"
    assert sum(topic == "rpc/waypoints" for topic, _ in planner.asked) > 1, "it asked again"


def test_a_question_that_a_present_planner_does_not_hear_is_given_up_early(
    planner: FakePlanner, client: Client
) -> None:
    planner.silent_topics = {wire.Topic.RPC_WAYPOINTS}
    began_s = time.monotonic()
    with pytest.raises(NotAllowed):
        client.waypoints(timeout_s=LONG_S)
    assert time.monotonic() - began_s < 0.5 * LONG_S, "it waited for its time-out"


def test_a_question_that_is_never_answered_times_out(planner: FakePlanner, client: Client) -> None:
    planner.frozen.set()
    with pytest.raises(Timeout, match=r"within 0\.3 s"):
        client.coverage(timeout_s=0.3)
    planner.frozen.clear()
    assert client.mission().mission == "m"


def test_an_answer_of_another_version_is_told_apart(planner: FakePlanner, client: Client) -> None:
    planner.encoding = "application/octet-stream;pdn.v1.MissionState+bincode#0000000000000000"
    with pytest.raises(BadReply, match="same version"):
        client.mission()


# --- events ---


def send(client: Client, count: int, **options: object) -> None:
    with client.mission_stream(**options) as events:  # type: ignore[arg-type]
        for number in range(count):
            events.keyframe(number)


def ids(planner: FakePlanner) -> list[int]:
    return [event.id for event in planner.applied.events if isinstance(event, wire.Keyframe)]


@pytest.mark.parametrize(
    "fate",
    [
        lambda seq, copy: "apply",
        lambda seq, copy: "lose" if copy == 1 and seq in (3, 900) else "apply",
        lambda seq, copy: "lose" if copy < 3 and seq == 500 else "repeat",
    ],
    ids=["plain", "losses", "losses and repeats"],
)
def test_every_event_arrives_once_and_in_order(
    planner: FakePlanner, client: Client, fate: Callable[[int, int], str]
) -> None:
    planner.fate = fate
    send(client, 1500)
    assert ids(planner) == list(range(1500))
    assert [event.seq for event in planner.applied.events] == list(range(1500))


def test_every_kind_of_event_arrives_as_it_was_given(planner: FakePlanner, client: Client) -> None:
    six, five, three = np.diag([1.0, 2, 3, 4, 5, 6]), np.eye(5), np.diag([1.0, 1.0, 0.0])
    with client.mission_stream() as events:
        assert events.keyframe(7, IDENTITY, saliency=(0.5, 0.25), stamp_ns=12) == 0
        assert events.keyframe(8, appearance=wire.Appearance.Words(((1, 2),)), camera=IDENTITY) == 1
        events.prior(7, IDENTITY, six)
        events.odometry(7, 8, IDENTITY, six.ravel().tolist())
        events.relative(8, 7, IDENTITY, six)
        events.camera(7, 8, [1, 0, 0], [0, 0, 0, 1], five)
        events.attitude(8, [0, 0, 0, 1], 0.1)
        events.depth(8, 6.5, 0.04)
        events.position(8, np.array([1.0, 2.0, 3.0]), three)
        assert events.link(7, 8, True) == 9
        with pytest.raises(ValueError, match="6x6 or 36 numbers"):
            events.prior(7, IDENTITY, five)
        with pytest.raises(ValueError, match="not both"):
            events.keyframe(9, saliency=(0.5, 0.5), appearance=wire.Appearance.None_())
        assert events.next_seq == 10, "what was refused here took no number"
    first, second, *factors, link = planner.applied.events
    assert first == wire.Keyframe(
        mission="m", seq=0, stamp_ns=12, id=7, pose=IDENTITY, appearance=wire.Appearance.Saliency(0.5, 0.25)
    )
    assert isinstance(second, wire.Keyframe)
    assert second.camera == IDENTITY
    assert [type(factor.factor).__name__ for factor in factors if isinstance(factor, wire.Factor)] == [
        "Prior", "Odometry", "Relative", "Camera", "Attitude", "Depth", "Position",
    ]  # fmt: skip
    odometry = factors[1]
    assert isinstance(odometry, wire.Factor)
    assert odometry.factor == wire.FactorKind.Odometry(
        from_=7, to=8, relative=IDENTITY, covariance=wire.row_major(six)
    )
    assert isinstance(link, wire.LinkOutcome)
    assert link.registered


def test_a_planner_that_restarts_gets_again_what_was_not_durable(
    planner: FakePlanner, client: Client
) -> None:
    planner.durable_lag = 50
    with client.mission_stream() as events:
        for number in range(200):
            events.keyframe(number)
        wait_until(lambda: planner.next_seq == 200, "the first events")
        planner.stop()
        assert planner.next_seq == 150
        for number in range(200, 400):
            events.keyframe(number)
        planner.start()
        wait_until(lambda: planner.next_seq == 400, "all events")
        planner.persist()
        events.flush(WAIT_S)
    assert ids(planner) == list(range(400))


def test_a_link_that_breaks_loses_nothing(planner: FakePlanner) -> None:
    proxy = Proxy(planner.endpoint)
    try:
        with connect("auv", proxy.endpoint) as client:
            client.configure(CONFIG)
            with client.mission_stream() as events:
                for number in range(3000):
                    events.keyframe(number)
                    if number in (700, 1900):
                        proxy.cut()
                events.flush(WAIT_S)
        assert proxy.connections == 3, "it was cut twice"
    finally:
        proxy.close()
    assert ids(planner) == list(range(3000))


def test_a_planner_that_restarts_without_memory_breaks_the_stream(
    planner: FakePlanner, client: Client
) -> None:
    events = client.mission_stream()
    events.keyframe(0)
    events.flush(WAIT_S)
    planner.stop()
    planner.config = None
    planner.start()

    def go_on() -> None:
        events.keyframe(1)
        events.flush(WAIT_S)

    with pytest.raises(MissionLost, match="no longer knows mission m"):
        go_on()
    events.close()


def test_a_stream_goes_on_where_the_mission_stands(planner: FakePlanner, client: Client) -> None:
    send(client, 10)
    with connect("auv", planner.endpoint) as other, other.mission_stream() as events:
        assert events.next_seq == 10
        events.keyframe(10)
    assert ids(planner) == list(range(11))


def test_acknowledgements_of_another_mission_confirm_nothing(planner: FakePlanner, client: Client) -> None:
    planner.acknowledges = False
    planner.fate = lambda seq, copy: "lose"
    with client.mission_stream() as events, client.watch() as watch:
        events.keyframe(0)
        planner.publish(wire.Topic.OUT_ACK, wire.Ack(mission="other", next_seq=1, durable_seq=1))
        planner.publish(wire.Topic.OUT_STATE, planner.state())
        # Zenoh delivers in order: what was published after the acknowledgement has come.
        wait_until(lambda: isinstance(watch.next(0.1), wire.MissionState), "the state")
        wait_until(lambda: planner.copies.get(0, 0) > 1, "the event to be sent again")
        assert events.durable_seq == 0
        planner.fate = lambda seq, copy: "apply"
        events.flush(WAIT_S)
    assert ids(planner) == [0]


def test_a_planner_that_stalls_makes_the_sender_wait_with_a_bound(
    planner: FakePlanner, client: Client
) -> None:
    planner.fate = lambda seq, copy: "lose"
    with client.mission_stream(window=16, timeout_s=0.2) as events:
        for number in range(16):
            events.keyframe(number)
        with pytest.raises(OutboxFull, match="16 events"):
            events.keyframe(16)
        planner.fate = lambda seq, copy: "apply"
        wait_until(lambda: events.durable_seq == 16, "the stall to end")
        events.keyframe(16)
    assert ids(planner) == list(range(17))


def test_refusals_are_never_silent(planner: FakePlanner, client: Client) -> None:
    planner.fate = lambda seq, copy: "refuse" if seq == 1 else "refuse silently" if seq == 4 else "apply"
    events = client.mission_stream()
    for number in range(3):
        events.keyframe(number)
    with pytest.raises(EventsRefused, match=r"Normalise it. \[not_unit\] \(event 1\)"):
        events.flush(WAIT_S)
    for number in range(3, 6):
        events.keyframe(number)
    with pytest.raises(EventsRefused, match="1 events were refused"):
        events.flush(WAIT_S)
    events.flush(WAIT_S)
    assert [problem.seq for problem in events.refusals] == [1]
    events.close()


def test_one_stream_at_a_time(client: Client) -> None:
    with client.mission_stream(), pytest.raises(ValueError, match="still open"):
        client.mission_stream()
    client.mission_stream().close()


def test_a_stream_of_no_mission_is_refused(planner: FakePlanner) -> None:
    with connect("auv", planner.endpoint) as client, pytest.raises(MissionUnknown):
        client.mission_stream()


# --- watching ---


def test_what_is_published_is_seen(planner: FakePlanner, client: Client) -> None:
    with client.watch() as watch:
        assert watch.next(WAIT_S) == PlannerPresence(True)
        problem = wire.Problem(code="not_unit", message="Normalise it.", seq=3)

        def published() -> bool:
            planner.publish(wire.Topic.OUT_REJECTED, problem)
            return watch.next(0.1) is not None

        wait_until(published, "the subscription")
        planner.publish(wire.Topic.OUT_STATE, planner.state())
        seen = next(item for item in watch if isinstance(item, wire.MissionState))
        assert seen == planner.state()
        assert watch.next(0.01) is None
        planner.stop()
        wait_until(lambda: watch.next(0.1) == PlannerPresence(False), "the planner's going")
        planner.start()
        wait_until(lambda: watch.next(0.1) == PlannerPresence(True), "the planner's return")
