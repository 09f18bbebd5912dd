"""Reading g2o files: what is refused, and that what is read is what the file says."""

from pathlib import Path

import numpy as np
import pytest

from pdn.console.g2o import G2oError, read_g2o

INFORMATION = "100 1 0 0 0 0 90 0 2 0 0 80 0 0 0 25 0 3 24 0 23"
STEP = "1.0 2.0 3.0 0.0 0.0 0.6000001 0.8"


def write(folder: Path, *lines: str) -> Path:
    path = folder / "graph.g2o"
    path.write_text("\n".join(lines) + "\n")
    return path


def test_reads_an_edge_in_our_tangent_order(tmp_path: Path) -> None:
    path = write(
        tmp_path, "# a comment", "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1", f"EDGE_SE3:QUAT 0 1 {STEP} {INFORMATION}"
    )
    (edge,) = read_g2o(path).edges
    assert (edge.line, edge.from_, edge.to) == (3, 0, 1)
    assert edge.relative.translation == (1.0, 2.0, 3.0)
    assert abs(np.linalg.norm(edge.relative.rotation) - 1.0) < 1e-15
    information = np.linalg.inv(edge.covariance)
    upper = [float(word) for word in INFORMATION.split()]
    # A 6x6 inverse of condition 5, twice: a few rounding errors of 1e-16 times 100.
    np.testing.assert_allclose(information[np.triu_indices(6)], upper, atol=1e-12)


def test_stream_has_the_order_of_a_vehicle(tmp_path: Path) -> None:
    pairs = [(3, 1), (0, 1), (0, 3), (1, 2), (2, 3)]
    path = write(tmp_path, *[f"EDGE_SE3:QUAT {a} {b} {STEP} {INFORMATION}" for a, b in pairs])
    arrivals = [
        (keyframe, [(edge.from_, edge.to) for edge in edges]) for keyframe, edges in read_g2o(path).arrivals()
    ]
    assert arrivals == [(0, []), (1, [(0, 1)]), (2, [(1, 2)]), (3, [(2, 3), (3, 1), (0, 3)])]


EDGE = f"EDGE_SE3:QUAT 0 1 {STEP} {INFORMATION}"


@pytest.mark.parametrize(
    ("lines", "line", "says"),
    [
        (["EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1"], 1, "2-D"),
        ([EDGE, "VERTEX_SE2 0 0 0 0"], 2, "2-D"),
        (["LANDMARK 1 2"], 1, "unknown tag"),
        ([EDGE, f"EDGE_SE3:QUAT 1 2 {STEP} {INFORMATION} 7"], 2, "not 31 fields"),
        (["VERTEX_SE3:QUAT 0 1 2 3"], 1, "7 numbers"),
        ([f"EDGE_SE3:QUAT 0 -1 {STEP} {INFORMATION}"], 1, "no id"),
        ([f"EDGE_SE3:QUAT 0 {2**64} {STEP} {INFORMATION}"], 1, "no id"),
        ([f"EDGE_SE3:QUAT 0 {'9' * 5000} {STEP} {INFORMATION}"], 1, "no id"),
        ([f"EDGE_SE3:QUAT 4 4 {STEP} {INFORMATION}"], 1, "itself"),
        ([EDGE.replace("2.0", "nan")], 1, "finite"),
        ([EDGE.replace("2.0", "two")], 1, "two"),
        ([EDGE.replace("0.8", "0.5")], 1, "norm"),
        ([EDGE.replace("100 1", "-100 1")], 1, "positive definite"),
        ([EDGE.replace("100 1", "0 0")], 1, "positive definite"),
        (["VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1"] * 2, 2, "twice"),
    ],
)
def test_refuses_with_the_line(tmp_path: Path, lines: list[str], line: int, says: str) -> None:
    path = write(tmp_path, *lines)
    with pytest.raises(G2oError, match=says) as caught:
        read_g2o(path)
    assert f"graph.g2o:{line}: " in str(caught.value)


@pytest.mark.parametrize(
    ("lines", "says"),
    [([], "no EDGE"), ([EDGE, f"EDGE_SE3:QUAT 2 3 {STEP} {INFORMATION}"], "2 vertices, of which 2")],
)
def test_refuses_the_whole(tmp_path: Path, lines: list[str], says: str) -> None:
    with pytest.raises(G2oError, match=says):
        read_g2o(write(tmp_path, *lines))
