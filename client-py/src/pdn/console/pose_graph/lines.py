"""From a file's bytes to its lines of words."""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterator

from .graph import PoseGraphError

_PACKED = {
    b"\x1f\x8b": "gzip",
    b"PK\x03\x04": "zip",
    b"BZh": "bzip2",
    b"\xfd7zXZ": "xz",
    b"(\xb5/\xfd": "zstd",
}

_LINE_END = re.compile(r"\r\n|\n|\r")


def lines_in(data: bytes) -> Iterator[tuple[int, list[str]]]:
    """The number and the words of each line that has words, comments cut off.

    Lines end in LF, CRLF or CR. A comment begins with a `#` that begins a word. The text is UTF-8, or UTF-16
    with a byte order mark; bytes that are neither may stand in comments.
    """
    for number, text in enumerate(_LINE_END.split(_decoded(data)), start=1):
        words = text.split()
        for place, word in enumerate(words):
            if word.startswith("#"):
                del words[place:]
                break
        if words:
            yield number, words


def _decoded(data: bytes) -> str:
    for magic, packer in _PACKED.items():
        if data.startswith(magic):
            raise PoseGraphError(f"this is a file packed by {packer}; unpack it first")
    for mark in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
        if data.startswith(mark):
            return data.decode("utf-16", errors="replace")
    return data.removeprefix(codecs.BOM_UTF8).decode("utf-8", errors="surrogateescape")
