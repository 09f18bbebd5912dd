"""CHOLMOD's way to the terminal covariance: order (AMD), factor and solve anew for each candidate."""

from collections.abc import Sequence

import cvxopt

from cpu import timed
from gtsam_ways import Way
from information import cholmod_matrix, cholmod_solver, information, last_columns
from survey_file import Array, SurveyFile


def cholmod_batch(survey: SurveyFile, candidates: Sequence[int]) -> Way:
    way = Way("CHOLMOD batch", 0.0)
    for candidate in candidates:
        matrix = information(survey, candidate)
        lower, right = cholmod_matrix(matrix), last_columns(matrix.shape[0])
        solution, milliseconds = timed(_solution, lower, right)
        way.add(milliseconds, solution[-6:])
    return way


def _solution(lower: cvxopt.spmatrix, right: Array) -> Array:
    return cholmod_solver(lower)(right)
