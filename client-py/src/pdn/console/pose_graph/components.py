"""Connected components of a graph, each of which needs an anchor."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

from .graph import Edge


@dataclass(frozen=True, slots=True)
class Unanchored:
    """A connected component that nothing holds to the world."""

    line: int
    """Of its first edge."""
    vertices: list[int]

    def told(self, anchor: int) -> str:
        """What is wrong, and what to do."""
        first = self.vertices[0]
        return (
            f"{len(self.vertices)} vertices, of which {first} is the first, are not connected to vertex "
            f"{anchor} and nothing holds them; add the edge that is missing, or hold one at its pose: FIX "
            f"{first}"
        )


def unanchored(edges: list[Edge], anchors: Collection[int]) -> Unanchored | None:
    """The first connected component in which no vertex is anchored."""
    neighbours: dict[int, list[int]] = {}
    for edge in edges:
        neighbours.setdefault(edge.from_, []).append(edge.to)
        neighbours.setdefault(edge.to, []).append(edge.from_)
    reached = _reached(anchors, neighbours)
    for edge in edges:
        if edge.from_ not in reached:
            return Unanchored(edge.line, sorted(_reached([edge.from_], neighbours)))
    return None


def _reached(begin: Collection[int], neighbours: dict[int, list[int]]) -> set[int]:
    reached, ahead = set(begin), list(begin)
    while ahead:
        for neighbour in neighbours.get(ahead.pop(), []):
            if neighbour not in reached:
                reached.add(neighbour)
                ahead.append(neighbour)
    return reached
