"""The terminal covariance in extended precision, and how far others are from it."""

import numpy as np

from information import Solver, Sparse, last_columns
from survey_file import Array

ROUNDS = 12


def truth(matrix: Sparse, solve: Solver) -> tuple[Array, float]:
    """The last 6x6 block of the inverse of an 80-bit matrix, and the size of its last correction, scaled.

    Iterative refinement: a factor in doubles solves, residuals and sums are taken in 80 bits, until
    corrections no longer shrink. What is left is the error of 80-bit arithmetic, 2^11 times less than
    that of doubles.
    """
    right = last_columns(matrix.shape[0]).astype(np.longdouble)
    solution = np.zeros_like(right)
    last = np.inf
    for _ in range(ROUNDS):
        residual = right - matrix @ solution
        correction = solve(residual.astype(np.float64)).astype(np.longdouble)
        solution += correction
        change = scaled(correction[-6:], solution[-6:])
        if change >= 0.5 * last:
            break
        last = change
    return solution[-6:], last


def scaled(difference: Array, covariance: Array) -> float:
    """The greatest entry of a difference, relative to sigma_i sigma_j."""
    sigmas = np.sqrt(np.diag(covariance))
    return float(np.max(np.abs(difference) / np.outer(sigmas, sigmas)))
