"""The client and the command line against the real daemon."""

from __future__ import annotations

import json
import shutil
import signal
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from proxy import Proxy
from running import Daemon
from typer.testing import CliRunner

from pdn import wire
from pdn.cli import build
from pdn.client import Client, EventsRefused, MissionLost, MissionStream, Refused, connect

EXAMPLE = Path(__file__).parents[2] / "examples" / "own_vehicle.py"
FACET = {"origin": [0, 0, 0], "u": [1, 0, 0], "v": [0, 1, 0], "length_u_m": 10, "length_v_m": 10}
STEP = wire.Pose(translation=(0.5, 0.0, 0.0), rotation=(0.0, 0.0, 0.0, 1.0))
START = wire.Pose(translation=(0.0, 0.0, 0.0), rotation=(0.0, 0.0, 0.0, 1.0))
COVARIANCE = 1e-4 * np.eye(6)
WAIT_S = 60.0


def begin(client: Client, mission: str = "m") -> None:
    client.configure({"mission": mission, "target": {"facets": [FACET]}})
    client.start("a test")


def survey(events: MissionStream, until: int, first: int = 0) -> int:
    """Sends a straight line of keyframes with odometry; the number of the last event."""
    last = 0
    for number in range(first, until):
        texture = 0.9 if number < 8 else 0.2
        last = events.keyframe(number, START if number == 0 else None, saliency=(texture, 0.5))
        if number > 0:
            last = events.odometry(number - 1, number, STEP, COVARIANCE)
    return last


def test_the_example_runs(daemon: Daemon) -> None:
    done = subprocess.run(
        [sys.executable, str(EXAMPLE), daemon.endpoint],
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    reason, action = done.stdout.splitlines()
    assert reason
    assert action.startswith("go ")


@pytest.mark.parametrize("json_on_wire", [False, True])
def test_a_survey_is_told_and_every_question_answered(daemon: Daemon, json_on_wire: bool) -> None:
    with connect("auv", daemon.endpoint, json_on_wire=json_on_wire) as client:
        begin(client)
        with client.mission_stream() as events:
            last = survey(events, 30)
            state = client.mission(after=last)
            assert (state.keyframes, state.next_seq) == (30, last + 1)
            decision = client.decision(after=last, detail="full")
            assert decision.graph_seq == last + 1
            assert client.decision(alpha=0.0).decision is None
            graph = client.graph(10, True)
            assert [keyframe.id for keyframe in graph.keyframes] == list(range(10, 30))
            assert graph.keyframes[0].covariance is not None
            assert client.waypoints().mission == "m"
            assert client.coverage().cell_m == 0.1
            assert len(client.link_model().cells) == 25
            assert len(client.evaluate([[(14.5, 0.0, 0.0), (0.0, 0.0, 0.0)]]).candidates) == 1
        status = client.ingest()
        assert (status.next_seq, status.buffered, status.rejected) == (last + 1, 0, 0)
        assert client.complete("done").phase is wire.Phase.COMPLETED


def test_a_refused_event_is_told_and_the_rest_goes_on(daemon: Daemon) -> None:
    with connect("auv", daemon.endpoint) as client:
        begin(client)
        events = client.mission_stream()
        events.keyframe(0, START)
        events.odometry(0, 7, STEP, COVARIANCE)
        events.keyframe(1)
        last = events.odometry(0, 1, STEP, COVARIANCE)
        with pytest.raises(EventsRefused) as caught:
            events.flush(WAIT_S)
        assert (caught.value.code, caught.value.seq) == ("unknown_keyframe", 1)
        assert client.mission(after=last).keyframes == 2
        events.flush(WAIT_S)
        events.close()


def test_a_link_that_breaks_loses_nothing(daemon: Daemon) -> None:
    proxy = Proxy(daemon.endpoint)
    try:
        with connect("auv", proxy.endpoint) as client:
            begin(client)
            with client.mission_stream() as events:
                last = survey(events, 100)
                proxy.cut()
                last = survey(events, 200, first=100)
                events.flush(WAIT_S)
            assert client.mission(after=last).keyframes == 200
    finally:
        proxy.close()


def test_a_daemon_that_stands_still_for_a_while_loses_nothing(daemon: Daemon) -> None:
    with connect("auv", daemon.endpoint) as client:
        begin(client)
        with client.mission_stream() as events:
            survey(events, 20)
            daemon.signal(signal.SIGSTOP)
            waking = threading.Timer(2.0, daemon.signal, [signal.SIGCONT])
            waking.start()
            last = survey(events, 300, first=20)
            events.flush(WAIT_S)
            waking.join()
        assert client.mission(after=last).keyframes == 300


def test_a_mission_that_nobody_has_is_refused_with_a_code(daemon: Daemon) -> None:
    with connect("nobody", daemon.endpoint) as client, pytest.raises(Refused) as caught:
        client.mission()
    assert caught.value.code in ("unknown_vehicle", "no_mission")


def test_a_pose_graph_is_imported(daemon: Daemon, tmp_path: Path) -> None:
    information = "100 0 0 0 0 0 100 0 0 0 0 100 0 0 0 400 0 0 400 0 400"
    path = tmp_path / "square.g2o"
    path.write_text(
        "".join(
            f"EDGE_SE3:QUAT {k} {(k + 1) % 4} 1 0 0 0 0 0.7071068 0.7071068 {information}\n" for k in range(4)
        )
    )
    arguments = ["import-g2o", str(path), "--json", "-e", daemon.endpoint]
    result = CliRunner().invoke(build(), arguments)
    assert result.exit_code == 0, result.stderr
    report = json.loads(result.stdout)
    # The square closes but for the rounding of its quaternions to 7 digits.
    assert report["chi2"] < 1e-9
    assert report["last_pose"]["translation"] == pytest.approx([0.0, 1.0, 0.0], abs=1e-6)
    # Keyframe 3 hangs on the anchor by one edge (0.01 m2, and 0.0025 rad2 on an arm of 1 m) and by three
    # others in parallel, which at best halve that.
    assert 0.5e-2 < report["last_covariance"][0] < 1.25e-2 + 1e-5


def test_a_daemon_whose_journals_are_lost_is_noticed(daemon: Daemon) -> None:
    with connect("auv", daemon.endpoint) as client:
        begin(client)
        events = client.mission_stream()
        survey(events, 5)
        events.flush(WAIT_S)
        daemon.kill()
        shutil.rmtree(daemon.folder / "state")
        daemon.start()
        with pytest.raises(MissionLost, match="no longer knows mission m"):
            go_on(events)
        events.close()


def go_on(events: MissionStream) -> None:
    survey(events, 10, first=5)
    events.flush(WAIT_S)
