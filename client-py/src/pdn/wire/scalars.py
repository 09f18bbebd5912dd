"""What has a plain form by itself: numbers, texts, true and false."""

import math
from struct import Struct as Layout
from typing import Any, Protocol

import numpy as np

from .errors import WireError, invalid
from .names import Code

_SINGLE = Layout("<f")


class Shape(Protocol):
    """How one type is read and written; `path` says where, for errors."""

    def read(self, value: Any, path: str) -> Any:
        """The value of a plain form."""
        ...

    def write(self, value: Any, path: str) -> Any:
        """The plain form of a value."""
        ...


def wrong(path: str, expected: str, value: object) -> WireError:
    """The error of a value that is not what its place asks for."""
    shown = repr(value)
    shown = shown if len(shown) < 80 else f"{shown[:77]}..."
    return invalid(f"`{path or '.'}` must be {expected}, not {shown}")


def below(path: str, name: str) -> str:
    """The path of a field."""
    return f"{path}.{name}" if path else name


class _Exact:
    """A type whose plain form is itself."""

    def __init__(self, kind: type, expected: str) -> None:
        self.kind, self.expected = kind, expected

    def read(self, value: Any, path: str) -> Any:
        if type(value) is not self.kind:
            raise wrong(path, self.expected, value)
        return value

    def write(self, value: Any, path: str) -> Any:
        if not isinstance(value, self.kind):
            raise wrong(path, self.expected, value)
        return value


class _Unsigned:
    """An integer from 0 on."""

    def __init__(self, bits: int) -> None:
        self.end, self.expected = 1 << bits, f"an integer from 0 to 2^{bits} - 1"

    def read(self, value: Any, path: str) -> int:
        if type(value) is not int or not 0 <= value < self.end:
            raise wrong(path, self.expected, value)
        return value

    def write(self, value: Any, path: str) -> int:
        if isinstance(value, np.integer):
            value = int(value)
        return self.read(value, path)


class _Double:
    """A finite number of 64 bits."""

    def read(self, value: Any, path: str) -> float:
        if isinstance(value, bool) or not isinstance(value, float | int):
            raise wrong(path, "a number", value)
        try:
            number = float(value)
        except OverflowError:
            raise wrong(path, "a number below 1.8e308", value) from None
        if not math.isfinite(number):
            raise WireError(Code.NOT_FINITE, f"`{path or '.'}` is {number}; it must be finite")
        return number

    def write(self, value: Any, path: str) -> float:
        return self.read(float(value) if isinstance(value, np.number) else value, path)


class Single(float):
    """The plain form of a number of 32 bits: the shortest decimal that is this number in 32 bits."""


class _Single(_Double):
    """A finite number of 32 bits."""

    def read(self, value: Any, path: str) -> float:
        number = super().read(value, path)
        try:
            rounded: float = _SINGLE.unpack(_SINGLE.pack(number))[0]
        except OverflowError:
            raise wrong(path, "a number below 3.5e38", value) from None
        return rounded

    def write(self, value: Any, path: str) -> Single:
        return Single(str(np.float32(super().write(value, path))))


BOOL = _Exact(bool, "true or false")
STRING = _Exact(str, "a text")
U32 = _Unsigned(32)
U64 = _Unsigned(64)
F32 = _Single()
F64 = _Double()
