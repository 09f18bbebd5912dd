"""Information matrices as the files write them, and the covariances that they stand for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .graph import PoseGraphError
from .transform import Matrix

ROUNDING = 5e-5
"""How far rounding to six digits can move the least eigenvalue of a 6x6 information matrix that is scaled to
a unit diagonal: each entry off the diagonal by 1e-5 (its own rounding, and half of that of each of two
diagonal entries), and five such in a row.
"""


class NotPositiveDefinite(PoseGraphError):
    """Information that says less than nothing about something."""


def covariance(upper: Sequence[float], *, mend: bool = False) -> tuple[Matrix, bool]:
    """The inverse of an information matrix given by its upper triangle, row by row, and whether it was
    mended.

    One that is indefinite by no more than six digits can cause is mended if `mend`: eigenvalues of the matrix
    scaled to a unit diagonal that are below `ROUNDING` are raised to it. Raises `PoseGraphError`.
    """
    size = {6: 3, 21: 6}[len(upper)]
    information = np.zeros((size, size))
    information[np.triu_indices(size)] = upper
    information = information + np.triu(information, 1).T
    with np.errstate(all="ignore"):
        try:
            if np.linalg.eigvalsh(information)[0] > 0.0:
                return _checked(np.asarray(np.linalg.inv(information), dtype=np.float64)), False
        except np.linalg.LinAlgError:
            pass  # It may be only that its units are far apart.
        try:
            return _scaled_inverse(information, mend)
        except np.linalg.LinAlgError:
            raise PoseGraphError("the information is too nearly singular to be inverted") from None


def diagonal(sigmas: tuple[float, float], size: int = 6) -> Matrix:
    """The covariance of independent errors: [m, rad], or of [x, y; heading] in the plane."""
    metres, radians = sigmas
    lengths = 3 if size == 6 else 2
    return np.diag([metres**2] * lengths + [radians**2] * (size - lengths))


def lifted(planar: Matrix, sigmas: tuple[float, float]) -> Matrix:
    """A covariance over [x, y; heading] as one over [x, y, z; rotation], with `sigmas` of z (m) and of roll
    and pitch (rad).
    """
    metres, radians = sigmas
    whole = np.diag([0.0, 0.0, metres**2, radians**2, radians**2, 0.0])
    plane = np.ix_([0, 1, 5], [0, 1, 5])
    whole[plane] = planar
    return whole


def _scaled_inverse(information: Matrix, mend: bool) -> tuple[Matrix, bool]:
    """The inverse by way of the matrix with a unit diagonal, mended if need be, and whether it was."""
    diagonal = np.diag(information)
    if diagonal.min() <= 0.0:
        raise NotPositiveDefinite(
            f"the information is not positive definite: its diagonal has {diagonal.min():g}; what an edge "
            "does not measure needs a small information, not none"
        )
    root = np.sqrt(diagonal)
    values, vectors = np.linalg.eigh(information / np.outer(root, root))
    if values[0] <= 0.0:
        _demand_mending(float(values[0]), mend)
    mended = bool(values[0] <= 0.0)
    if mended:
        values = np.maximum(values, ROUNDING)
    inverse = _checked((vectors / values) @ vectors.T)
    return inverse / np.outer(root, root), mended


def _demand_mending(least: float, mend: bool) -> None:
    told = (
        "the information is not positive definite: scaled to a unit diagonal its least eigenvalue is "
        f"{least:.3g}"
    )
    if least < -ROUNDING:
        raise NotPositiveDefinite(f"{told}, far beyond what rounding causes; mend or leave out the edge")
    if not mend:
        raise NotPositiveDefinite(
            f"{told}, no more than a writer of six digits makes of a nearly singular matrix (the usual "
            "cause). Write the file with 17 digits, or import it with --mend-information"
        )


def _checked(inverse: Matrix) -> Matrix:
    """A covariance, made symmetric to the bit; raises `LinAlgError` where rounding has left none."""
    inverse = (inverse + inverse.T) / 2.0
    np.linalg.cholesky(inverse)
    if not np.isfinite(inverse).all():
        raise np.linalg.LinAlgError("overflow")
    return np.asarray(inverse, dtype=np.float64)
