"""What the generated `binary.py` is made of: strings, lists, flags and tags of bincode.

Readers take the payload and an offset and give a value and the offset behind it. A payload that ends too
early shows as `struct.error` or `IndexError`, which `codec.decode` translates; a length is compared with what
is left before anything is made of it.
"""

import struct
from collections.abc import Sequence, Sized
from struct import Struct
from typing import Any, TypeVar

from .errors import WireError, invalid

T = TypeVar("T")

_LENGTH = Struct("<Q")


def string(out: bytearray, value: str) -> None:
    """Writes a text."""
    content = value.encode()
    out += _LENGTH.pack(len(content))
    out += content


def read_string(b: bytes, i: int) -> tuple[str, int]:
    """Reads a text."""
    n, i = count(b, i, 1)
    try:
        return b[i : i + n].decode(), i + n
    except UnicodeDecodeError as error:
        raise invalid(f"the text at byte {i} is not UTF-8: {error.reason} (byte {error.start})") from None


def length(out: bytearray, value: Sized) -> None:
    """Writes the length of a list."""
    out += _LENGTH.pack(len(value))


def count(b: bytes, i: int, least_bytes: int) -> tuple[int, int]:
    """Reads the length of a list whose elements take at least so many bytes each."""
    (n,) = _LENGTH.unpack_from(b, i)
    i += 8
    if n * least_bytes > len(b) - i:
        raise invalid(
            f"the length {n} at byte {i - 8} is more than the {len(b) - i} bytes behind it can hold"
        )
    return n, i


def run(out: bytearray, letter: str, values: Sequence[float]) -> None:
    """Writes a list of numbers."""
    out += _LENGTH.pack(len(values))
    out += struct.pack(f"<{len(values)}{letter}", *values)


def read_run(b: bytes, i: int, letter: str, size: int) -> tuple[tuple[Any, ...], int]:
    """Reads a list of numbers, `size` bytes each."""
    n, i = count(b, i, size)
    return struct.unpack_from(f"<{n}{letter}", b, i), i + n * size


def flag(b: bytes, i: int) -> bool:
    """Whether an optional is there."""
    return boolean(b[i])


def boolean(value: int) -> bool:
    """The bool of a byte."""
    if value > 1:
        raise invalid(f"a bool or the mark of an optional is 0 or 1, not {value}")
    return value == 1


def one_of(name: str, members: tuple[T, ...], tag: int) -> T:
    """The member of a choice."""
    if tag >= len(members):
        raise unknown_variant(name, tag, len(members))
    return members[tag]


def unknown_variant(name: str, tag: int, variants: int) -> WireError:
    """The error of a tag that no variant has."""
    return invalid(f"{name} has variants 0 to {variants - 1}, not {tag}")


def wrong_sizes() -> ValueError:
    """The error of arrays that have not the sizes of their fields; the plain form tells which."""
    return ValueError("an array has not the size of its field")
