"""Program end, threads, forks and Ctrl-C: each call ends, with an error that says what to do.

The programs are processes of their own; see `programs` for the bound.
"""

from __future__ import annotations

import gc
import signal
import socket
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import programs
import pytest
from fake_planner import FakePlanner
from proxy import Proxy

from pdn import wire
from pdn.client import Client, Closed, ConnectionFailed, OutboxUnusable, connect
from pdn.client.outbox_file import OutboxFile, outbox_path

FACET = {"origin": [0, 0, 0], "u": [1, 0, 0], "v": [0, 1, 0], "length_u_m": 10, "length_v_m": 10}
CONFIG = {"mission": "m", "target": {"facets": [FACET]}}
LONG_S = 600.0
"""A time-out that no call may wait for."""


def wait_until(condition: Callable[[], bool], what: str) -> None:
    end = time.monotonic() + programs.BOUND_S
    while not condition():
        assert time.monotonic() < end, f"waited in vain for {what}"
        time.sleep(0.01)


@pytest.fixture
def client(planner: FakePlanner) -> Iterator[Client]:
    connected = connect("auv", planner.endpoint, timeout_s=5.0)
    connected.configure(CONFIG)
    yield connected
    planner.frozen.clear()
    connected.close()


# --- the end of the program ---

OPEN = {
    "a client": "client = begin()",
    "a watch": "client = begin(); watch = client.watch()",
    "a watch that is iterated": "client = begin(); seen = iter(client.watch()); next(seen)",
    "a stream": "client = begin(); events = client.mission_stream(); events.keyframe(0)",
    "a stream that was entered": "client = begin(); events = client.mission_stream().__enter__()",
    "a console": "client = connect('auv', endpoint, console='c'); watch = client.watch()",
    "a reader in a daemon thread": (
        "client = begin(); watch = client.watch()\n"
        "threading.Thread(target=lambda: list(watch), daemon=True).start()"
    ),
}


@pytest.mark.parametrize("ending", ["", "\nraise RuntimeError('mine')", "\nsys.exit(7)"])
@pytest.mark.parametrize("what", OPEN)
def test_a_program_ends_whatever_it_has_open(planner: FakePlanner, what: str, ending: str) -> None:
    code, _, err = programs.run(OPEN[what] + ending, planner.endpoint)
    assert code == {"": 0, "\nsys.exit(7)": 7}.get(ending, 1), err
    assert ("mine" in err) == ("mine" in ending)
    assert "FATAL" not in err
    assert "Exception ignored" not in err


def test_no_program_is_aborted_at_its_end(planner: FakePlanner) -> None:
    """Where nobody waits for the threads that read, one program in ten is: 36 go well once in 44 times."""
    program = "client = connect('auv', endpoint, timeout_s=60); watches = [client.watch() for _ in range(8)]"
    for _ in range(6):
        for process in [programs.start(program, planner.endpoint) for _ in range(6)]:
            code, _, err = programs.end(process)
            assert (code, err) == (0, "")


def test_a_program_that_ends_brings_what_its_stream_has_taken(planner: FakePlanner) -> None:
    program = "events = begin().mission_stream()\nfor k in range(300): events.keyframe(k)"
    code, _, err = programs.run(program, planner.endpoint)
    assert (code, err) == (0, "")
    assert planner.next_seq == 300


@pytest.mark.parametrize("outbox", ["", "OUTBOX"])
def test_a_program_that_ends_says_what_was_not_confirmed(
    planner: FakePlanner, tmp_path: Path, outbox: str
) -> None:
    planner.fate = lambda seq, copy: "lose"
    named = f"outbox={str(tmp_path)!r}" if outbox else ""
    program = f"events = begin().mission_stream({named})\nevents.keyframe(0); events.keyframe(1)"
    code, _, err = programs.run(program, planner.endpoint)
    assert code == 0
    assert "2 events of mission" in err
    assert ("Events 0 to 1 are kept in " if outbox else "Events 0 to 1 may not have reached") in err
    assert len(list(tmp_path.iterdir())) == bool(outbox)


def test_a_program_ends_though_its_planner_is_gone(planner: FakePlanner) -> None:
    program = (
        "client = begin(); watch = client.watch(); events = client.mission_stream()\n"
        "events.keyframe(0); events.flush(); print('ready', flush=True); sys.stdin.readline()"
    )
    process = programs.start(program, planner.endpoint)
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    planner.stop()
    assert programs.end(process)[0] == 0


# --- closing ---


def calls(client: Client) -> dict[str, Callable[[], object]]:
    events, watch = client.mission_stream(), client.watch()
    return {
        "mission": client.mission,
        "decision": lambda: client.decision(after=3),
        "evaluate": lambda: client.evaluate([[(0, 0, 0)]]),
        "graph": client.graph,
        "ingest": client.ingest,
        "configure": lambda: client.configure(CONFIG),
        "start": client.start,
        "watch": client.watch,
        "next": lambda: watch.next(0.1),
        "mission_stream": lambda: client.mission_stream("m"),
        "announce": lambda: client.announce("pdn/auv/v1/alive/x"),
        "wait_for_planner": lambda: client.wait_for_planner(1.0),
        "keyframe": lambda: events.keyframe(0),
        "depth": lambda: events.depth(0, 1.0, 1.0),
    }


def test_what_is_called_after_the_closing_says_so(client: Client) -> None:
    called = calls(client)
    client.close()
    for name, call in called.items():
        with pytest.raises(Closed, match=r"connect again|mission_stream"):
            print(name, call())
    client.close()
    assert client.endpoint
    with client:
        pass


def test_leaving_a_stream_that_was_closed_tells_of_what_is_lost(planner: FakePlanner, client: Client) -> None:
    with client.mission_stream() as events:
        events.keyframe(0)
        events.flush()
        events.close()
        events.close()
    planner.fate = lambda seq, copy: "lose"
    events = client.mission_stream()
    events.keyframe(1)
    client.close()
    with pytest.raises(Closed, match="stream of mission m is closed"):
        events.__exit__(None, None, None)


UNDER_WAY: dict[str, Callable[[Client], object]] = {
    "a question": lambda client: client.coverage(timeout_s=LONG_S),
    "a question after an event": lambda client: client.decision(after=9, timeout_s=LONG_S),
    "a command": lambda client: client.start(timeout_s=LONG_S),
    "a configuration": lambda client: client.configure(CONFIG, timeout_s=LONG_S),
    "a watch": lambda client: [watch.next(LONG_S) for watch in [client.watch()] for _ in range(2)],
    "waiting for the planner": lambda client: client.wait_for_planner(LONG_S),
    "waiting for room": lambda client: fill(client),
    "a flush": lambda client: flush(client),
}


def fill(client: Client) -> None:
    events = client.mission_stream("m", window=4, timeout_s=LONG_S)
    for number in range(6):
        events.keyframe(number)


def flush(client: Client) -> None:
    events = client.mission_stream("m")
    events.keyframe(0)
    events.flush(LONG_S)


@pytest.mark.parametrize("what", UNDER_WAY)
def test_another_thread_closes_the_client(planner: FakePlanner, client: Client, what: str) -> None:
    planner.fate = lambda seq, copy: "lose"
    before = len(planner.asked)
    streams = what in ("waiting for room", "a flush")
    if not streams and what != "a watch":
        planner.frozen.set()
    caught: list[BaseException | str] = []

    def use() -> None:
        try:
            UNDER_WAY[what](client)
            caught.append("it returned")
        except BaseException as error:
            caught.append(error)

    user = threading.Thread(target=use, daemon=True)
    user.start()
    if what == "a watch":
        wait_until(lambda: heard() >= 4, "the watch")
    elif streams:
        wait_until(lambda: planner.copies.get(0, 0) > 0, "the first event")
    else:
        wait_until(lambda: len(planner.asked) > before, "the question")
    client.close()
    user.join(programs.BOUND_S)
    assert [type(error) for error in caught] == [Closed], caught


def test_readers_of_a_watch_end_with_the_client(client: Client) -> None:
    watch = client.watch()
    assert watch.next(programs.BOUND_S) is not None
    ended = [threading.Event() for _ in range(3)]

    def read(event: threading.Event) -> None:
        for _ in watch:
            pass
        event.set()

    for event in ended:
        threading.Thread(target=read, args=(event,), daemon=True).start()
    client.close()
    assert all(event.wait(programs.BOUND_S) for event in ended)


def test_a_stream_closes_while_another_thread_waits_for_room(planner: FakePlanner, client: Client) -> None:
    planner.fate = lambda seq, copy: "lose"
    events = client.mission_stream(window=2, timeout_s=LONG_S)
    events.keyframe(0)
    events.keyframe(1)
    waiting = threading.Event()
    caught: list[BaseException] = []

    def post() -> None:
        waiting.set()
        try:
            events.keyframe(2)
        except BaseException as error:
            caught.append(error)

    poster = threading.Thread(target=post, daemon=True)
    poster.start()
    waiting.wait()
    events.close()
    poster.join(programs.BOUND_S)
    assert [type(error) for error in caught] == [Closed]
    assert client.mission().mission == "m", "the client goes on"


def test_two_threads_close_at_once(client: Client) -> None:
    client.mission_stream()
    closers = [threading.Thread(target=client.close, daemon=True) for _ in range(8)]
    for closer in closers:
        closer.start()
    for closer in closers:
        closer.join(programs.BOUND_S)
        assert not closer.is_alive()


def heard() -> int:
    return sum(thread.name == "pdn-heard" for thread in threading.enumerate())


def test_what_is_dropped_hears_nothing_more(planner: FakePlanner, client: Client) -> None:
    before = heard()
    for _ in range(5):
        next(iter(client.watch()))
    dropped = client.watch()
    del dropped
    gc.collect()
    wait_until(lambda: heard() == before, "the threads of dropped watches to end")


def test_a_client_that_is_dropped_ends_its_session(planner: FakePlanner) -> None:
    proxy = Proxy(planner.endpoint)
    try:
        client = connect("auv", proxy.endpoint)
        gone: list[int] = []
        threads = [thread for thread in threading.enumerate() if thread.name == "pdn-close"]
        del client
        gc.collect()
        for thread in threads[-1:]:
            thread.join(programs.BOUND_S)
            gone.append(thread.is_alive())
        assert gone == [False]
    finally:
        proxy.close()


def test_an_outbox_that_cannot_be_kept_is_told_by_the_next_call(
    planner: FakePlanner, client: Client, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(self: OutboxFile, *arguments: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(OutboxFile, "sync", fail)
    events = client.mission_stream(outbox=tmp_path)
    events.keyframe(0)
    with pytest.raises(OutboxUnusable, match="No space left"):
        events.flush(LONG_S)
    events.close()
    assert outbox_path(tmp_path, "auv", "m").exists(), "what was taken is kept"


# --- forks ---

FORKS = {
    "a question": "told(client.mission, timeout_s=1.0)",
    "a command": "told(client.pause)",
    "a decision": "told(client.decision, after=1)",
    "a watch": "told(client.watch)",
    "an open watch": "told(watch.next, 1.0); told(next, iter(watch))",
    "a stream": "told(client.mission_stream, 'm')",
    "an event": "told(events.keyframe, 5)",
    "a flush": "told(events.flush, 1.0)",
    "another client": "told(connect, 'auv', endpoint)",
}


@pytest.mark.parametrize("what", FORKS)
def test_a_forked_process_is_told_that_it_cannot(planner: FakePlanner, what: str) -> None:
    program = (
        "client = begin(); watch = client.watch(); events = client.mission_stream()\n"
        f"in_child(lambda: [{FORKS[what].replace('; ', ', ')}])\n"
        "events.keyframe(0); events.flush(); print(client.mission().keyframes)"
    )
    code, out, err = programs.run(program, planner.endpoint)
    assert code == 0, err
    *said, child, keyframes = out.splitlines()
    assert all(line.startswith("Forked True Process ") for line in said), out
    assert all("'spawn'" in line for line in said)
    assert said
    assert (child, keyframes) == ("child 0", "1")


@pytest.mark.parametrize(
    "work",
    ["pass", "client.close()", "del globals()['client']", "events.close()", "watch.close()", "sys.exit(0)"],
)
def test_a_forked_process_ends(planner: FakePlanner, tmp_path: Path, work: str) -> None:
    program = (
        "client = begin(); watch = client.watch()\n"
        f"events = client.mission_stream(outbox={str(tmp_path)!r})\n"
        "events.keyframe(0); events.flush()\n"
        f"in_child(lambda: exec({work!r}, globals()))\n"
        f"print(len(os.listdir({str(tmp_path)!r})))\n"
        "events.keyframe(1); events.flush(); events.close(); client.close()"
    )
    code, out, err = programs.run(program, planner.endpoint)
    assert (code, out) == (0, "child 0\n1\n"), err
    assert planner.next_seq == 2, "the parent's stream and its file went on"


@pytest.mark.parametrize("method", ["fork", "spawn", "forkserver"])
def test_multiprocessing_by_each_method(planner: FakePlanner, tmp_path: Path, method: str) -> None:
    worker = tmp_path / "worker.py"
    worker.write_text(
        "import multiprocessing, sys\n"
        "from pdn.client import connect, PdnError\n"
        "def work(endpoint, answers):\n"
        "    try:\n"
        "        with connect('auv', endpoint) as client:\n"
        "            answers.put(type(client.ingest).__name__)\n"
        "    except PdnError as error:\n"
        "        answers.put(type(error).__name__)\n"
    )
    program = (
        f"sys.path.insert(0, {str(tmp_path)!r}); import multiprocessing, worker\n"
        f"context = multiprocessing.get_context({method!r}); answers = context.Queue()\n"
        "def one():\n"
        "    process = context.Process(target=worker.work, args=(endpoint, answers)); process.start()\n"
        "    print(answers.get(timeout=50), flush=True)\n"
        "    process.join(); print(process.exitcode, flush=True)\n"
        "if __name__ == '__main__':\n"
        "    one(); client = begin(); watch = client.watch(); one(); client.mission()\n"
    )
    script = tmp_path / "main.py"
    script.write_text(programs.PRELUDE + program)
    code, out, err = programs.run(
        f"import subprocess; sys.exit(subprocess.call([sys.executable, {str(script)!r}, endpoint]))",
        planner.endpoint,
    )
    second = "Forked" if method == "fork" else "method"
    assert (code, out.split()) == (0, ["method", "0", second, "0"]), err


# --- Ctrl-C ---

CONNECTED = "client = begin(); events = client.mission_stream(window=4, timeout_s=600)\n"
INTERRUPTED = {
    "a question": CONNECTED + "READY; client.coverage(timeout_s=600)",
    "a decision": CONNECTED + "READY; client.decision(after=9, timeout_s=600)",
    "a command": CONNECTED + "READY; client.pause(timeout_s=600)",
    "waiting for the planner": CONNECTED + "READY; client.wait_for_planner(600)",
    "opening a stream": CONNECTED + "events.close(); READY; client.mission_stream('m')",
    "a watch": CONNECTED + "watch = client.watch(); watch.next(60); READY; watch.next(600)",
    "iterating a watch": CONNECTED + "watch = client.watch(); watch.next(60); READY; list(watch)",
    "waiting for room": CONNECTED + "READY\nfor k in range(6): events.keyframe(k)",
    "a flush": CONNECTED + "READY; events.keyframe(0); events.flush(600)",
    "leaving a stream": CONNECTED + "READY\nwith events: events.keyframe(0)",
}


@pytest.mark.parametrize("what", INTERRUPTED)
def test_ctrl_c_ends_each_call(planner: FakePlanner, what: str) -> None:
    planner.fate = lambda seq, copy: "lose"
    ready = "print('ready', flush=True); sys.stdin.readline()"
    process = programs.start(INTERRUPTED[what].replace("READY", ready), planner.endpoint)
    assert process.stdout is not None
    assert process.stdin is not None
    assert process.stdout.readline() == "ready\n"
    planner.frozen.set()
    asked, heard_at = len(planner.asked), planner.copies.get(0, 0)
    process.stdin.write("\n")
    process.stdin.flush()
    if "watch" not in what:
        wait_until(lambda: len(planner.asked) > asked or planner.copies.get(0, 0) > heard_at, "the call")
    programs.until_asleep(process.pid)
    process.send_signal(signal.SIGINT)
    code, _, err = programs.end(process)
    planner.frozen.clear()
    assert "KeyboardInterrupt" in err
    assert code == -signal.SIGINT


def test_ctrl_c_ends_connecting_to_who_does_not_answer() -> None:
    with socket.socket() as silent:
        silent.bind(("127.0.0.1", 0))
        silent.listen()
        endpoint = f"tcp/127.0.0.1:{silent.getsockname()[1]}"
        process = programs.start("connect('auv', endpoint, connect_timeout_s=600)", endpoint)
        silent.settimeout(programs.BOUND_S)
        with silent.accept()[0]:  # It has come as far as that.
            programs.until_asleep(process.pid)
            process.send_signal(signal.SIGINT)
            code, _, err = programs.end(process)
    assert "KeyboardInterrupt" in err
    assert code == -signal.SIGINT


# --- several endpoints ---


def test_endpoints_are_tried_in_turn_and_the_one_that_serves_is_told(planner: FakePlanner) -> None:
    with socket.socket() as silent, socket.socket() as closed:
        silent.bind(("127.0.0.1", 0))
        silent.listen()
        closed.bind(("127.0.0.1", 0))
        bad = [f"tcp/127.0.0.1:{one.getsockname()[1]}" for one in (closed, silent)]
        for given in ([*bad, planner.endpoint], (*bad, planner.endpoint)):
            with connect("auv", given, connect_timeout_s=0.5) as client:
                assert client.endpoint == planner.endpoint
        with connect("auv", *bad, planner.endpoint, connect_timeout_s=0.5) as client:
            assert client.endpoint == planner.endpoint
        with pytest.raises(ConnectionFailed) as caught:
            connect("auv", *bad, connect_timeout_s=0.5)
    lines = str(caught.value).splitlines()
    assert lines[0] == "None of 2 endpoints serves auv:"
    assert lines[1].startswith(f"  {bad[0]}: ")
    assert "nothing listens there" in lines[1]
    assert lines[2].startswith(f"  {bad[1]}: ")
    assert "does not speak Zenoh" in lines[2]


def test_an_endpoint_whose_planner_is_another_vehicles_is_passed_over(planner: FakePlanner) -> None:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        other = FakePlanner(f"tcp/127.0.0.1:{probe.getsockname()[1]}", vehicle="other")
    other.start()
    try:
        with connect("auv", other.endpoint, planner.endpoint, connect_timeout_s=2.0) as client:
            assert client.endpoint == planner.endpoint
    finally:
        other.stop()


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ([], "No endpoint was given"),
        (["tcp/127.0.0.1:7447", "localhost:7447"], "'localhost:7447' is no Zenoh"),
    ],
)
def test_endpoints_that_are_none_are_told_at_once(given: list[str], told: str) -> None:
    with pytest.raises(ConnectionFailed, match=told):
        connect("auv", given, connect_timeout_s=0.3)


def test_after_a_break_the_other_endpoint_serves_and_is_told(planner: FakePlanner) -> None:
    ways = [Proxy(planner.endpoint), Proxy(planner.endpoint)]
    try:
        with connect("auv", *(way.endpoint for way in ways), timeout_s=programs.BOUND_S) as client:
            client.configure(CONFIG)
            assert client.endpoint == ways[0].endpoint
            ways[0].close()
            ways[0].cut()
            assert client.mission().mission == "m"
            wait_until(lambda: client.endpoint == ways[1].endpoint, "the other way")
    finally:
        for way in ways:
            way.close()


# --- stamps ---


def test_every_event_takes_the_time_of_its_measurement(planner: FakePlanner, client: Client) -> None:
    origin = wire.Pose(translation=(0.0, 0.0, 0.0), rotation=(0.0, 0.0, 0.0, 1.0))
    six = [float(row == column) for row in range(6) for column in range(6)]
    five = [float(row == column) for row in range(5) for column in range(5)]
    three = [float(row == column) for row in range(3) for column in range(3)]
    day = 1_700_000_000_000_000_000
    with client.mission_stream() as events:
        events.keyframe(0, origin, stamp_ns=day)
        events.keyframe(1, stamp_ns=day + 1)
        events.prior(0, origin, six, stamp_ns=day + 2)
        events.odometry(0, 1, origin, six, stamp_ns=day + 3)
        events.relative(0, 1, origin, six, stamp_ns=day + 4)
        events.camera(0, 1, [1, 0, 0], [0, 0, 0, 1], five, stamp_ns=day + 5)
        events.attitude(0, [0, 0, 0, 1], 0.1, stamp_ns=day + 6)
        events.depth(0, 6.5, 0.04, stamp_ns=day + 7)
        events.position(0, [1, 2, 3], three, stamp_ns=day + 8)
        events.factor(wire.FactorKind.Depth(keyframe=0, depth_m=6.5, variance_m2=0.04), stamp_ns=day + 9)
        events.link(0, 1, True, stamp_ns=day + 10)
        events.depth(0, 6.5, 0.04, stamp_ns=0)
        before_ns = time.time_ns()
        events.depth(0, 6.5, 0.04)
        after_ns = time.time_ns()
    stamps = [event.stamp_ns for event in planner.applied.events]
    assert stamps[:-1] == [*range(day, day + 11), 0]
    assert before_ns <= stamps[-1] <= after_ns


@pytest.mark.parametrize("stamp", [-1, 1 << 64, 1.7e18, "1700000000", True, float("nan")])
def test_a_stamp_that_is_none_takes_no_number(client: Client, stamp: object) -> None:
    with client.mission_stream() as events:
        with pytest.raises(wire.WireError, match="whole number, 0 to 2\\^64 - 1"):
            events.depth(0, 6.5, 0.04, stamp_ns=stamp)  # type: ignore[arg-type]
        assert events.next_seq == 0
