"""How soon a killed daemon serves a long survey again, its checkpoint being as old as kills find it."""

import subprocess
import time
from pathlib import Path

import pytest
from daemon import Mission

from conftest import pdnd_binary, start_daemon
from json_zenoh import JsonVehicle, open_session
from survey_file import SurveyFile

FEW = 500
LATER = 10.0
"""How much longer than an empty daemon's start the return with so few keyframes may take; it was 2.3."""

MANY_S = 4.0
"""With many, on a quiet machine, s: twice the figure in the README."""


@pytest.mark.timeout(1800)
@pytest.mark.parametrize("keyframes", [FEW, pytest.param(20_000, marks=pytest.mark.torture)])
def test_a_killed_daemon_is_soon_back(tmp_path: Path, keyframes: int) -> None:
    survey = make_survey(tmp_path / "survey", keyframes)
    began = time.monotonic()
    running = start_daemon(tmp_path)
    empty_s = time.monotonic() - began
    mission = Mission(running, "auv", survey, {})
    mission.fly_to(keyframes)
    before = mission.client.mission()
    running.process.kill()
    running.process.wait()
    mission.session.close()
    mission.client.close()
    began = time.monotonic()
    again = start_daemon(tmp_path)
    took_s = time.monotonic() - began
    print(
        f"{keyframes} keyframes, {before.next_seq} events: back in {took_s:.2f} s, begun in {empty_s:.2f} s"
    )
    with open_session(again.endpoint) as session:
        after = JsonVehicle(session, "auv", "auv").ask("rpc/mission")
    assert (after["phase"], after["keyframes"], after["next_seq"]) == ("held", keyframes, before.next_seq)
    assert again.stop() == 0
    assert took_s < (LATER * empty_s if keyframes == FEW else MANY_S)


def make_survey(file: Path, keyframes: int) -> SurveyFile:
    program = pdnd_binary().with_name("pdn-perf")
    if not program.exists():
        pytest.skip(f"needs {program}: cargo build --release --locked -p pdn-perf")
    sizes = ["--keyframes", str(keyframes), "--salient-percent", "20", "--candidates", "1", "--repeats", "1"]
    subprocess.run([str(program), "run", *sizes, "--write", str(file)], stdout=subprocess.DEVNULL, check=True)
    return SurveyFile(file)
