"""Pose-graph files: what is taken exactly, what is left out and told, what is refused with its line."""

from __future__ import annotations

import gzip
import math

import numpy as np
import pytest

from pdn.console.pose_graph import ORIGIN, Assumptions, PoseGraph, PoseGraphError, Transform, read_pose_graph

INFORMATION = "100 1 0 0 0 0 90 0 2 0 0 80 0 0 0 25 0 3 24 0 23"
STEP = "1.0 2.0 3.0 0.0 0.0 0.6000001 0.8"
EDGE = f"EDGE_SE3:QUAT 0 1 {STEP} {INFORMATION}"
BACK = f"EDGE_SE3:QUAT 1 2 {STEP} {INFORMATION}"
VERTEX = "VERTEX_SE3:QUAT 0 0 0 5 0 0 0 1"


def read(*lines: str, end: str = "\n", assumptions: Assumptions | None = None) -> PoseGraph:
    return read_pose_graph("".join(line + end for line in lines).encode(), "graph.g2o", assumptions)


def same(one: PoseGraph, other: PoseGraph) -> bool:
    """Whether two graphs say the same, to the bit."""
    return (
        one.vertices == other.vertices
        and one.anchors == other.anchors
        and [(edge.from_, edge.to, edge.relative) for edge in one.edges]
        == [(edge.from_, edge.to, edge.relative) for edge in other.edges]
        and all(
            np.array_equal(a.covariance, b.covariance) for a, b in zip(one.edges, other.edges, strict=True)
        )
    )


# --- taken exactly ---


def test_reads_an_edge_in_our_tangent_order() -> None:
    (edge,) = read("# a comment", VERTEX, EDGE).edges
    assert (edge.line, edge.from_, edge.to) == (3, 0, 1)
    assert edge.relative.translation == (1.0, 2.0, 3.0)
    assert abs(np.linalg.norm(edge.relative.rotation) - 1.0) < 1e-15
    information = np.linalg.inv(edge.covariance)
    upper = [float(word) for word in INFORMATION.split()]
    # A 6x6 inverse of condition 5, twice: a few rounding errors of 1e-16 times 100.
    np.testing.assert_allclose(information[np.triu_indices(6)], upper, atol=1e-12)


def test_stream_has_the_order_of_a_vehicle() -> None:
    pairs = [(3, 1), (0, 1), (0, 3), (1, 2), (2, 3)]
    graph = read(*[f"EDGE_SE3:QUAT {a} {b} {STEP} {INFORMATION}" for a, b in pairs])
    arrivals = [
        (arrival.keyframe, [(edge.from_, edge.to) for edge in arrival.edges]) for arrival in graph.arrivals()
    ]
    assert arrivals == [(0, []), (1, [(0, 1)]), (2, [(1, 2)]), (3, [(2, 3), (3, 1), (0, 3)])]


def test_stream_begins_at_what_is_held_and_never_leaves_a_keyframe_untied() -> None:
    pairs = [(0, 1), (1, 2), (2, 3), (3, 4), (0, 3)]
    edges = [f"EDGE_SE3:QUAT {a} {b} {STEP} {INFORMATION}" for a, b in pairs]
    graph = read("VERTEX_SE3:QUAT 3 1 2 3 0 0 0 1", *edges, "FIX 3")
    assert graph.anchors == {3: Transform((1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0))}
    # By steps of the trajectory, not by the loop closure 0 - 3.
    assert [arrival.keyframe for arrival in graph.arrivals()] == [3, 2, 1, 0, 4]
    assert any("FIX holds vertex 3, not the lowest id, 0" in note for note in graph.notes)


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r", " \t\r\n"])
def test_any_line_end_is_one(end: str) -> None:
    assert same(read(VERTEX, EDGE, BACK, end=end), read(VERTEX, EDGE, BACK))


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_a_byte_order_mark_is_no_part_of_the_first_tag(encoding: str) -> None:
    data = "\n".join([VERTEX, EDGE]).encode(encoding)
    assert same(read_pose_graph(data, "graph.g2o"), read(VERTEX, EDGE))


@pytest.mark.parametrize("comment", ["# dive 3", "   # dive 3", "\t#", "# 1 2 3", "# caf\u00e9 \u2028 more"])
def test_comments_stand_alone_or_after_the_numbers(comment: str) -> None:
    assert same(read(comment, f"{VERTEX} {comment}", f"{EDGE} {comment}", ""), read(VERTEX, EDGE))


def test_a_comment_in_another_encoding_is_a_comment() -> None:
    data = b"# M\xfcller\n" + f"{VERTEX}\n{EDGE} # \xff\n".encode("latin-1")
    assert same(read_pose_graph(data, "graph.g2o"), read(VERTEX, EDGE))


def test_toro_has_roll_pitch_and_yaw_about_fixed_axes() -> None:
    roll, pitch, yaw = 0.1, -0.2, 0.3
    upper = INFORMATION
    (edge,) = read(f"EDGE3 0 1 1 2 3 {roll} {pitch} {yaw} {upper}").edges
    about = {
        "z": np.array([[math.cos(yaw), -math.sin(yaw), 0], [math.sin(yaw), math.cos(yaw), 0], [0, 0, 1]]),
        "y": np.array(
            [[math.cos(pitch), 0, math.sin(pitch)], [0, 1, 0], [-math.sin(pitch), 0, math.cos(pitch)]]
        ),
        "x": np.array([[1, 0, 0], [0, math.cos(roll), -math.sin(roll)], [0, math.sin(roll), math.cos(roll)]]),
    }
    np.testing.assert_allclose(edge.relative.matrix(), about["z"] @ about["y"] @ about["x"], atol=1e-15)
    np.testing.assert_array_equal(edge.covariance, read(EDGE).edges[0].covariance)


PLANE = "4 0.1 0.2 5 0.3 6"  # xx xy xh yy yh hh


def test_a_plane_is_lifted_with_the_sigmas_that_are_stated() -> None:
    graph = read(
        "VERTEX_SE2 0 1 2 0.5",
        f"EDGE_SE2 0 1 1 0 0.25 {PLANE}",
        assumptions=Assumptions(plane_sigmas=(0.5, 0.25)),
    )
    (edge,) = graph.edges
    assert graph.planar
    assert edge.relative == Transform((1.0, 0.0, 0.0), (0.0, 0.0, math.sin(0.125), math.cos(0.125)))
    information = np.linalg.inv(edge.covariance)
    plane = np.array([[4, 0.1, 0.2], [0.1, 5, 0.3], [0.2, 0.3, 6]])
    np.testing.assert_allclose(information[np.ix_([0, 1, 5], [0, 1, 5])], plane, rtol=1e-14)
    np.testing.assert_allclose(np.diag(edge.covariance)[2:5], [0.25, 0.0625, 0.0625], rtol=1e-14)
    assert graph.degrees_of_freedom == 0
    assert any("z stays (sigma 0.5 m)" in note for note in graph.notes)


def test_toro_writes_the_information_of_a_plane_in_another_order() -> None:
    toro = read("EDGE2 0 1 1 0 0.25 4 0.1 5 6 0.2 0.3")
    np.testing.assert_array_equal(
        toro.edges[0].covariance, read(f"EDGE_SE2 0 1 1 0 0.25 {PLANE}").edges[0].covariance
    )


OFFSETS = ("PARAMS_SE3OFFSET 1 0.5 0 0 0 0 0.6 0.8", "PARAMS_SE3OFFSET 2 0 0 1 0.6 0 0 0.8")


def residual_cost(edge_pose: Transform, covariance: np.ndarray, error: Transform) -> float:
    """r' W r to first order for a small error E, of E itself."""
    del edge_pose
    rotation = 2.0 * np.array(error.rotation[:3])
    r = np.concatenate([error.translation, rotation])
    return float(r @ np.linalg.solve(covariance, r))


def test_offsets_of_an_edge_are_taken_into_it() -> None:
    graph = read(*OFFSETS, f"EDGE_SE3_OFFSET 0 1 1 2 {STEP} {INFORMATION}")
    (edge,) = graph.edges
    plain = read(EDGE).edges[0]
    first = Transform((0.5, 0.0, 0.0), (0.0, 0.0, 0.6, 0.8))
    second = Transform((0.0, 0.0, 1.0), (0.6, 0.0, 0.0, 0.8))
    # Where the sensors are one step apart, the vertices are as the edge says.
    whole = first @ plain.relative @ second.inverse()
    np.testing.assert_allclose(edge.relative.translation, whole.translation, atol=1e-15)
    np.testing.assert_allclose(edge.relative.rotation, whole.rotation, atol=1e-15)
    # A small error costs the same, told of the sensors or of the vertices.
    error = Transform((1e-6, -2e-6, 3e-6), (1e-6, 2e-6, -1e-6, 1.0))
    at_vertices = second @ error @ second.inverse()
    there = residual_cost(edge.relative, edge.covariance, at_vertices)
    # The second order of the error, 1e-6 of it, is left out.
    assert there == pytest.approx(residual_cost(plain.relative, plain.covariance, error), rel=1e-5)


def test_a_prior_holds_the_graph_and_has_an_offset_too() -> None:
    graph = read(*OFFSETS, EDGE, f"EDGE_SE3_PRIOR 1 1 {STEP} {INFORMATION}")
    (prior,) = graph.priors
    assert (prior.line, prior.keyframe, graph.anchors) == (4, 1, {})
    back = prior.pose @ Transform((0.5, 0.0, 0.0), (0.0, 0.0, 0.6, 0.8))
    np.testing.assert_allclose(back.translation, (1.0, 2.0, 3.0), atol=1e-15)
    assert [arrival.keyframe for arrival in graph.arrivals()] == [1, 0]
    assert graph.degrees_of_freedom == 0


def test_an_offset_of_nothing_leaves_every_bit() -> None:
    none = "PARAMS_SE3OFFSET 0 0 0 0 0 0 0 1"
    offset = read(none, f"EDGE_SE3_OFFSET 0 1 0 0 {STEP} {INFORMATION}").edges[0]
    np.testing.assert_array_equal(offset.covariance, read(EDGE).edges[0].covariance)
    assert offset.relative == read(EDGE).edges[0].relative


def test_two_pieces_are_taken_where_both_are_held() -> None:
    graph = read(
        VERTEX, "VERTEX_SE3:QUAT 5 9 9 9 0 0 0 1", EDGE, f"EDGE_SE3:QUAT 5 6 {STEP} {INFORMATION}", "FIX 0 5"
    )
    assert sorted(graph.anchors) == [0, 5]
    assert [arrival.keyframe for arrival in graph.arrivals()] == [0, 1, 5, 6]
    assert graph.degrees_of_freedom == 0


def test_a_plane_has_offsets_and_priors_too() -> None:
    quarter = math.pi / 2
    graph = read(
        f"PARAMS_SE2OFFSET 0 1 0 {quarter!r}",
        f"EDGE_SE2_OFFSET 0 1 0 0 0 2 0 {PLANE}",
        f"EDGE_PRIOR_SE2 0 5 6 0 {PLANE}",
    )
    (edge,) = graph.edges
    # Sensors 1 m ahead that look to the left: 2 m to their left is 2 m back for the vertices.
    np.testing.assert_allclose(edge.relative.translation, (-2.0, 0.0, 0.0), atol=1e-15)
    np.testing.assert_allclose(edge.relative.matrix(), np.eye(3), atol=1e-15)
    (prior,) = graph.priors
    assert (prior.keyframe, prior.pose.translation, graph.anchors) == (0, (5.0, 6.0, 0.0), {})


def test_an_isolated_vertex_does_not_become_the_anchor() -> None:
    graph = read("VERTEX_SE3:QUAT 0 9 9 9 0 0 0 1", "VERTEX_SE3:QUAT 1 1 2 3 0 0 0 1", BACK)
    assert graph.anchors == {1: Transform((1.0, 2.0, 3.0), (0.0, 0.0, 0.0, 1.0))}
    assert graph.keyframes == [1, 2]


# --- left out or assumed, and told ---


@pytest.mark.parametrize(
    ("lines", "note"),
    [
        ([VERTEX, EDGE, "VERTEX_SE3:QUAT 6 0 0 5 0 0 0 1"], "left out: vertex 6 without an edge"),
        ([VERTEX, EDGE], "vertex 1 without a VERTEX line, named by an edge (line 2): taken"),
        ([EDGE], "the file has edges only"),
        ([EDGE], "vertex 0 is held at the origin"),
        ([EDGE, "VERTEX_TRACKXYZ 7 1 2 3", "EDGE_SE3_TRACKXYZ 1 7 0 1 2 3 1 0 0 1 0 1"], "line of landmarks"),
        ([EDGE, "LANDMARK2 0 7 1 2 1 0 1"], "1 line of measurements of landmarks"),
        ([EDGE, "EQUIV 0 1"], "equivalences"),
        ([EDGE, "BR 0 7 0.5 3 0.1 0.1", "LANDMARK 7 1 2"], "2 lines of measurements of landmarks"),
        ([EDGE, "EDGE_SE3_XYZ_PRIOR 1 0 1 2 3 1 0 0 1 0 1"], "1 line of measured positions"),
        ([VERTEX, EDGE, "VERTEX_SE3:QUAT 6 0 0 5 0 0 0 1", "FIX 0 6"], "FIX of what is left out"),
        ([VERTEX, EDGE, "VERTEX_SE3:QUAT 6 0 0 5 0 0 0 1", "FIX 6"], "FIX of what is left out"),
        ([EDGE, "ROBOTLASER1 0 1 2 3"], "sensor data"),
        ([f"{VERTEX} start", EDGE], "words after the numbers of 1 line, the first 'start' in line 1"),
        ([VERTEX, EDGE, "VERTEX_TRACKXYZ 7 1 2 3", "FIX 0 7"], "FIX of what is left out"),
    ],
)  # fmt: skip
def test_tells_what_was_left_out_or_assumed(lines: list[str], note: str) -> None:
    graph = read(*lines)
    assert any(note in told for told in graph.notes), graph.notes
    assert [(edge.from_, edge.to) for edge in graph.edges] == [(0, 1)]
    assert graph.keyframes == [0, 1]


def test_a_plain_file_has_nothing_to_be_told() -> None:
    assert read(VERTEX, "VERTEX_SE3:QUAT 1 0 0 5 0 0 0 1", EDGE, "FIX 0").notes == []


def test_edges_without_information_are_taken_as_sure_as_the_caller_says() -> None:
    graph = read(f"EDGE_SE3:QUAT 0 1 {STEP}", BACK, assumptions=Assumptions(default_sigmas=(0.5, 0.25)))
    np.testing.assert_array_equal(graph.edges[0].covariance, np.diag([0.25] * 3 + [0.0625] * 3))
    assert "1 measurement without information: taken with sigmas of 0.5 m and 0.25 rad" in graph.notes
    planar = read("EDGE_SE2 0 1 1 0 0", assumptions=Assumptions((0.5, 0.25), (0.1, 0.01)))
    variances = [0.25, 0.25, 0.01, 0.0001, 0.0001, 0.0625]
    np.testing.assert_allclose(planar.edges[0].covariance, np.diag(variances), rtol=1e-15)


def six_digits(information: np.ndarray) -> str:
    return " ".join(f"{value:.6g}" for value in information[np.triu_indices(6)])


def nearly_singular() -> np.ndarray:
    """Positive definite, and not so with six digits."""
    mixing = np.random.default_rng(3).normal(size=(6, 6))
    return np.asarray(mixing @ np.diag([1e-7, 1e-3, 1.0, 1.0, 10.0, 1e3]) @ mixing.T)


def test_information_that_six_digits_have_made_indefinite_is_mended_when_asked() -> None:
    whole = nearly_singular()
    assert np.linalg.eigvalsh(whole)[0] > 0.0
    line = f"EDGE_SE3:QUAT 0 1 {STEP} {six_digits(whole)}"
    with pytest.raises(PoseGraphError, match=r"graph.g2o:1: .*writer of six digits.*--mend-information"):
        read(line)
    graph = read(line, assumptions=Assumptions(mend_information=True))
    mended = np.linalg.inv(graph.edges[0].covariance)
    root = np.sqrt(np.diag(whole))
    # What was lost is told as little as six digits can: 5e-5 of the unit diagonal, 6 times in the worst case.
    assert np.abs((mended - whole) / np.outer(root, root)).max() < 3e-4
    assert np.linalg.eigvalsh(graph.edges[0].covariance)[0] > 0.0
    assert any("mended the information of 1 measurement" in note for note in graph.notes)


def test_rounding_to_six_digits_never_looks_like_more_than_rounding() -> None:
    for seed in range(200):
        random = np.random.default_rng(seed)
        mixing = np.diag(10.0 ** random.uniform(-3, 3, 6)) @ random.normal(size=(6, 6))
        whole = mixing @ np.diag(10.0 ** random.uniform(-9, 0, 6)) @ mixing.T
        line = f"EDGE_SE3:QUAT 0 1 {STEP} {six_digits(whole)}"
        read(line, assumptions=Assumptions(mend_information=True))


# --- refused, with the line and what to do ---


@pytest.mark.parametrize(
    ("lines", "line", "says"),
    [
        ([EDGE, "VERTEX_SE2 0 0 0 0"], 2, "in the plane or in space"),
        (["EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1", VERTEX], 2, r"after EDGE_SE2 \(line 1\)"),
        (["LANDMARK3D 1 2"], 1, "unknown tag 'LANDMARK3D'"),
        ([EDGE, f"EDGE_SE3:QUAT 1 2 {STEP} {INFORMATION} 7"], 2, "not 31 fields; put a # before"),
        ([EDGE, f"{BACK} loop 7"], 2, "not 32 fields"),
        ([f"{VERTEX} {EDGE}"], 1, "an id and 7 numbers"),
        ([f"{EDGE}{BACK}"], 1, "two ids"),
        (["VERTEX_SE3:QUAT 0 1 2 3"], 1, "7 numbers"),
        ([f"EDGE_SE3:QUAT 0 -1 {STEP} {INFORMATION}"], 1, "no id"),
        ([f"EDGE_SE3:QUAT 0 {2**64} {STEP} {INFORMATION}"], 1, "no id"),
        ([f"EDGE_SE3:QUAT 0 {'9' * 5000} {STEP} {INFORMATION}"], 1, "no id"),
        ([f"EDGE_SE3:QUAT 0 \u0661 {STEP} {INFORMATION}"], 1, "no id"),
        ([f"EDGE_SE3:QUAT 4 4 {STEP} {INFORMATION}"], 1, "itself"),
        ([EDGE.replace("2.0", "nan")], 1, "finite"),
        ([EDGE.replace("2.0", "-1.#IND")], 1, "finite"),
        ([EDGE.replace("2.0", "1e999")], 1, "finite, or too large"),
        ([EDGE.replace("2.0", "two")], 1, "'two' is no number"),
        ([EDGE.replace("2.0", "2_0")], 1, "'2_0' is no number"),
        ([EDGE.replace("2.0", "0x2")], 1, "'0x2' is no number"),
        ([EDGE.replace("2.0", "2,0")], 1, r"'2,0' has a decimal comma.*LC_NUMERIC"),
        ([EDGE.replace("2.0", "-2,5e-3")], 1, "decimal comma"),
        ([EDGE.replace("2.0", "2.0D+00")], 1, "Fortran"),
        ([EDGE.replace("2.0", "2.0,")], 1, "separated by blanks"),
        ([f"{EDGE}#loop"], 1, "blank before the #"),
        ([EDGE.replace("0.8", "0.5")], 1, "norm"),
        ([EDGE.replace("0.6000001 0.8", "0 0")], 1, "norm is 0"),
        ([EDGE.replace("100 1", "-100 1")], 1, "positive definite"),
        ([EDGE.replace("100 1", "0 0")], 1, "positive definite"),
        ([EDGE.replace("100 1", "100 500")], 1, "far beyond what rounding causes"),
        ([EDGE.replace("100 1", "1e308 1e308")], 1, "positive definite"),
        ([f"EDGE_SE3:QUAT 0 1 {STEP}"], 1, "without information; .*--default-sigmas"),
        ([f"EDGE_SE3:QUAT 0 1 {STEP} {'1 ' * 36}"], 1, "only the upper triangle"),
        ([f"EDGE_SE3_OFFSET 0 1 {STEP} {INFORMATION}"], 1, "no ids of offsets"),
        (["EDGE2 0 1 1 0 0 1 0 0 1 0 1"], 1, "In the order of EDGE_SE2 it would be"),
        (["EDGE_SE2 0 1 1 0 0 1 0 1 1 0 0"], 1, "In the order of EDGE2 it would be"),
        ([VERTEX] * 2, 2, "twice"),
        ([OFFSETS[0]] * 2, 2, "offset 1 comes twice"),
        ([EDGE, f"EDGE_SE3_PRIOR 1 3 {STEP} {INFORMATION}"], 2, "offset 3 is not in .*: PARAMS_SE3OFFSET 3"),
        ([EDGE, "FIX 9"], 2, "FIX names vertex 9"),
        ([EDGE, "FIX"], 2, "names no vertex"),
        ([VERTEX, EDGE, "FIX 0 1"], 3, "FIX holds vertex 1, whose pose"),
        ([EDGE, f"EDGE_SE3:QUAT 2 3 {STEP} {INFORMATION}"], 2, "2 vertices, of which 2 .* FIX 2"),
        ([], 1, "no edge in it"),
        ([VERTEX, "VERTEX_XY 3 1 2"], 2, "no edge in it; there are 1 of landmarks"),
        (["", VERTEX], 2, "there are 1 vertex"),
    ],
)  # fmt: skip
def test_refuses_with_the_line(lines: list[str], line: int, says: str) -> None:
    with pytest.raises(PoseGraphError, match=says) as caught:
        read(*lines)
    assert str(caught.value).startswith(f"graph.g2o:{line}: ")
    assert len(str(caught.value)) <= 500


@pytest.mark.parametrize(
    "line",
    [
        "x" * 400_000,
        f"EDGE_SE3:QUAT 0 1 {'1 ' * 200_000}",
        f"{EDGE} {'loop' * 100_000} 7",
        "\U000e0001" * 99_999,
    ],
    ids=["word", "numbers", "trailing", "unprintable"],
)
def test_a_line_of_hundreds_of_kilobytes_is_not_repeated(line: str) -> None:
    with pytest.raises(PoseGraphError, match=r"^graph.g2o:2: ") as caught:
        read(VERTEX, line)
    assert len(str(caught.value)) <= 500


def test_a_long_path_leaves_room_for_what_is_wrong() -> None:
    with pytest.raises(PoseGraphError, match=r"^\.\.\.x*/a\.g2o:1: .*no edge in it"):
        read_pose_graph(b"", "x" * 4000 + "/a.g2o")


def test_no_error_is_longer_than_500_characters() -> None:
    assert len(str(PoseGraphError("x" * 501))) == 500
    assert str(PoseGraphError("x" * 500)) == "x" * 500


def test_a_packed_file_is_named() -> None:
    with pytest.raises(PoseGraphError, match=r"^graph.g2o:1: .*packed by gzip; unpack it first"):
        read_pose_graph(gzip.compress(EDGE.encode()), "graph.g2o")


def test_origin_is_where_nothing_is_moved() -> None:
    step = read(EDGE).edges[0].relative
    assert (step @ ORIGIN).translation == step.translation
    np.testing.assert_allclose((step @ step.inverse()).translation, (0, 0, 0), atol=1e-15)
