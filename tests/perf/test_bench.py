"""The benchmark on its quick grid: it runs, all solve the same problem, and ours is as exact as it must
be.
"""

import json
import os
import subprocess
import sys
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse

from information import cholmod_matrix, cholmod_solver
from truth import scaled, truth

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]

PEERS = ("GTSAM batch", "GTSAM iSAM2", "CHOLMOD", "SuperLU")
MOST_TIMES_THE_PEERS = 4.0
"""The errors of a few candidates scatter; twice is asked of the root of many squares, see README.md."""


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    pytest.importorskip("gtsam", reason="GTSAM has no wheel for this Python")
    binary = ROOT / os.environ.get("CARGO_TARGET_DIR", "target") / "release/pdn-perf"
    assert binary.exists(), f"{binary} is missing: cargo build --release -p pdn-perf"
    out = tmp_path_factory.mktemp("bench")
    command = [sys.executable, str(HERE / "bench.py"), "--grid", "quick"]
    subprocess.run([*command, "--binary", str(binary), "--out", str(out)], check=True, timeout=540)
    assert "| GTSAM batch |" in (out / "tables.md").read_text()
    found: dict[str, Any] = json.loads((out / "results.json").read_text())
    return found


@pytest.mark.bench
@pytest.mark.timeout(600)
def test_ours_is_as_exact_as_the_peers(results: dict[str, Any]) -> None:
    for survey in results["surveys"]:
        exactness = survey["exactness"]
        assert exactness["truth_correction"] < 1e-13
        errors = {name: error["rms"] for name, error in exactness["errors"].items()}
        peers = max(errors[name] for name in PEERS)
        assert 0 < peers < 1e-10, errors
        for name in ("ours, at once", "ours, streamed"):
            assert errors[name] <= MOST_TIMES_THE_PEERS * peers, errors


@pytest.mark.bench
def test_the_smoother_ends_at_the_batch_optimum(results: dict[str, Any]) -> None:
    for survey in results["surveys"]:
        assert max(survey["ours"]["converged_drift"]) < 1e-6


@pytest.mark.bench
def test_isam2_gets_the_same_stream(results: dict[str, Any]) -> None:
    """Its camera factor weighs a direction by the measured baseline, so its optimum differs by
    centimetres.
    """
    for isam2 in results["surveys"][0]["isam2"].values():
        metres, radians = isam2["from_ours"]
        assert metres < 0.05, isam2
        assert radians < 1e-3, isam2


def test_the_truth_is_that_of_rational_numbers() -> None:
    """A chain of odometry in information form, ill-conditioned as surveys are, inverted in fractions."""
    random = np.random.default_rng(1)
    size = 18
    rows = np.eye(size) - np.eye(size, k=-6)
    weights = 10.0 ** random.integers(0, 5, size)
    jacobian = weights[:, None] * (rows + 0.01 * random.standard_normal((size, size)) * (rows != 0))
    matrix = jacobian.T @ jacobian
    matrix = (matrix + matrix.T) / 2
    exact = inverse_in_fractions(matrix)[-6:, -6:]

    as_sparse = scipy.sparse.csc_matrix(matrix.astype(np.longdouble))
    in_doubles = cholmod_solver(cholmod_matrix(as_sparse))
    found, correction = truth(as_sparse, in_doubles)
    error = off(found, exact)
    assert error < 1e-18 * np.linalg.cond(matrix)
    assert error < 10 * correction  # which the benchmark tells as the truth's own error
    in_double_precision = in_doubles(np.eye(size)[:, -6:])[-6:]
    assert off(in_double_precision, exact) > 100 * error


def off(covariance: np.ndarray[Any, Any], exact: np.ndarray[Any, Any]) -> float:
    return scaled((covariance - exact).astype(float), exact.astype(float))


def inverse_in_fractions(matrix: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """Gauss and Jordan without rounding; the result is rounded to 80 bits."""
    size = len(matrix)
    rows = [
        [Fraction(float(value)) for value in row] + [Fraction(int(i == j)) for j in range(size)]
        for i, row in enumerate(matrix)
    ]
    for pivot in range(size):
        inverse = 1 / rows[pivot][pivot]
        rows[pivot] = [value * inverse for value in rows[pivot]]
        for other in range(size):
            if other != pivot and rows[other][pivot]:
                share = rows[other][pivot]
                pairs = zip(rows[other], rows[pivot], strict=True)
                rows[other] = [value - share * of_pivot for value, of_pivot in pairs]
    high = np.array([[float(value) for value in row[size:]] for row in rows]).astype(np.longdouble)
    low = [
        [float(value - Fraction(float(value))) for value in row[size:]] for row in rows
    ]  # What a double leaves of a fraction.
    return high + np.array(low).astype(np.longdouble)
