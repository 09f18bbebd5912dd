"""How soon a killed daemon serves a long survey again, its checkpoint being as old as kills find it: in less
time than the same machine took to be told of the survey.
"""

import subprocess
import time
from pathlib import Path

import pytest
from daemon import Mission

from conftest import pdnd_binary, start_daemon
from json_zenoh import JsonVehicle, open_session
from survey_file import SurveyFile

STARTS = 5
"""Starts of an empty daemon that a return may take beside that: a busy machine is slow to start programs."""

MANY = 20_000
MANY_S = 4.0
"""How soon with so many keyframes on a quiet machine, s: two are asked for (the figure in the README)."""


@pytest.mark.timeout(1800)
@pytest.mark.parametrize("keyframes", [500, pytest.param(MANY, marks=pytest.mark.torture)])
def test_a_killed_daemon_is_soon_back(tmp_path: Path, keyframes: int) -> None:
    survey = make_survey(tmp_path / "survey", keyframes)
    began = time.monotonic()
    running = start_daemon(tmp_path)
    start_s = time.monotonic() - began
    mission = Mission(running, "auv", survey, {})
    began = time.monotonic()
    mission.fly_to(keyframes)
    told_s = time.monotonic() - began
    before = mission.client.mission()
    running.process.kill()
    running.process.wait()
    mission.session.close()
    mission.client.close()
    began = time.monotonic()
    again = start_daemon(tmp_path)
    took_s = time.monotonic() - began
    with open_session(again.endpoint) as session:
        after = JsonVehicle(session, "auv", "auv").ask("rpc/mission")
    assert (after["phase"], after["keyframes"], after["next_seq"]) == ("held", keyframes, before.next_seq)
    assert again.stop() == 0
    print(
        f"{keyframes} keyframes, {before.next_seq} events: told in {told_s:.2f} s, back in {took_s:.2f} s; "
        f"an empty daemon starts in {start_s:.2f} s"
    )
    assert took_s < told_s + STARTS * start_s
    if keyframes == MANY:
        assert took_s < MANY_S


def make_survey(file: Path, keyframes: int) -> SurveyFile:
    program = pdnd_binary().with_name("pdn-perf")
    if not program.exists():
        pytest.skip(f"needs {program}: cargo build --release --locked -p pdn-perf")
    sizes = ["--keyframes", str(keyframes), "--salient-percent", "20", "--candidates", "1", "--repeats", "1"]
    subprocess.run([str(program), "run", *sizes, "--write", str(file)], stdout=subprocess.DEVNULL, check=True)
    return SurveyFile(file)
