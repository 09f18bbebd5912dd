"""Writing files so that a failure leaves what was there before.

A file is written beside its place, brought to the disk and then renamed: whoever looks sees the old one or
the new one, whole, whatever breaks in between.
"""

from __future__ import annotations

import contextlib
import errno
import os
import secrets
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

OF_WRITING = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.EROFS)
"""What only writing fails with: an error that reading another file meanwhile raised is not taken for ours."""


class FileNotWritten(OSError):
    """A file could not be written; what stood there before is as it was. The message says what to do."""

    def __str__(self) -> str:
        return str(self.strerror)


@contextlib.contextmanager
def replacing(path: Path, mode: str = "w", **options: Any) -> Iterator[IO[Any]]:
    """A file to write, which takes the place of `path` once all is written and on the disk.

    `mode` is "w" (UTF-8) or "wb"; `options` are those of `open`. A symbolic link is followed; what is no
    regular file (`/dev/stdout`, a pipe) is written as it is. Raises `FileNotWritten`, and leaves nothing
    behind on any error.
    """
    if mode == "w":
        options = {"encoding": "utf-8", **options}
    try:
        in_place = path.exists() and not path.is_file() and not path.is_dir()
        target = path if in_place else Path(os.path.realpath(path))
        beside = target if in_place else _new_beside(target)
        file = beside.open(mode, **options)
    except OSError as error:
        raise _not_written(path, error) from error
    try:
        with file:
            yield file
            if not in_place:
                sync(file)
        if not in_place:
            beside.replace(target)
            _sync_folder(target.parent)
    except OSError as error:
        if error.errno not in OF_WRITING or isinstance(error, FileNotWritten):
            raise
        raise _not_written(path, error) from error
    finally:
        if not in_place:
            beside.unlink(missing_ok=True)


def sync(file: IO[Any]) -> None:
    """What was written so far is on the disk."""
    file.flush()
    os.fsync(file.fileno())


def write_text(path: Path, text: str) -> None:
    """Writes the whole of a file, as `replacing` does."""
    with replacing(path) as file:
        file.write(text)


def make_folder(path: Path) -> None:
    """Makes the folder and those above it; raises `FileNotWritten`."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileNotWritten(
            error.errno, f"The folder {path} cannot be made: {error.strerror}; name another."
        ) from error


def _new_beside(target: Path) -> Path:
    """A new empty file in the same folder, with the permissions that the target has or would get."""
    if target.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    known = target.exists()
    if known and not os.access(target, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    beside = target.with_name(f".{target.name[:64]}.{secrets.token_hex(4)}.part")
    os.close(os.open(beside, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o666))
    if known:
        beside.chmod(stat.S_IMODE(target.stat().st_mode))
    return beside


def _sync_folder(folder: Path) -> None:
    """The new name is on the disk, where the file system can say so."""
    with contextlib.suppress(OSError):
        number = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(number)
        finally:
            os.close(number)


def _not_written(path: Path, error: OSError) -> FileNotWritten:
    folder = path.parent
    match error.errno:
        case errno.ENOSPC | errno.EDQUOT:
            why = f"the disk of {folder} is full; make room, or name a file on another disk"
        case errno.EFBIG:
            why = "it would be larger than this program may write (ulimit -f)"
        case errno.EISDIR:
            why = "it is a folder; name a file in it"
        case errno.ENOENT:
            why = f"the folder {folder} does not exist; make it"
        case errno.ENOTDIR:
            why = f"{folder} is no folder"
        case errno.EACCES | errno.EPERM:
            why = f"this user may not write it; look at the permissions of {path} and {folder}"
        case errno.EROFS:
            why = f"the file system of {folder} can only be read; name another place"
        case _:
            why = error.strerror or type(error).__name__
    kept = " What stood there is as it was." if os.path.isfile(path) else ""
    return FileNotWritten(error.errno, f"{path} was not written: {why}.{kept}")
