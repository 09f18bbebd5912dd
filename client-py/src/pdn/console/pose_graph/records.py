"""What the lines of a file say, before it is put together."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

from .graph import PoseGraphError
from .transform import Matrix, Transform


class AtLine(PoseGraphError):
    """What is wrong with a line that was read before."""

    def __init__(self, line: int, message: str) -> None:
        super().__init__(message)
        self.line = line


@dataclass(frozen=True, slots=True)
class Assumptions:
    """What the reader of a file may assume where the file says nothing."""

    default_sigmas: tuple[float, float] | None = None
    """Of a measurement without information, m and rad; None refuses it."""
    plane_sigmas: tuple[float, float] = (0.01, 0.01)
    """Of z (m), and of roll and pitch (rad), of a measurement in the plane."""
    mend_information: bool = False
    """Whether information that six digits have made indefinite is mended."""


@dataclass(frozen=True, slots=True)
class Measured:
    """A measurement whose offsets are not yet looked up: of `ends[1]` in `ends[0]`, or of `ends[0]` in the
    world.
    """

    line: int
    ends: list[int]
    offsets: list[int]
    pose: Transform
    covariance: Matrix


@dataclass
class Records:
    """All lines of a file."""

    vertices: dict[int, Transform] = field(default_factory=dict)
    measured: list[Measured] = field(default_factory=list)
    offsets: dict[int, Transform] = field(default_factory=dict)
    fixed: dict[int, int] = field(default_factory=dict)
    """Vertices that FIX names, and the line."""
    landmarks: set[str] = field(default_factory=set)
    left_out: Counter[str] = field(default_factory=Counter)
    """Lines that are no part of a pose graph, by what they are."""
    defaulted: int = 0
    """Measurements without information."""
    mended: int = 0
    """Measurements whose information was mended."""
    trailing: list[tuple[int, str]] = field(default_factory=list)
    """Lines with words after their numbers, and the first word."""
    planar: bool = False
    last_line: int = 1
