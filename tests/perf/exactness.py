"""How far ours and the peers are from the truth, on the same candidates."""

from collections.abc import Sequence

import numpy as np

import gtsam_ways
from information import (
    cholmod_matrix,
    cholmod_solver,
    information,
    lapack_solver,
    last_columns,
    superlu_solver,
)
from survey_file import Array, SurveyFile, spread
from truth import scaled, truth

DENSE_UP_TO_ROWS = 9_000


def exactness(survey: SurveyFile, ours: Sequence[Sequence[Sequence[float]]], runs: int) -> dict[str, object]:
    """Scaled errors of the terminal covariances of `runs` candidates: root of the mean square, and the
    greatest.
    """
    candidates = spread(runs, survey.candidates)
    errors: dict[str, list[float]] = {}
    certain = 0.0
    ways = [gtsam_ways.batch(survey, candidates), gtsam_ways.isam2_copies(survey, candidates)]
    for place, candidate in enumerate(candidates):
        matrix = information(survey, candidate)
        right = last_columns(matrix.shape[0])
        cholmod = cholmod_solver(cholmod_matrix(matrix))
        exact, correction = truth(matrix, cholmod)
        certain = max(certain, correction)
        found: dict[str, Array] = {
            "ours, at once": np.reshape(ours[0][candidate], (6, 6)),
            "ours, streamed": np.reshape(ours[1][candidate], (6, 6)),
            "GTSAM batch": ways[0].terminals[place],
            "GTSAM iSAM2": ways[1].terminals[place],
            "CHOLMOD": cholmod(right)[-6:],
            "SuperLU": superlu_solver(matrix)(right)[-6:],
        }
        if matrix.shape[0] <= DENSE_UP_TO_ROWS:
            found["LAPACK, dense"] = lapack_solver(matrix)(right)[-6:]
        for name, covariance in found.items():
            errors.setdefault(name, []).append(scaled(covariance - exact, exact))
    told = {
        name: {"rms": float(np.sqrt(np.mean(np.square(of)))), "greatest": max(of)}
        for name, of in errors.items()
    }
    return {"candidates": len(candidates), "truth_correction": certain, "errors": told}
