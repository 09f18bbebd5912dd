"""GTSAM's ways to the terminal covariance of each candidate. Graphs are prepared before the clock starts."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import gtsam
import numpy as np

from cpu import timed
from gtsam_graphs import as_nonlinear, base_graph, joined, keys_of, ordering_of, path_graph, somewhere
from survey_file import Array, SurveyFile

ORDERINGS = ("COLAMD", "METIS")


@dataclass
class Way:
    """What a way takes: once, and for each candidate that was run; ms of CPU."""

    name: str
    shared: float
    candidate: list[float] = field(default_factory=list)
    terminals: list[Array] = field(default_factory=list)

    def add(self, milliseconds: float, terminal: Array) -> None:
        self.candidate.append(milliseconds)
        self.terminals.append(terminal)

    @property
    def mean(self) -> float:
        return float(np.mean(self.candidate))


def batch(survey: SurveyFile, candidates: Sequence[int], orderings: Sequence[str] = ORDERINGS) -> Way:
    """The paper's way: everything is ordered and eliminated for each candidate. Of the orderings the
    quicker one.
    """
    return _quicker("batch", 0.0, base_graph(survey), survey, candidates, orderings)


def untouched_once(
    survey: SurveyFile,
    candidates: Sequence[int],
    touched_by: Sequence[int],
    orderings: Sequence[str] = ORDERINGS,
) -> Way:
    """Poses that none of the candidates `touched_by` touches are eliminated once; the rest anew for each
    candidate.
    """
    base = base_graph(survey)
    touched = set().union(*(survey.linked(candidate) for candidate in touched_by))
    colamd = gtsam.Ordering.ColamdConstrainedLastGaussianFactorGraph
    found, order_ms = timed(colamd, base, sorted(touched))
    untouched = ordering_of(key for key in keys_of(found) if key not in touched)
    (_, rest), eliminate_ms = timed(base.eliminatePartialMultifrontal, untouched)
    return _quicker("untouched once", order_ms + eliminate_ms, rest, survey, candidates, orderings)


def isam2_copies(survey: SurveyFile, candidates: Sequence[int]) -> Way:
    """A copy of iSAM2's tree for each candidate, which takes in its factors; only the terminal node is
    kept last.
    """
    parameters = gtsam.ISAM2Params()
    parameters.enableRelinearization = False
    tree = gtsam.ISAM2(parameters)
    factors, values = as_nonlinear(base_graph(survey)), somewhere(range(survey.keyframes))
    _, shared = timed(tree.update, factors, values)
    way = Way("iSAM2 copies", shared)
    for candidate in candidates:
        terminal = survey.terminal(candidate)
        factors = as_nonlinear(path_graph(survey, candidate))
        values = somewhere(range(survey.keyframes, terminal + 1))
        way.add(*reversed(timed(_on_copy, tree, factors, values, terminal)))
    return way


def _on_copy(
    tree: gtsam.ISAM2, factors: gtsam.NonlinearFactorGraph, values: gtsam.Values, terminal: int
) -> Array:
    copy, last = gtsam.ISAM2(tree), gtsam.KeyGroupMap()
    last.insert2(terminal, 1)
    copy.update(factors, values, [], last)
    return copy.marginalCovariance(terminal)


def _quicker(
    name: str,
    shared: float,
    ground: gtsam.GaussianFactorGraph,
    survey: SurveyFile,
    candidates: Sequence[int],
    orderings: Sequence[str],
) -> Way:
    """Each candidate on this ground, ordered and eliminated with its last node last."""
    ways = [Way(f"{name}, {by}", shared) for by in orderings]
    for candidate in candidates:
        graph, terminal = joined(ground, path_graph(survey, candidate)), survey.terminal(candidate)
        for way, by in zip(ways, orderings, strict=True):
            found, order_ms = timed(_ordered, graph, by, terminal)
            covariance, eliminate_ms = timed(_terminal, graph, _with_last(found, terminal))
            way.add(order_ms + eliminate_ms, covariance)
    return min(ways, key=lambda way: way.mean)


def _ordered(graph: gtsam.GaussianFactorGraph, by: str, last: int) -> gtsam.Ordering:
    if by == "COLAMD":
        return gtsam.Ordering.ColamdConstrainedLastGaussianFactorGraph(graph, [last])
    return gtsam.Ordering.MetisGaussianFactorGraph(graph)


def _terminal(graph: gtsam.GaussianFactorGraph, ordering: gtsam.Ordering) -> Array:
    return graph.eliminateMultifrontal(ordering).marginalCovariance(ordering.at(ordering.size() - 1))


def _with_last(found: gtsam.Ordering, last: int) -> gtsam.Ordering:
    """METIS knows no constraint: the last node is moved to the end, where as the end of a chain it costs
    little.
    """
    keys = keys_of(found)
    return found if keys[-1] == last else ordering_of([*(key for key in keys if key != last), last])
