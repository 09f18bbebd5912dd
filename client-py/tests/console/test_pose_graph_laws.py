"""Laws of pose-graph files: what says the same has the same optimum; damage is not taken for something else.

The oracle is a dense Gauss-Newton of a few lines, which shares nothing with the planner.
"""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from graphs import Graph, Measured, graphs, optimum
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from pdn.console.pose_graph import PoseGraph, PoseGraphError, Transform, read_pose_graph

SAME = 1e-9
"""Relative difference of optima: the oracle stops at steps of 1e-10, and chi2 depends on them in second
order.
"""


def parsed(graph: Graph, **form: object) -> PoseGraph:
    return read_pose_graph(graph.text(**form).encode(), "graph.g2o")  # type: ignore[arg-type]


def same_optimum(one: Graph, other: Graph, **form: object) -> None:
    expected = optimum(parsed(one))
    assert optimum(parsed(other, **form)) == pytest.approx(expected, rel=SAME, abs=1e-12)


@given(graphs(), st.randoms(use_true_random=False))
@settings(max_examples=40, deadline=None)
def test_lines_may_come_in_any_order(graph: Graph, random: object) -> None:
    lines = graph.text().splitlines()
    random.shuffle(lines)  # type: ignore[attr-defined]
    shuffled = read_pose_graph("\n".join(lines).encode(), "graph.g2o")
    assert optimum(shuffled) == pytest.approx(optimum(parsed(graph)), rel=SAME)


@given(graphs(), st.data())
@settings(max_examples=40, deadline=None)
def test_ids_are_names(graph: Graph, data: st.DataObject) -> None:
    ids = sorted(graph.vertices)
    names = data.draw(
        st.lists(st.integers(0, 2**64 - 1), min_size=len(ids), max_size=len(ids), unique=True), label="ids"
    )
    same_optimum(graph, graph.renamed(dict(zip(ids, names, strict=True))))


@given(graphs(priors=True), st.integers(0, 2**32))
@settings(max_examples=40, deadline=None)
def test_the_world_is_a_choice(graph: Graph, seed: int) -> None:
    random = np.random.default_rng(seed)
    rotation = random.normal(size=4)
    x, y, z, w = (float(part) for part in rotation / np.linalg.norm(rotation))
    a, b, c = (float(part) for part in random.normal(scale=100.0, size=3))
    same_optimum(graph, graph.moved(Transform((a, b, c), (x, y, z, w))))


@given(graphs(), st.data())
@settings(max_examples=40, deadline=None)
def test_an_edge_may_be_told_from_either_end(graph: Graph, data: st.DataObject) -> None:
    which = data.draw(st.lists(st.booleans(), min_size=len(graph.edges), max_size=len(graph.edges)))
    turned = [edge.reversed() if turn else edge for edge, turn in zip(graph.edges, which, strict=True)]
    same_optimum(graph, dataclasses.replace(graph, edges=turned))


@given(graphs(priors=True), st.sampled_from(["\n", "\r\n", "\r", "  \n", " # said by 1 robot\r\n"]))
@settings(max_examples=40, deadline=None)
def test_line_ends_say_nothing(graph: Graph, end: str) -> None:
    same_optimum(graph, graph, end=end)


@given(graphs(), st.data())
@settings(max_examples=30, deadline=None)
def test_offsets_of_sensors_change_nothing_but_where_it_is_told(graph: Graph, data: st.DataObject) -> None:
    """Each edge told of sensors that are mounted off the vertices, exactly."""
    seed = data.draw(st.integers(0, 2**32))
    random = np.random.default_rng(seed)
    offsets = [Graph.random_pose(random, 1.0) for _ in range(3)]
    expected = optimum(parsed(graph))
    lines = [f"PARAMS_SE3OFFSET {index} {offset_text(offset)}" for index, offset in enumerate(offsets)]
    for edge in graph.edges:
        i, j = (int(one) for one in random.integers(0, 3, size=2))
        lines.append(edge.seen_from(i, j, offsets[i], offsets[j]))
    told = read_pose_graph("\n".join(lines).encode(), "graph.g2o")
    assert optimum(told) == pytest.approx(expected, rel=SAME)


def offset_text(offset: Transform) -> str:
    return " ".join(repr(value) for value in (*offset.translation, *offset.rotation))


MEANT = frozenset(b"0123456789+-.eE#")
"""Bytes that can make another number of a number, or a comment of a line: no reader can know."""

BLANK = frozenset(b" \t\n\r\x0b\x0c\x1c\x1d\x1e\x1f")


def taken(data: bytes) -> PoseGraph | None:
    """The graph; None where it is refused as it should be, which is checked."""
    try:
        return read_pose_graph(data, "graph.g2o")
    except PoseGraphError as error:
        message = str(error)
        assert len(message) <= 500
        head, line, _ = message.split(":", 2)
        assert head == "graph.g2o"
        assert 1 <= int(line) <= 1 + data.count(b"\n") + data.count(b"\r")
        return None


def told(graph: PoseGraph) -> tuple[object, ...]:
    edges = [(edge.from_, edge.to, edge.relative, edge.covariance.tobytes()) for edge in graph.edges]
    priors = [(prior.keyframe, prior.pose, prior.covariance.tobytes()) for prior in graph.priors]
    return graph.vertices, edges, priors, graph.anchors


@given(graphs(priors=True), st.data())
@settings(max_examples=400, deadline=None)
def test_a_byte_that_is_none_of_a_number_changes_nothing_or_is_refused(
    graph: Graph, data: st.DataObject
) -> None:
    text = graph.text().encode()
    place = data.draw(st.integers(0, len(text) - 1), label="place")
    byte = data.draw(st.sampled_from(sorted(set(range(256)) - MEANT)), label="byte")
    insert = data.draw(st.booleans(), label="insert")
    # A blank in the place of a digit makes another number.
    assume(insert or byte not in BLANK or text[place] in BLANK)
    damaged = text[:place] + bytes([byte]) + text[place + (not insert) :]
    read = taken(damaged)
    assert read is None or told(read) == told(parsed(graph))


@given(graphs(priors=True), st.data())
@settings(max_examples=200, deadline=None)
def test_any_damage_gives_a_graph_or_an_error_with_a_line(graph: Graph, data: st.DataObject) -> None:
    damaged = bytearray(graph.text().encode())
    for _ in range(data.draw(st.integers(1, 5), label="wounds")):
        if not damaged:
            break
        begin = data.draw(st.integers(0, len(damaged) - 1), label="begin")
        end = data.draw(st.integers(begin, min(len(damaged), begin + 60)), label="end")
        damaged[begin:end] = data.draw(st.binary(max_size=8), label="bytes")
    read = taken(bytes(damaged))
    if read is not None:
        assert {arrival.keyframe for arrival in read.arrivals()} == set(read.keyframes)
        for edge in read.edges:
            assert positive_definite(edge.covariance)


@given(st.binary(max_size=300))
@settings(max_examples=200, deadline=None)
def test_bytes_that_are_no_graph_are_refused_with_a_line(data: bytes) -> None:
    taken(data)


def positive_definite(covariance: NDArray[np.float64]) -> bool:
    root = np.sqrt(np.diag(covariance))
    # A correlation of 1 to the last digit may have rounded to either side.
    return bool(np.linalg.eigvalsh(covariance / np.outer(root, root))[0] > -1e-12)


def test_the_oracle_knows_a_difference() -> None:
    """A graph with another edge has another optimum, or the laws would hold of anything."""
    random = np.random.default_rng(1)
    graph = Graph.random(random, 6, 4)
    first = graph.edges[-1]
    bent = Measured(
        first.from_, first.to, first.pose @ Transform((0.05, 0, 0), (0, 0, 0, 1)), first.information
    )
    other = dataclasses.replace(graph, edges=[*graph.edges[:-1], bent])
    assert optimum(parsed(other)) != pytest.approx(optimum(parsed(graph)), rel=1e-3)
