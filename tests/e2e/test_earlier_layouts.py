"""A journal that earlier layouts wrote, by the commands and by a daemon that takes it up."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from conftest import ROOT, pdnd_binary, start_daemon
from json_zenoh import JsonVehicle, open_session

RECORDED = ROOT / "service/crates/state/tests/data/mission.redb"


@pytest.fixture
def journal(tmp_path: Path) -> Path:
    path = tmp_path / "state/recorded/000000-mission.redb"
    path.parent.mkdir(parents=True)
    shutil.copyfile(RECORDED, path)
    return path


def pdnd(*arguments: object) -> str:
    command = [str(pdnd_binary()), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=100, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_commands_read_replay_and_save_it(journal: Path) -> None:
    before = journal.read_bytes()
    records = [json.loads(line) for line in pdnd("journal", "--json", journal).splitlines()]
    assert records[0]["content"]["config"]["gate_sigmas"] == 20.0
    assert [record["record"] for record in records] == list(range(len(records)))
    pdnd("replay", journal)
    assert journal.read_bytes() == before
    pdnd("recover", journal, "--replace")
    saved = [json.loads(line) for line in pdnd("journal", "--json", journal).splitlines()]
    assert saved == records
    pdnd("replay", journal)


def test_a_daemon_serves_it_and_begins_the_next_mission(journal: Path, tmp_path: Path) -> None:
    for _ in range(2):  # The second time it reads what the first has left.
        daemon = start_daemon(tmp_path)
        with open_session(daemon.endpoint) as session:
            state = JsonVehicle(session, "recorded", "mission").ask("rpc/mission")
            assert (state["phase"], state["next_seq"], state["revisits"]) == ("completed", 451, 7)
        assert daemon.stop() == 0
    assert journal.exists()
