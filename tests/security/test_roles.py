"""Each thing that a role must not do, tried by a client that holds the role's certificate and does not care,
and seen to have no effect; and each thing that it may do, seen to work.

`MAY` says what each role is for, as the contract and deploy/README.md do, and not as the configuration has
it.
"""

import json
import queue
import time

import pytest
import zenoh

from secured import HULL, REMOTE, ROLES, Secured, answers

READ = ("mission", "ingest", "graph", "waypoints", "coverage", "link_model")
ASK = (*READ, "decision", "evaluate")
COMMANDS = ("configure", "start", "pause", "resume", "hold", "complete", "abort", "override", "tune")
TOLD = ("ack", "state", "decided", "rejected", "alert")

MAY = {
    "vehicle": {
        "in/keyframe",
        "in/factor",
        "in/link",
        *(f"rpc/{name}" for name in ASK),
        "op/resume",
        "alive/vehicle",
    },
    "operator": {
        *(f"rpc/{name}" for name in ASK),
        *(f"op/{name}" for name in COMMANDS),
        "alive/console/bridge",
    },
    "observer": {*(f"rpc/{name}" for name in READ), "alive/console/bridge"},
}


def put(session: zenoh.Session, key: str, payload: str) -> None:
    session.put(key, payload, encoding=zenoh.Encoding.APPLICATION_JSON, allowed_destination=REMOTE)


def arrived(*sessions: zenoh.Session) -> None:
    """What these sessions declared has arrived, since a question over the same link is answered."""
    for session in sessions:
        assert answers(session, f"{HULL}/rpc/ingest") == ["answered"]


def roles_and(*keys: str) -> pytest.MarkDecorator:
    return pytest.mark.parametrize(("role", "key"), [(role, key) for role in ROLES for key in keys])


@roles_and("in/keyframe", "in/factor", "in/link")
def test_publishing_events(secured: Secured, role: str, key: str) -> None:
    """An event of an unknown mission is refused aloud, if it arrives."""
    heard: queue.Queue[bytes] = queue.Queue()
    subscriber = secured.sessions["operator"].declare_subscriber(
        f"{HULL}/out/rejected", lambda sample: heard.put(sample.payload.to_bytes())
    )
    arrived(secured.sessions["operator"])
    session = secured.sessions[role]
    event = {"mission": f"of-{role}", "seq": 7, "stamp_ns": 0, "from": 1, "to": 2, "registered": True}
    put(session, f"{HULL}/{key}", json.dumps(event))
    # Over the same link, so the event has arrived, if it may, once this is answered.
    assert answers(session, f"{HULL}/rpc/ingest") == ["answered"]
    if key in MAY[role]:
        assert f"of-{role}" in heard.get(timeout=10.0).decode()
    else:
        # What is not allowed is heard of no more than an allowed one that is sent after it.
        put(secured.sessions["vehicle"], f"{HULL}/in/link", json.dumps(event | {"mission": "last"}))
        assert "last" in heard.get(timeout=10.0).decode()
    subscriber.undeclare()


@roles_and(*(f"rpc/{name}" for name in ASK))
def test_asking(secured: Secured, role: str, key: str) -> None:
    heard = answers(secured.sessions[role], f"{HULL}/{key}", {"paths": []} if key == "rpc/evaluate" else None)
    assert len(heard) == (1 if key in MAY[role] else 0)


@roles_and(*(f"op/{name}" for name in COMMANDS))
def test_commanding(secured: Secured, role: str, key: str) -> None:
    """A command that does nothing here: it is refused by the mission, if it arrives."""
    before = secured.ask("rpc/mission")
    heard = answers(secured.sessions[role], f"{HULL}/{key}?mission=nobody", {"reason": "not mine"})
    assert len(heard) == (1 if key in MAY[role] else 0)
    assert "answered" not in heard
    after = secured.ask("rpc/mission")
    assert (after["phase"], after["since_ns"]) == (before["phase"], before["since_ns"])


@pytest.mark.parametrize(
    "selector", ["pdn/**", "**", f"{HULL}/**", f"{HULL}/op/*", "pdn/*/v1/op/start", "@/**"]
)
@pytest.mark.parametrize("role", ROLES)
def test_asking_by_wildcards(secured: Secured, role: str, selector: str) -> None:
    """A pattern that reaches further than the role does is not heard at all."""
    heard = answers(secured.sessions[role], selector, {"reason": ""})
    if role == "operator" and selector in (f"{HULL}/op/*", "pdn/*/v1/op/start"):
        assert "answered" not in heard  # It may command; but a pattern is no key, and is refused aloud.
    else:
        assert heard == []


@roles_and(
    "in/*", "in/**", "**", "out/state", "out/ack", "out/decided", "out/rejected", "op/start", "elsewhere"
)
def test_publishing_what_only_the_daemon_says_or_nobody(secured: Secured, role: str, key: str) -> None:
    """Whatever is forged, nobody hears it."""
    heard: queue.Queue[str] = queue.Queue()
    listeners = [
        session.declare_subscriber("pdn/forged/v1/out/*", lambda sample: heard.put(str(sample.key_expr)))
        for session in secured.sessions.values()
    ]
    arrived(*secured.sessions.values())
    session = secured.sessions[role]
    put(session, f"pdn/forged/v1/{key}", "forged")
    session.delete(f"pdn/forged/v1/{key}", allowed_destination=REMOTE)
    put(session, key if key == "elsewhere" else "pdn/**", "forged")
    if role == "vehicle":
        # A refusal of the daemon, for the pattern under in/ or for this, comes last: what came before is all
        # there is.
        put(session, "pdn/forged/v1/in/link", "?")
        assert heard.get(timeout=10.0) == "pdn/forged/v1/out/rejected"
    else:
        assert answers(session, f"{HULL}/rpc/mission") == ["answered"]
        assert heard.empty()
    for listener in listeners:
        listener.undeclare()
    if role != "vehicle":
        assert heard.empty()


@pytest.mark.parametrize("role", ROLES)
def test_hearing_publications(secured: Secured, role: str) -> None:
    """Everyone hears what the planner publishes; here its state, once a second."""
    heard: queue.Queue[str] = queue.Queue()
    subscriber = secured.sessions[role].declare_subscriber(
        f"{HULL}/out/*", lambda sample: heard.put(str(sample.key_expr))
    )
    assert heard.get(timeout=10.0).startswith(f"{HULL}/out/")
    subscriber.undeclare()


@pytest.mark.parametrize("pattern", [f"{HULL}/in/*", f"{HULL}/**", "**", f"{HULL}/op/*"])
@pytest.mark.parametrize("role", ROLES)
def test_listening_in(secured: Secured, role: str, pattern: str) -> None:
    """Nobody hears events; by a pattern that holds them one hears only what comes in for the control."""
    heard: list[str] = []
    listening = secured.sessions[role].declare_subscriber(
        pattern, lambda sample: heard.append(str(sample.key_expr))
    )
    told: queue.Queue[str] = queue.Queue()
    control = secured.sessions[role].declare_subscriber(
        f"{HULL}/out/rejected", lambda sample: told.put(str(sample.key_expr))
    )
    arrived(secured.sessions[role])
    put(secured.sessions["vehicle"], f"{HULL}/in/link", "?")
    told.get(timeout=10.0)  # The refusal of that very event has come over the same link.
    assert set(heard) <= {f"{HULL}/out/rejected"}
    listening.undeclare()
    control.undeclare()


@roles_and("rpc/decision", "op/start")
def test_answering_in_the_daemon_s_place(secured: Secured, role: str, key: str) -> None:
    asked: list[str] = []

    def answer(query: zenoh.Query) -> None:
        asked.append(str(query.key_expr))
        query.reply(query.key_expr, "forged")

    rogue = secured.sessions[role].declare_queryable(f"pdn/*/v1/{key}", answer, complete=True)
    assert answers(secured.sessions[role], f"{HULL}/rpc/ingest") == ["answered"]
    for _ in range(3):
        heard = answers(secured.sessions["operator"], f"{HULL}/{key}?mission=nobody")
        assert heard == ["unknown_mission"]
    assert asked == []
    rogue.undeclare()


@pytest.mark.parametrize("role", ROLES)
def test_passing_for_the_planner(secured: Secured, role: str) -> None:
    token = secured.sessions[role].liveliness().declare_token("pdn/other/v1/alive/planner")
    assert answers(secured.sessions[role], f"{HULL}/rpc/ingest") == ["answered"]
    for session in (secured.sessions[other] for other in ROLES if other != role):
        found = session.liveliness().get("pdn/other/v1/alive/planner", timeout=5.0)
        assert [str(reply.ok.key_expr) for reply in found] == ["pdn/*/v1/alive/planner"], (
            "only the daemon's own"
        )
    token.undeclare()


@pytest.mark.parametrize("role", ROLES)
def test_seeing_the_planner_come_and_go(secured: Secured, role: str) -> None:
    session = secured.sessions[role]
    found = [reply for reply in session.liveliness().get(f"{HULL}/alive/planner", timeout=5.0) if reply.ok]
    assert len(found) == 1
    watched: queue.Queue[zenoh.SampleKind] = queue.Queue()
    watch = session.liveliness().declare_subscriber(
        f"{HULL}/alive/planner", lambda sample: watched.put(sample.kind), history=True
    )
    assert watched.get(timeout=10.0) == zenoh.SampleKind.PUT
    watch.undeclare()


def test_a_mission_goes_on_beside_all_that(secured: Secured) -> None:
    state = secured.ask("rpc/mission")
    assert (state["mission"], state["phase"], state["next_seq"]) == ("m", "running", 0)
    assert time.time_ns() > state["since_ns"]
