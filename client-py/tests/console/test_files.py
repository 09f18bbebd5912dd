"""What a failure while writing leaves: the file that was there, and an error that says what to do."""

from __future__ import annotations

import errno
import os
import resource
import stat
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from pdn import files
from pdn.plots import style
from pdn.sim import record

GOOD = "the good file of yesterday\n"
LARGEST = 64 * 1024
"""More bytes than this process may write into a file while `full` holds."""


@pytest.fixture
def full() -> Iterator[None]:
    """Files end after `LARGEST` bytes: what a full disk does, without one."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (LARGEST, limits[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, limits)


@pytest.fixture
def good(tmp_path: Path) -> Path:
    path = tmp_path / "file"
    path.write_text(GOOD)
    return path


def left_behind(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def test_a_file_is_replaced_as_a_whole(good: Path) -> None:
    good.chmod(0o640)
    with files.replacing(good) as file:
        file.write("new \u2028 \n")
        file.flush()
        assert good.read_text() == GOOD, "the old one stands until the new one is whole"
    assert good.read_text() == "new \u2028 \n"
    assert stat.S_IMODE(good.stat().st_mode) == 0o640
    assert left_behind(good.parent) == ["file"]


def test_a_new_file_has_the_permissions_of_any_other(tmp_path: Path) -> None:
    files.write_text(tmp_path / "new", "x")
    (tmp_path / "any").write_text("x")
    assert (tmp_path / "new").stat().st_mode == (tmp_path / "any").stat().st_mode


def test_a_link_keeps_being_one(good: Path) -> None:
    link = good.with_name("link")
    link.symlink_to(good)
    files.write_text(link, "new")
    assert link.is_symlink()
    assert good.read_text() == "new"


def test_a_pipe_is_written_as_it_is(tmp_path: Path) -> None:
    reading, writing = os.pipe()
    files.write_text(Path(f"/dev/fd/{writing}"), "through")
    os.close(writing)
    with os.fdopen(reading) as pipe:
        assert pipe.read() == "through"


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
def test_a_failure_of_the_writer_leaves_the_old_file(good: Path, error: type[BaseException]) -> None:
    def write() -> None:
        with files.replacing(good, "wb") as file:
            file.write(b"half")
            raise error

    with pytest.raises(error):
        write()
    assert good.read_text() == GOOD
    assert left_behind(good.parent) == ["file"]


@pytest.mark.usefixtures("full")
@pytest.mark.parametrize("written", ["at once", "when the file ends"])
def test_no_room_leaves_the_old_file(good: Path, written: str) -> None:
    def write() -> None:
        with files.replacing(good, buffering=1 << 20 if written == "when the file ends" else 4096) as file:
            file.write("x" * (2 * LARGEST))

    with pytest.raises(
        files.FileNotWritten, match=r"it would be larger.*What stood there is as it was"
    ) as caught:
        write()
    assert str(caught.value).startswith(f"{good} was not written: ")
    assert good.read_text() == GOOD
    assert left_behind(good.parent) == ["file"]


def test_a_full_disk_is_told(good: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(number: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "fsync", refuse)
    with pytest.raises(files.FileNotWritten, match=r"the disk of .* is full; make room"):
        files.write_text(good, "new")
    assert good.read_text() == GOOD
    assert left_behind(good.parent) == ["file"]


@pytest.mark.parametrize(
    ("place", "told"),
    [
        ("folder", "it is a folder; name a file in it"),
        ("none/file", "the folder .*none does not exist; make it"),
        ("good/file", "good is no folder"),
        ("x" * 300, "File name too long"),
    ],
)
def test_a_place_that_cannot_be_is_told(tmp_path: Path, place: str, told: str) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "good").write_text(GOOD)
    with pytest.raises(files.FileNotWritten, match=told) as caught:
        files.write_text(tmp_path / place, "new")
    assert str(tmp_path / place) in str(caught.value)
    assert left_behind(tmp_path) == ["folder", "good"]


def test_a_file_that_this_user_may_not_write(good: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "access", lambda *_: False)  # The tests may run as root, who may everything.
    with pytest.raises(files.FileNotWritten, match="this user may not write it"):
        files.write_text(good, "new")
    assert good.read_text() == GOOD


def test_an_error_of_another_file_is_not_taken_for_ours(good: Path) -> None:
    def write() -> None:
        with files.replacing(good):
            (good.parent / "missing").read_text()

    with pytest.raises(FileNotFoundError, match="missing"):
        write()
    assert good.read_text() == GOOD


def test_a_folder_that_cannot_be_made(good: Path) -> None:
    with pytest.raises(files.FileNotWritten, match="cannot be made"):
        files.make_folder(good / "below")


def save_figure(path: Path) -> None:
    figure = style.new_figure(13.0, 7.0)
    axes = figure.subplots()
    for number in range(40):
        axes.plot([0, 1, number % 7], [number, 1, 0])
    style.save(figure, path)


def save_run(path: Path) -> None:
    course = record.Course(path_m=[1.0 / 3.0] * 20_000)
    result = record.Result("s", "pdn", 1.0, 1, 0, 1.0, 1.0, 1.0, 1.0, 6.0, 1.0, 1.0, 1.0, 1, 1.0)
    record.save(record.Run(result, course, [], {}, [], [], []), path)


@pytest.mark.usefixtures("full")
@pytest.mark.parametrize(("save", "name"), [(save_figure, "figure.png"), (save_run, "run.json")])
def test_figures_and_runs_are_written_so(tmp_path: Path, save: Callable[[Path], None], name: str) -> None:
    (tmp_path / name).write_text(GOOD)
    with pytest.raises(files.FileNotWritten, match=name):
        save(tmp_path / name)
    assert (tmp_path / name).read_text() == GOOD
    assert left_behind(tmp_path) == [name]


def test_a_figure_has_the_format_of_its_name(tmp_path: Path) -> None:
    for name, begin in (("f.png", b"\x89PNG"), ("f.svg", b"<?xml"), ("f.pdf", b"%PDF")):
        save_figure(tmp_path / name)
        assert (tmp_path / name).read_bytes().startswith(begin)
    save_figure(tmp_path / "bare")
    assert (tmp_path / "bare.png").exists()
