"""Nothing lost and nothing counted twice, though the vehicle's program is killed and its cable cut; and two
programs that take themselves for the same vehicle.
"""

from __future__ import annotations

import json
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from proxy import Proxy
from running import Daemon

from pdn import wire
from pdn.client import Client, MissionStream, MissionUnknown, PdnError, TwoPublishers, connect

FACET = {"origin": [0, 0, 0], "u": [1, 0, 0], "v": [0, 1, 0], "length_u_m": 10, "length_v_m": 10}
PROGRAM = Path(__file__).with_name("resuming_vehicle.py")
KEYFRAMES = 3000
KILLS = 12


def begin(client: Client) -> None:
    client.configure({"mission": "m", "target": {"facets": [FACET]}})
    client.start("a test")


def start(endpoint: str, folder: Path) -> tuple[subprocess.Popen[str], int]:
    """The vehicle's program, and the number of the event from which it goes on."""
    command = [sys.executable, str(PROGRAM), endpoint, str(folder), str(KEYFRAMES)]
    program = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert program.stdout is not None
    line = program.stdout.readline()
    assert program.stderr is not None
    assert line, program.stderr.read()
    return program, int(line)


@pytest.mark.timeout(300)
def test_a_program_that_is_killed_again_and_again_loses_nothing(daemon: Daemon, tmp_path: Path) -> None:
    draw = random.Random(1)
    proxy = Proxy(daemon.endpoint)
    stands = []
    with connect("auv", daemon.endpoint) as operator:
        begin(operator)
        kills = 0
        while True:
            program, next_seq = start(proxy.endpoint, tmp_path / "outbox")
            stands.append(next_seq)
            if kills == KILLS:
                break
            # Killed once it has gone on by so many events, wherever it is with them by then.
            until = next_seq + draw.randrange(1, 600)
            give_up_s = time.monotonic() + 30.0
            while operator.ingest().next_seq < until and program.poll() is None:
                assert time.monotonic() < give_up_s
            if kills % 3 == 2:
                proxy.cut()
            program.kill()
            program.wait()
            kills += 1
        assert program.wait(timeout=120) == 0, program.stderr.read() if program.stderr else ""
        print(f"{kills} kills; each time it went on from {stands}")
        assert len(set(stands)) == KILLS + 1, "it got on between the kills"
        assert stands == sorted(stands)
        status = operator.ingest()
        assert (status.next_seq, status.buffered, status.rejected) == (2 * KEYFRAMES - 1, 0, 0)
        graph = operator.graph(timeout_s=60.0)
        assert [keyframe.id for keyframe in graph.keyframes] == list(range(KEYFRAMES))
        assert graph.factors["odometry"] == KEYFRAMES - 1
        places = [keyframe.pose.translation[0] for keyframe in graph.keyframes]
        np.testing.assert_allclose(places, 0.5 * np.arange(KEYFRAMES), atol=1e-6)
    assert not list((tmp_path / "outbox").iterdir()), "all is durable"
    proxy.close()


@pytest.mark.timeout(120)
def test_a_killed_simulator_leaves_what_the_next_one_brings(daemon: Daemon, tmp_path: Path) -> None:
    """It is killed while the daemon stands still, so that events are certainly under way."""
    command = [
        sys.executable,
        "-m",
        "pdn.cli",
        "sim",
        "seafloor",
        "--mission",
        "m",
        "--vehicle",
        "auv",
        "--json",
    ]
    options = ["-e", daemon.endpoint, "--outbox", str(tmp_path / "outbox")]
    with connect("auv", daemon.endpoint) as operator:
        flying = subprocess.Popen([*command, *options], stdout=subprocess.DEVNULL)
        until(lambda: stands(operator) > 100)
        daemon.signal(signal.SIGSTOP)
        file = tmp_path / "outbox/auv.m.outbox"
        until(lambda: file.stat().st_size > 2000)
        flying.kill()
        flying.wait()
        daemon.signal(signal.SIGCONT)
        done = subprocess.run([*command, *options], capture_output=True, text=True, timeout=60, check=False)
        assert done.returncode == 0, done.stderr
        brought = json.loads(done.stdout)
        assert brought["brought"] > 0
        status = operator.ingest(mission="m")
        assert (status.next_seq, status.buffered, status.rejected) == (brought["next_seq"], 0, 0)
    assert not file.exists()


def stands(client: Client) -> int:
    try:
        return client.ingest(mission="m").next_seq
    except MissionUnknown:
        return 0


def until(holds: Callable[[], bool], bound_s: float = 60.0) -> None:
    give_up_s = time.monotonic() + bound_s
    while not holds():
        assert time.monotonic() < give_up_s
        time.sleep(0.005)


def send_until_broken(events: MissionStream, first: int, spacing_m: float) -> PdnError:
    """Keyframes whose place tells who sent them."""
    try:
        for number in range(first, first + 5000):
            pose = wire.Pose(translation=(spacing_m * number, 0.0, 0.0), rotation=(0.0, 0.0, 0.0, 1.0))
            events.keyframe(number, pose, saliency=(0.5, 0.5))
        events.flush(30.0)
    except PdnError as error:
        return error
    raise AssertionError("nothing was wrong")


@pytest.mark.timeout(120)
def test_two_programs_for_one_mission_are_both_told_and_corrupt_nothing(daemon: Daemon) -> None:
    with connect("auv", daemon.endpoint) as one, connect("auv", daemon.endpoint) as other:
        begin(one)
        streams = [client.mission_stream("m", on_rejected="collect") for client in (one, other)]
        first = streams[0].keyframe(0, saliency=(0.5, 0.5), stamp_ns=1)
        streams[0].flush(30.0)
        second = streams[1].keyframe(1, saliency=(0.5, 0.5), stamp_ns=2)  # With the number of the first.
        assert first == second == 0
        for stream, spacing_m in zip(streams, (1.0, 2.0), strict=True):
            error = send_until_broken(stream, 10, spacing_m)
            assert isinstance(error, TwoPublishers)
            assert "Another program sends events of mission m" in str(error)
            stream.close()
        # What was accepted first stands, each number once.
        # Events that were under way when their stream closed are still being applied.
        give_up_s = time.monotonic() + 30.0
        while (status := one.ingest(mission="m")).next_seq != one.graph().graph_seq:
            assert time.monotonic() < give_up_s, status
        assert status.rejected == 0
        # The mission goes on with one program.
        with one.mission_stream("m") as alone:
            last = alone.keyframe(9999, saliency=(0.5, 0.5))
        assert one.ingest().next_seq == last + 1
