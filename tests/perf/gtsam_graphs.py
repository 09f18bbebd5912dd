"""GTSAM's graphs of the same information matrix: a factor for each block, already summed, which is the
least work for it.
"""

from collections.abc import Iterable

import gtsam
import numpy as np

from survey_file import ZERO_BLOCK, Pair, SurveyFile

ZERO_VECTOR = np.zeros(6)


def base_graph(survey: SurveyFile) -> gtsam.GaussianFactorGraph:
    """Lambda_0."""
    graph = gtsam.GaussianFactorGraph()
    for (row, column), block in zip(survey["system_pairs"].tolist(), survey["system_blocks"], strict=True):
        if row == column:
            graph.push_back(gtsam.HessianFactor(row, block, ZERO_VECTOR, 0.0))
        else:
            pair = Pair(row, column, ZERO_BLOCK, block, ZERO_BLOCK)
            graph.push_back(hessian(pair))
    return graph


def path_graph(survey: SurveyFile, candidate: int) -> gtsam.GaussianFactorGraph:
    """What a candidate adds."""
    graph = gtsam.GaussianFactorGraph()
    for pair in survey.path(candidate):
        graph.push_back(hessian(pair))
    return graph


def joined(*graphs: gtsam.GaussianFactorGraph) -> gtsam.GaussianFactorGraph:
    """A graph of the factors of these; the factors are shared, not copied."""
    all_factors = gtsam.GaussianFactorGraph()
    for graph in graphs:
        all_factors.push_back(graph)
    return all_factors


def as_nonlinear(graph: gtsam.GaussianFactorGraph) -> gtsam.NonlinearFactorGraph:
    """The same factors for iSAM2, which linearises nothing then."""
    containers = gtsam.NonlinearFactorGraph()
    for index in range(graph.size()):
        containers.push_back(gtsam.LinearContainerFactor(graph.at(index)))
    return containers


def somewhere(nodes: Iterable[int]) -> gtsam.Values:
    """Values for nodes whose factors do not depend on them."""
    values = gtsam.Values()
    for node in nodes:
        values.insert(node, gtsam.Pose3())
    return values


def ordering_of(keys: Iterable[int]) -> gtsam.Ordering:
    found = gtsam.Ordering()
    for key in keys:
        found.push_back(key)
    return found


def keys_of(found: gtsam.Ordering) -> list[int]:
    return [found.at(index) for index in range(found.size())]


def hessian(pair: Pair) -> gtsam.HessianFactor:
    return gtsam.HessianFactor(
        pair.first_node,
        pair.second_node,
        pair.first,
        pair.cross,
        ZERO_VECTOR,
        pair.second + pair.own,
        ZERO_VECTOR,
        0.0,
    )
