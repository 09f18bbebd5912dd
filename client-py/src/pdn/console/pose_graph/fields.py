"""Words of a line as ids and numbers; what they are not is said."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

from .graph import PoseGraphError

MAX_ID = 2**64 - 1

_SHOWN = 40
"""Characters of the file that an error repeats."""

_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?", re.ASCII)
_FORTRAN = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)[dD][+-]?\d+", re.ASCII)
_NOT_FINITE = re.compile(r"[+-]?(nan|inf|infinity|1\.#)", re.IGNORECASE)


def shown(word: str) -> str:
    """A word of the file as an error shows it: quoted, in ASCII, at most some characters of it."""
    quoted = ascii(word[:_SHOWN])
    if len(quoted) > 2 * _SHOWN:
        quoted = f"{quoted[: 2 * _SHOWN]}'"
    return quoted if len(word) <= _SHOWN else f"{quoted}... ({len(word)} characters)"


def is_number(word: str) -> bool:
    """Whether a word could be meant as a number."""
    patterns = (_NUMBER, _DECIMAL_COMMA, _FORTRAN)
    return any(pattern.fullmatch(word) for pattern in patterns) or bool(_NOT_FINITE.match(word))


def vertex_id(word: str) -> int:
    """An id of a vertex, or of a parameter."""
    digits = word.lstrip("0") or "0"
    # Python reads no number of thousands of digits.
    if not (word.isascii() and word.isdecimal()) or len(digits) > len(str(MAX_ID)) or int(digits) > MAX_ID:
        raise PoseGraphError(f"{shown(word)} is no id; ids are whole numbers from 0 to 2^64 - 1")
    return int(digits)


def numbers(words: Sequence[str]) -> list[float]:
    """Finite numbers as C writes them."""
    read = [_number(word) for word in words]
    if not all(map(math.isfinite, read)):
        word = next(word for word, value in zip(words, read, strict=True) if not math.isfinite(value))
        raise PoseGraphError(f"{shown(word)} is not finite, or too large for a number of 64 bits")
    return read


def _number(word: str) -> float:
    if _NUMBER.fullmatch(word):
        return float(word)
    if _NOT_FINITE.match(word):
        raise PoseGraphError(f"{shown(word)} is not finite: whoever wrote the file had no value here")
    if _DECIMAL_COMMA.fullmatch(word):
        raise PoseGraphError(
            f"{shown(word)} has a decimal comma: the file was written under a locale that has them. "
            "Write it again under LC_NUMERIC=C, or replace each comma by a point: sed 's/,/./g' FILE"
        )
    if _FORTRAN.fullmatch(word):
        raise PoseGraphError(
            f"{shown(word)} has Fortran's exponent; write e for d: sed -E 's/[dD]/e/' on numbers"
        )
    if "#" in word:
        raise PoseGraphError(f"{shown(word)} is no number; put a blank before the # of a comment")
    if "," in word or ";" in word:
        raise PoseGraphError(f"{shown(word)} is no number; words are separated by blanks, not by commas")
    raise PoseGraphError(f"{shown(word)} is no number")
