"""The outbox on disk: whatever ends the program, what was taken is there; whatever is damaged is said."""

import errno
import os
import resource
import shutil
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pdn.client import OutboxUnusable
from pdn.client.outbox import Entry
from pdn.client.outbox_file import COMPACT_AFTER_BYTES, MAGIC, OutboxFile


def entry(seq: int, size: int = 20) -> Entry:
    return Entry(seq, "pdn/auv/v1/in/keyframe", (b"%d " % seq) * (size // 2), "application/json")


def opened(folder: Path, mission: str = "m") -> OutboxFile:
    return OutboxFile(folder, "auv", mission)


def filled(folder: Path, count: int, first: int = 0) -> Path:
    """A file with so many events, as a killed program leaves it."""
    file = opened(folder)
    file.begin(first)
    for seq in range(first, first + count):
        file.append(entry(seq))
    file.release()
    return file.path


STEPS = st.lists(st.one_of(st.integers(1, 40), st.just("trim"), st.just("kill")), max_size=30)


@given(steps=STEPS, size=st.integers(1, 60_000), fraction=st.floats(0.0, 1.0))
@settings(max_examples=60, deadline=None)
def test_what_is_not_durable_is_there_again(
    tmp_path_factory: pytest.TempPathFactory, steps: list, size: int, fraction: float
) -> None:
    folder = tmp_path_factory.mktemp("outbox")
    file = opened(folder)
    file.begin(3)
    next_seq = durable_seq = 3
    for step in steps:
        if step == "trim":
            durable_seq += round(fraction * (next_seq - durable_seq))
            file.trim(durable_seq)
        elif step == "kill":
            file.release()
            file = opened(folder)
            assert file.next_seq == next_seq
            # Those that are durable may be there still: the planner knows them.
            kept = list(file.entries)
            assert [e.seq for e in kept] == list(range(next_seq - len(kept), next_seq))
            assert len(kept) >= next_seq - durable_seq
            assert kept == [entry(e.seq, size) for e in kept]
            file.trim(durable_seq)
        else:
            for _ in range(step):
                file.append(entry(next_seq, size))
                next_seq += 1
        live = (next_seq - durable_seq) * (2 * size + 200)
        assert file.path.stat().st_size <= 2 * live + COMPACT_AFTER_BYTES + 2 * size + 500
    file.trim(next_seq)
    file.close()
    assert not file.path.exists()
    shutil.rmtree(folder)


def test_a_file_cut_anywhere_keeps_the_events_before(tmp_path: Path) -> None:
    whole = filled(tmp_path, 5).read_bytes()
    path = tmp_path / "auv.m.outbox"
    first = whole.index(b"pdn/auv") - 4 - 20
    for length in range(first, len(whole)):
        path.write_bytes(whole[:length])
        file = opened(tmp_path)
        kept = len(file.entries)
        assert list(file.entries) == [entry(seq) for seq in range(kept)]
        assert kept == sum(whole[:length].count(b"%d " % seq) == 10 for seq in range(5))
        # And it goes on from there.
        file.append(entry(kept))
        file.release()
        again = opened(tmp_path)
        assert [e.seq for e in again.entries] == list(range(kept + 1))
        again.release()


def test_a_file_with_any_bit_turned_is_refused(tmp_path: Path) -> None:
    path = filled(tmp_path, 3)
    whole = path.read_bytes()
    for at in range(len(whole)):
        turned = bytearray(whole)
        turned[at] ^= 1 << at % 8
        path.write_bytes(turned)
        with pytest.raises(OutboxUnusable, match=r"is damaged|is no outbox"):
            opened(tmp_path)
        assert path.read_bytes() == bytes(turned), "what is damaged is kept as it is"


def test_zeros_that_a_power_cut_left_are_no_damage(tmp_path: Path) -> None:
    path = filled(tmp_path, 3)
    path.write_bytes(path.read_bytes() + bytes(500))
    file = opened(tmp_path)
    assert len(file.entries) == 3
    file.release()


def test_what_is_no_outbox_or_another_s_is_said(tmp_path: Path) -> None:
    (tmp_path / "auv.m.outbox").write_bytes(b"PDNOUTB9 of a later version")
    with pytest.raises(OutboxUnusable, match="is no outbox of this version"):
        opened(tmp_path)
    (tmp_path / "auv.m.outbox").write_bytes(MAGIC)
    with pytest.raises(OutboxUnusable, match="damaged at its beginning"):
        opened(tmp_path)
    filled(tmp_path / "other", 1)
    (tmp_path / "other/auv.m.outbox").rename(tmp_path / "auv.n.outbox")
    with pytest.raises(OutboxUnusable, match=r"belongs to \{'vehicle': 'auv', 'mission': 'm'\}"):
        opened(tmp_path, "n")
    with pytest.raises(ValueError, match="is no id of a mission"):
        opened(tmp_path, "../m")


def test_a_file_is_one_program_s(tmp_path: Path) -> None:
    file = opened(tmp_path)
    file.begin(0)
    with pytest.raises(OutboxUnusable, match="in use by another program"):
        opened(tmp_path)
    for seq in range(40):  # Written anew on the way.
        file.append(entry(seq, 100_000))
        file.trim(seq)
    with pytest.raises(OutboxUnusable, match="in use by another program"):
        opened(tmp_path)
    file.release()
    opened(tmp_path).release()


def test_a_disk_that_is_full_takes_no_event_and_goes_on_when_there_is_room(tmp_path: Path) -> None:
    file = opened(tmp_path)
    file.begin(0)
    file.append(entry(0))
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    # As on a full disk the next write is cut short, and the one after fails.
    resource.setrlimit(resource.RLIMIT_FSIZE, (file.path.stat().st_size + 10, before[1]))
    try:
        for _ in range(2):
            with pytest.raises(OutboxUnusable, match=r"cannot be written .*event 1 was not taken"):
                file.append(entry(1))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    file.append(entry(1))
    file.release()
    again = opened(tmp_path)
    assert list(again.entries) == [entry(0), entry(1)]
    again.release()


def test_a_folder_that_cannot_be_used_is_said(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutboxUnusable, match=rf"cannot be used \({os.strerror(errno.ENOTDIR)}|File exists"):
        opened(tmp_path / "file")
