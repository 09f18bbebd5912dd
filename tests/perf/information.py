"""Lambda of a candidate as a sparse matrix, and what solves with it: CHOLMOD, SuperLU and LAPACK."""

from collections.abc import Callable
from typing import Any

import cvxopt
import cvxopt.cholmod
import numpy as np
import scipy.linalg
import scipy.sparse
import scipy.sparse.linalg

from survey_file import Array, SurveyFile

Sparse = Any  # scipy has no types.
Solver = Callable[[Array], Array]


def information(survey: SurveyFile, candidate: int) -> Sparse:
    """Lambda_pdn in 80-bit floating point: the exact sum of the blocks, or nearly so. The last six rows
    are the terminal's.
    """
    pairs = list(survey.path(candidate))
    firsts = np.array([pair.first_node for pair in pairs])
    seconds = np.array([pair.second_node for pair in pairs])
    size = survey.terminal(candidate) + 1
    pieces = [
        (*survey["system_pairs"].T.astype(np.int64), survey["system_blocks"]),
        (firsts, firsts, np.array([pair.first for pair in pairs])),
        (firsts, seconds, np.array([pair.cross for pair in pairs])),
        (seconds, seconds, np.array([pair.second for pair in pairs])),
        (seconds, seconds, np.array([pair.own for pair in pairs])),
    ]
    return sum(_of_blocks(size, *piece) for piece in pieces).tocsc()


def _of_blocks(size: int, rows: Array, columns: Array, blocks: Array) -> Sparse:
    """A symmetric matrix from blocks of one triangle; those of equal place are added."""
    across = rows != columns
    rows, columns = np.concatenate([rows, columns[across]]), np.concatenate([columns, rows[across]])
    blocks = np.concatenate([blocks, blocks[across].transpose(0, 2, 1)]).astype(np.longdouble)
    inside = np.arange(6)
    row = np.broadcast_to(6 * rows[:, None, None] + inside[None, :, None], blocks.shape)
    column = np.broadcast_to(6 * columns[:, None, None] + inside[None, None, :], blocks.shape)
    entries = (blocks.ravel(), (row.ravel(), column.ravel()))
    return scipy.sparse.coo_matrix(entries, shape=(6 * size, 6 * size)).tocsc()


def last_columns(size: int) -> Array:
    """The right-hand side whose solution ends with the terminal covariance."""
    columns = np.zeros((size, 6))
    columns[-6:] = np.eye(6)
    return columns


def cholmod_matrix(matrix: Sparse) -> cvxopt.spmatrix:
    """The lower triangle, as CHOLMOD wants it."""
    lower = scipy.sparse.tril(matrix.astype(np.float64)).tocoo()
    return cvxopt.spmatrix(lower.data, lower.row.tolist(), lower.col.tolist(), lower.shape)


def cholmod_solver(lower: cvxopt.spmatrix) -> Solver:
    """Orders by AMD and factors by supernodes."""
    factor = cvxopt.cholmod.symbolic(lower)
    cvxopt.cholmod.numeric(lower, factor)

    def solve(columns: Array) -> Array:
        solution = cvxopt.matrix(columns)
        cvxopt.cholmod.solve(factor, solution)
        return np.array(solution)

    return solve


def superlu_solver(matrix: Sparse) -> Solver:
    """Minimum degree, no pivoting."""
    factor = scipy.sparse.linalg.splu(
        matrix.astype(np.float64),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    return lambda columns: np.asarray(factor.solve(columns))


def lapack_solver(matrix: Sparse) -> Solver:
    """Dense Cholesky."""
    factor = scipy.linalg.cho_factor(matrix.astype(np.float64).toarray(), lower=True, overwrite_a=True)
    return lambda columns: np.asarray(scipy.linalg.cho_solve(factor, columns))
