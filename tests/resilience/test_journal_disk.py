"""Disks that fill up or cannot be written, and journals that are damaged: each has a named outcome, the
vehicle's events go on, and nothing is guessed.
"""

import json
import os
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import zenoh

from conftest import pdnd_binary, start_daemon, wait_until
from json_zenoh import ErrorReply, JsonVehicle, open_session
from survey import config, fly

Json = dict[str, Any]


@contextmanager
def small_disk(folder: Path, kilobytes: int) -> Iterator[Path]:
    """A file system of its own, of that size."""
    place = folder / "state"
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs", str(place)]
    if os.geteuid() != 0 or subprocess.run(mount, capture_output=True, check=False).returncode != 0:
        pytest.skip("needs root and a mount of its own, for a disk that fills up")
    try:
        yield place
    finally:
        subprocess.run(["umount", "--lazy", str(place)], capture_output=True, check=True)


def pdnd(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([str(pdnd_binary()), *arguments], capture_output=True, text=True, check=False)


def begin(session: zenoh.Session, mission: str = "m") -> JsonVehicle:
    vehicle = JsonVehicle(session, "auv", mission)
    vehicle.ask("op/configure", config(mission))
    vehicle.ask("op/start", {"reason": "the vehicle is at sea"})
    return vehicle


def stopped_mission(folder: Path) -> Path:
    """A daemon that has flown a small survey and is stopped; its journal."""
    running = start_daemon(folder)
    with open_session(running.endpoint) as session:
        vehicle = begin(session)
        fly(vehicle, lanes=2)
        vehicle.ask("rpc/decision", after=vehicle.seq - 1)
    assert running.stop() == 0
    (journal,) = (folder / "state" / "auv").glob("*.redb")
    return journal


def problem(ask: Any) -> Json:
    with pytest.raises(ErrorReply) as refused:
        ask()
    return refused.value.problem


def durable(vehicle: JsonVehicle) -> bool:
    status = vehicle.ask("rpc/ingest")
    return bool(status["durable_seq"] == status["next_seq"] == vehicle.seq)


def test_a_disk_that_fills_up_and_has_room_again(tmp_path: Path) -> None:
    with small_disk(tmp_path, 2500) as state:
        running = start_daemon(tmp_path)
        with open_session(running.endpoint) as session:
            vehicle = begin(session)
            (state / "ballast").write_bytes(b"x")
            fill(state / "ballast")
            fly(vehicle, lanes=3)
            told = vehicle.wait_applied()
            assert told["keyframes"] > 40, "events go on"
            wait_until(lambda: not vehicle.ask("rpc/mission")["health"]["ok"], "the mission's health to tell")
            (finding,) = vehicle.ask("rpc/mission")["health"]["findings"]
            assert "disk is full" in finding
            assert ".redb" in finding
            assert "make room" in finding
            status = vehicle.ask("rpc/ingest")
            assert status["durable_seq"] < status["next_seq"] == vehicle.seq
            # What must be recorded first is refused; what keeps the vehicle from going anywhere is done.
            refused = problem(lambda: vehicle.ask("rpc/decision", detail="choice"))
            assert refused["code"] == "not_durable"
            assert "it was not done" in refused["message"]
            assert vehicle.ask("rpc/mission")["decisions"] == 0, "what is not given is not counted"
            assert vehicle.ask("rpc/decision", alpha=0.5)["decision"] is None, "a what-if needs no record"
            refused = problem(lambda: vehicle.ask("op/pause", {"reason": "look at the disk"}))
            assert refused["code"] == "not_durable"
            assert "op/pause was done all the same" in refused["message"]
            assert vehicle.ask("rpc/mission")["phase"] == "paused"
            refused = problem(lambda: vehicle.ask("op/resume", {"reason": "go on"}))
            assert refused["code"] == "not_durable"
            assert "it was not done" in refused["message"]
            assert vehicle.ask("rpc/mission")["phase"] == "paused"

            (state / "ballast").unlink()
            wait_until(lambda: durable(vehicle), "everything to be durable")
            assert vehicle.ask("rpc/mission")["health"] == {"ok": True, "findings": []}
            assert vehicle.ask("op/resume", {"reason": "go on"})["phase"] == "running"
            assert vehicle.ask("rpc/decision", detail="choice")["decision"] is not None
        assert running.stop() == 0
        (journal,) = (state / "auv").glob("*.redb")
        assert pdnd("replay", str(journal)).returncode == 0, pdnd("replay", str(journal)).stderr


def fill(ballast: Path) -> None:
    with ballast.open("ab", buffering=0) as file:
        for size in (65536, 4096):
            try:
                while True:
                    file.write(b"x" * size)
            except OSError:
                continue


def test_a_full_disk_takes_no_mission_away_from_a_daemon_that_is_started(tmp_path: Path) -> None:
    with small_disk(tmp_path, 4000) as state:
        running = start_daemon(tmp_path)
        with open_session(running.endpoint) as session:
            vehicle = begin(session)
            fly(vehicle, lanes=2)
            wait_until(lambda: durable(vehicle), "everything to be durable")
        running.process.kill()
        running.process.wait()
        fill(state / "ballast")
        running = start_daemon(tmp_path)
        with open_session(running.endpoint) as session:
            again = JsonVehicle(session, "auv", "m")
            again.seq = vehicle.seq
            told = again.ask("rpc/mission")
            assert (told["phase"], told["next_seq"]) == ("held", vehicle.seq)
            (state / "ballast").unlink()
            wait_until(lambda: again.ask("rpc/mission")["health"]["ok"], "the journal to be written again")
            assert again.ask("op/resume", {"reason": "there is room"})["phase"] == "running"
            assert durable(again)
        assert running.stop() == 0


def test_a_disk_that_can_only_be_read_stops_the_start_and_is_still_read(tmp_path: Path) -> None:
    with small_disk(tmp_path, 4000) as state:
        journal = stopped_mission(tmp_path)
        subprocess.run(["mount", "-o", "remount,ro", str(state)], check=True, capture_output=True)
        started = pdnd("-l", "tcp/127.0.0.1:0", "--state-dir", str(state))
        assert started.returncode == 3
        assert "Read-only file system" in started.stderr
        assert "--state-dir" in started.stderr
        assert pdnd("journal", str(journal)).returncode == 0
        assert pdnd("replay", str(journal)).returncode == 0


def test_a_mission_is_not_configured_where_it_cannot_be_recorded(tmp_path: Path) -> None:
    with small_disk(tmp_path, 600) as state:
        running = start_daemon(tmp_path)
        fill(state / "ballast")
        with open_session(running.endpoint) as session:
            vehicle = JsonVehicle(session, "auv", "m")
            refused = problem(lambda: vehicle.ask("op/configure", config("m")))
            assert refused["code"] == "not_durable"
            assert "the mission was not configured" in refused["message"]
            (state / "ballast").unlink()
            # Under the same id, since nothing of the first try is left.
            assert vehicle.ask("op/configure", config("m"))["phase"] == "configured"
        assert running.stop() == 0


def flipped(data: bytes, record: int) -> bytes:
    """With a bit of that record's payload flipped, wherever a page has a copy of it."""
    changed, place = bytearray(data), -1
    while (place := data.find(b"PDJ1", place + 1)) >= 0:
        if int.from_bytes(data[place + 12 : place + 20], "little") == record:
            changed[place + 60] ^= 4
    return bytes(changed)


DAMAGES = {
    "a flipped bit": lambda data: flipped(data, 50),
    "a torn tail": lambda data: data[: len(data) * 2 // 3],
    "an empty file": lambda data: data[:0],
    "another file": lambda data: b"#!/bin/sh\n" * (len(data) // 10),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_journal_is_kept_and_told_and_the_others_go_on(tmp_path: Path, damage: str) -> None:
    journal = stopped_mission(tmp_path)
    whole = journal.read_bytes()
    damaged = DAMAGES[damage](whole)
    journal.write_bytes(damaged)
    running = start_daemon(tmp_path)
    try:
        with open_session(running.endpoint) as session:
            vehicle = JsonVehicle(session, "auv", "m")
            refused = problem(lambda: vehicle.ask("rpc/mission", mission="m"))
            assert refused["code"] in ("journal_damaged", "journal_unreadable"), refused
            assert str(journal) in refused["message"], refused
            assert journal.read_bytes() == damaged, "it is left as it is"
            # The id is spent, and another mission can be flown.
            assert problem(lambda: vehicle.ask("op/configure", config("m"))) == refused
            begin(session, "m-2")
        log = running.log.read_text()
        assert "a journal cannot be read" in log
        assert str(journal) in log
    finally:
        running.stop()
    shown = pdnd("journal", str(journal))
    assert shown.returncode in (1, 3)
    assert str(journal) in shown.stderr


def test_what_is_left_of_a_damaged_journal_is_saved_and_flown_on(tmp_path: Path) -> None:
    journal = stopped_mission(tmp_path)
    lines = pdnd("journal", str(journal), "--json").stdout.splitlines()
    assert all(json.loads(line)["record"] == number for number, line in enumerate(lines))
    journal.write_bytes(flipped(journal.read_bytes(), 50))
    saved = pdnd("recover", str(journal), "--replace")
    assert saved.returncode == 0, saved.stderr
    assert (journal.parent / (journal.name + ".damaged")).exists()
    left = pdnd("journal", str(journal), "--json").stdout.splitlines()
    assert left == lines[:50], "the same records, up to the damage"
    running = start_daemon(tmp_path)
    try:
        with open_session(running.endpoint) as session:
            vehicle = JsonVehicle(session, "auv", "m")
            state = vehicle.ask("rpc/mission")
            assert state["mission"] == "m"
            assert state["phase"] in ("held", "configured")
    finally:
        assert running.stop() == 0


def test_a_journal_that_a_daemon_writes_is_not_taken_from_under_it(tmp_path: Path) -> None:
    running = start_daemon(tmp_path)
    try:
        with open_session(running.endpoint) as session:
            begin(session)
        (journal,) = (tmp_path / "state" / "auv").glob("*.redb")
        for command in (["journal"], ["replay"], ["recover"], ["recover", "--replace"]):
            refused = pdnd(command[0], str(journal), *command[1:])
            assert refused.returncode == 3, (command, refused)
            assert "another process has it open" in refused.stderr
        assert [path.name for path in journal.parent.iterdir()] == [journal.name]
    finally:
        assert running.stop() == 0


def test_a_journal_of_a_newer_version_is_not_guessed_at(tmp_path: Path) -> None:
    journal = stopped_mission(tmp_path)
    newer = bytearray(journal.read_bytes())
    # The layouts' CRC stands in each frame; another version writes another.
    place = newer.rindex(b"PDJ1")
    newer[place + 32 : place + 36] = b"\0\0\0\1"
    journal.write_bytes(newer)
    shown = pdnd("journal", str(journal))
    assert shown.returncode in (1, 3)
    assert str(journal) in shown.stderr


def test_a_state_directory_that_cannot_be_written_stops_the_start(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("no directory")
    started = pdnd("-l", "tcp/127.0.0.1:0", "--state-dir", str(blocked))
    assert started.returncode == 3
    assert "--state-dir" in started.stderr


def test_what_a_killed_daemon_had_only_begun_to_make_is_removed(tmp_path: Path) -> None:
    journal = stopped_mission(tmp_path)
    left = [journal.with_suffix(".new"), journal.with_name("000007-another.new")]
    for path in left:
        path.write_bytes(b"half a jour")
    running = start_daemon(tmp_path)
    with open_session(running.endpoint) as session:
        assert JsonVehicle(session, "auv", "m").ask("rpc/mission")["phase"] == "held"
    assert running.stop() == 0
    assert not any(path.exists() for path in left)
    assert journal.exists()


def test_a_restart_in_order_goes_on(tmp_path: Path) -> None:
    journal = stopped_mission(tmp_path)
    assert journal.with_suffix(".checkpoint").exists()
    running = start_daemon(tmp_path)
    with open_session(running.endpoint) as session:
        vehicle = JsonVehicle(session, "auv", "m")
        state = vehicle.ask("rpc/mission")
        assert (state["phase"], state["decisions"]) == ("held", 1)
        assert "started anew" in state["reason"]
        assert "resume" in state["reason"]
        assert vehicle.ask("op/resume", {"reason": "all is well"})["phase"] == "running"
        vehicle.ask("op/complete", {"reason": "enough"})
    assert running.stop() == 0
    assert "a checkpoint was passed over" not in running.log.read_text()
    replayed = pdnd("replay", str(journal), "--with", "alpha=0.1")
    assert replayed.returncode == 0, replayed
    assert "1 of 1 decisions are the same" in replayed.stdout
