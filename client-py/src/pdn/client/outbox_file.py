"""The outbox on disk: what a mission's stream has numbered and the planner has not yet confirmed, kept
across the end of the program, however it ends.

A file for each mission, appended to and now and then written anew without what is durable:

    "PDNOUTB1"
    record 0:  JSON {"vehicle", "mission", "next_seq"}; `seq` 0
    record n:  an event; `seq` its number, the body its key, encoding and payload

    record = head (body length u32, seq u64, CRC-32 of the body u32), CRC-32 of the head u32, body

All little-endian. An event is in the file before it is sent, and on the disk too (`sync`), so the planner
never has an event of this stream that the file lacks. A last record that is cut short is one that was being
written when the program ended: nobody was told that it was taken, and it is dropped. Any other fault is
`OutboxUnusable`.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import re
import struct
import zlib
from collections import deque
from collections.abc import Iterator
from pathlib import Path

from .errors import OutboxUnusable
from .outbox import Entry

MAGIC = b"PDNOUTB1"
HEADER = struct.Struct("<IQI")
CHECKSUM = struct.Struct("<I")
LENGTHS = struct.Struct("<HH")
"""Bytes of an event's key and encoding, before both."""

OPEN_ATTEMPTS = 10

COMPACT_AFTER_BYTES = 1 << 20
"""The file is written anew once so many bytes of it are of durable events, and more than of others."""


def outbox_exists(folder: str | Path, vehicle: str, mission: str) -> bool:
    """Whether an earlier program has left a file of that mission."""
    return outbox_path(folder, vehicle, mission).exists()


def outbox_path(folder: str | Path, vehicle: str, mission: str) -> Path:
    """Where the events of that mission are kept."""
    if not re.fullmatch(r"[a-z0-9_-]{1,64}", mission):
        raise ValueError(f"{mission!r} is no id of a mission: 1 to 64 of a-z, 0-9, - and _")
    return Path(folder) / f"{vehicle}.{mission}.outbox"


class OutboxFile:
    """The file of one mission, locked as long as it is open."""

    def __init__(self, folder: str | Path, vehicle: str, mission: str) -> None:
        """Opens or makes the file; raises `OutboxUnusable` if it is another's, in use or damaged."""
        self.path = outbox_path(folder, vehicle, mission)
        self.entries: deque[Entry] = deque()
        self.next_seq: int | None = None
        self.mission = mission
        self._identity = {"vehicle": vehicle, "mission": mission}
        self._live_bytes = 0
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = self._open_locked()
        except OSError as error:
            raise self._unusable(f"cannot be used ({error.strerror})") from error
        try:
            content = _content(self._file)
            self._size = len(content)
            if content:
                self._read(content)
        except BaseException:
            os.close(self._file)
            raise

    def begin(self, next_seq: int) -> None:
        """For a new file: the first event will have this number."""
        self.next_seq = next_seq
        self._compact()

    def append(self, entry: Entry) -> None:
        """Keeps an event; it is not taken if this raises."""
        written = _record(entry.seq, _event(entry))
        try:
            count = os.write(self._file, written)
            why = "no space left on the disk"
        except OSError as error:
            count, why = 0, str(error.strerror)
        if count < len(written):
            with contextlib.suppress(OSError):
                os.ftruncate(self._file, self._size)
            raise self._unusable(f"cannot be written ({why}), and event {entry.seq} was not taken")
        self.entries.append(entry)
        self.next_seq = entry.seq + 1
        self._size += len(written)
        self._live_bytes += len(written)

    def sync(self) -> None:
        """What was appended is on the disk."""
        os.fdatasync(self._file)

    def trim(self, durable_seq: int) -> None:
        """Events below are durable and need not be kept."""
        while self.entries and self.entries[0].seq < durable_seq:
            self._live_bytes -= len(_record(0, _event(self.entries.popleft())))
        if self._size - self._live_bytes > max(COMPACT_AFTER_BYTES, self._live_bytes):
            self._compact()

    def close(self) -> None:
        """Lets go of the file, and removes it if all that was in it is durable."""
        if not self.entries:
            self.path.unlink(missing_ok=True)
        self.release()

    def release(self) -> None:
        """Lets go of the file and leaves it as it is."""
        os.close(self._file)

    def _open_locked(self) -> int:
        for _ in range(OPEN_ATTEMPTS):
            file = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o600)
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                if self.path.exists() and os.path.samestat(os.fstat(file), self.path.stat()):
                    return file
            except BlockingIOError as error:
                os.close(file)
                raise self._unusable(
                    "is in use by another program that sends events of this mission"
                ) from error
            os.close(file)  # Another program has replaced or removed it meanwhile.
        raise self._unusable("is replaced again and again by another program")

    def _read(self, content: bytes) -> None:
        if not content.startswith(MAGIC):
            raise self._unusable("is no outbox of this version")
        records = self._records(content)
        try:
            identity = json.loads(next(records)[1])
            self.next_seq = int(identity.pop("next_seq"))
        except (StopIteration, ValueError, KeyError, AttributeError):
            raise self._unusable("is damaged at its beginning") from None
        if identity != self._identity:
            raise self._unusable(f"belongs to {identity}")
        for seq, body in records:
            if seq != self.next_seq:
                raise self._unusable(f"is damaged: event {seq} stands where {self.next_seq} should")
            self.entries.append(_entry(seq, body))
            self.next_seq = seq + 1
            self._live_bytes += HEADER.size + CHECKSUM.size + len(body)

    def _records(self, content: bytes) -> Iterator[tuple[int, bytes]]:
        at = len(MAGIC)
        while at < len(content):
            begin = at + HEADER.size + CHECKSUM.size
            head = content[at : at + HEADER.size]
            if begin > len(content):
                break
            length, seq, body_sum = HEADER.unpack(head)
            if zlib.crc32(head) != CHECKSUM.unpack(content[at + HEADER.size : begin])[0]:
                if not any(content[at:]):
                    break  # Zeros that a power cut left where a record was to be.
                raise self._unusable(f"is damaged at byte {at}")
            if begin + length > len(content):
                break
            body = content[begin : begin + length]
            if zlib.crc32(body) != body_sum:
                raise self._unusable(f"is damaged at byte {begin}")
            yield seq, body
            at = begin + length
        if at < len(content):
            os.ftruncate(self._file, at)
            self._size = at

    def _compact(self) -> None:
        """Writes the file anew, without what is durable; whenever the program ends, one of both is there."""
        first = self.entries[0].seq if self.entries else self.next_seq
        identity = json.dumps({**self._identity, "next_seq": first}).encode()
        content = MAGIC + _record(0, identity) + b"".join(_record(e.seq, _event(e)) for e in self.entries)
        temporary = self.path.with_suffix(".new")
        try:
            with temporary.open("wb") as new:
                new.write(content)
                new.flush()
                os.fsync(new.fileno())
            replacement = os.open(temporary, os.O_RDWR | os.O_APPEND | os.O_CLOEXEC)
            fcntl.flock(replacement, fcntl.LOCK_EX | fcntl.LOCK_NB)
            os.replace(temporary, self.path)
        except OSError as error:
            raise self._unusable(f"cannot be written anew ({error.strerror})") from error
        os.close(self._file)
        self._file, self._size = replacement, len(content)

    def _unusable(self, what: str) -> OutboxUnusable:
        return OutboxUnusable(
            f"The outbox {self.path} {what}. "
            "Its events may not have reached the planner: keep it, and name another folder to go on without."
        )


def _content(file: int) -> bytes:
    return b"".join(iter(lambda: os.read(file, 1 << 20), b""))


def _record(seq: int, body: bytes) -> bytes:
    head = HEADER.pack(len(body), seq, zlib.crc32(body))
    return head + CHECKSUM.pack(zlib.crc32(head)) + body


def _event(entry: Entry) -> bytes:
    key, encoding = entry.key.encode(), entry.encoding.encode()
    return LENGTHS.pack(len(key), len(encoding)) + key + encoding + entry.payload


def _entry(seq: int, body: bytes) -> Entry:
    key_bytes, encoding_bytes = LENGTHS.unpack_from(body)
    rest = body[LENGTHS.size :]
    encoding_end = key_bytes + encoding_bytes
    return Entry(seq, rest[:key_bytes].decode(), rest[encoding_end:], rest[key_bytes:encoding_end].decode())
