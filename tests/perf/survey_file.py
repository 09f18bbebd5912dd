"""The input that `pdn-perf run --write` leaves for the peers: the matrix, the candidates, the stream of
factors.
"""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

Array = np.ndarray[Any, np.dtype[Any]]

PRIOR, ODOMETRY, ATTITUDE, DEPTH, CAMERA = range(5)
"""Kinds of measurement in `stream_ends`."""

ZERO_BLOCK = np.zeros((6, 6))


class Pair(NamedTuple):
    """Information that two nodes share, [[first, cross], [cross^T, second]], and what the second has on
    its own.
    """

    first_node: int
    second_node: int
    first: Array
    cross: Array
    second: Array
    own: Array = ZERO_BLOCK


class SurveyFile:
    """Arrays by name, and views of them."""

    def __init__(self, path: Path) -> None:
        content = path.read_bytes()
        start = 8 + int.from_bytes(content[:8], "little")
        self.arrays: dict[str, Array] = {}
        for name, entry in json.loads(content[8:start]).items():
            count = int(np.prod(entry["shape"]))
            flat = np.frombuffer(content, entry["dtype"], count, start + entry["offset"])
            self.arrays[name] = flat.reshape(entry["shape"])
        self.keyframes = len(self["poses"])
        self.candidates = len(self["path_nodes"])
        self._first_node = _starts(self["path_nodes"])
        self._first_link = _starts(self["path_links"])

    def __getitem__(self, name: str) -> Array:
        return self.arrays[name]

    def terminal(self, candidate: int) -> int:
        """The last virtual node; the first virtual node's number is that of the keyframes."""
        return self.keyframes - 1 + int(self["path_nodes"][candidate])

    def linked(self, candidate: int) -> set[int]:
        """Keyframes that a candidate ties virtual nodes to, the robot included."""
        links = slice(self._first_link[candidate], self._first_link[candidate + 1])
        return {self.keyframes - 1, *self["link_ends"][links, 1].tolist()}

    def path(self, candidate: int) -> Iterator[Pair]:
        """What a candidate adds: odometry with what the later node has on its own, then links weighted by
        P_L.
        """
        robot = self.keyframes - 1
        for step, at in enumerate(range(self._first_node[candidate], self._first_node[candidate + 1])):
            yield Pair(robot + step, robot + step + 1, *self["steps"][at], self["unary"][at])
        for at in range(self._first_link[candidate], self._first_link[candidate + 1]):
            node, keyframe = self["link_ends"][at].tolist()
            yield Pair(keyframe, robot + node, *(self["link_probability"][at] * self["links"][at]))


def spread(count: int, of: int) -> list[int]:
    """Places of `count` of `of` things, evenly spread, as pdn-perf takes them."""
    count = min(count, of)
    return [index * of // count for index in range(count)]


def _starts(counts: Array) -> list[int]:
    return [0, *np.cumsum(counts, dtype=np.int64).tolist()]
