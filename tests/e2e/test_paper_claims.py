"""What the paper promises, flown with drawn noise over seeds through the real daemon."""

from pathlib import Path

import pytest
from pdn.sim.fleet import Flight, fly_all
from pdn.sim.record import Result
from scipy.stats import chi2

from conftest import start_daemon

SEEDS = range(1, 7)
ALPHAS = (1.0, 0.75, 0.5, 0.25, 0.0)

# The rule sees the allowance exceeded at a decision, each fourth keyframe: up to then U grows by about 0.01 a
# keyframe.
ONE_STEPS_GROWTH = 0.05


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> dict[Flight, Result]:
    """Open loop and PDN with alpha 1 over all seeds; the other policies with the first."""
    flights = [Flight(policy, 1.0, seed) for seed in SEEDS for policy in ("pdn", "open-loop")]
    flights += [Flight("exhaustive", 1.0, 1), *(Flight("pdn", alpha, 1) for alpha in ALPHAS[1:])]
    folder: Path = tmp_path_factory.mktemp("runs")
    daemon = start_daemon(folder, "--set", f"max_vehicles={len(flights)}")
    try:
        flown = fly_all(flights, "hull40", daemon.endpoint, folder, 2, visible=False)
    finally:
        daemon.stop()
    return dict(zip(flights, flown, strict=True))


@pytest.mark.timeout(2400)
def test_pdn_needs_few_revisits_and_keeps_the_allowance(results: dict[Flight, Result]) -> None:
    assert results[Flight("exhaustive", 1.0, 1)].revisits == 12
    for seed in SEEDS:
        pdn, open_loop = results[Flight("pdn", 1.0, seed)], results[Flight("open-loop", 1.0, seed)]
        assert 3 <= pdn.revisits <= 6
        assert pdn.max_uncertainty < 1 + ONE_STEPS_GROWTH
        assert open_loop.max_uncertainty > 1.3
        assert open_loop.path_m < pdn.path_m < results[Flight("exhaustive", 1.0, 1)].path_m


def test_the_weight_trades_path_for_uncertainty(results: dict[Flight, Result]) -> None:
    """Full weight flies longest and none shortest. Between, drawn noise may part neighbours by one revisit
    more or fewer: a nearer waypoint chosen once can make one more needed later.
    """
    lengths = [results[Flight("pdn", alpha, 1)].path_m for alpha in ALPHAS]
    assert lengths[0] == max(lengths)
    assert lengths[-1] == min(lengths)
    assert lengths[-1] < min(lengths[1:-1])


def test_without_weight_on_uncertainty_pdn_is_open_loop(results: dict[Flight, Result]) -> None:
    careless, open_loop = results[Flight("pdn", 0.0, 1)], results[Flight("open-loop", 1.0, 1)]
    assert careless.revisits == 0
    for figure in (
        "path_m",
        "max_uncertainty",
        "final_uncertainty",
        "position_rmse_m",
        "nees",
        "covered_believed_m2",
    ):
        assert getattr(careless, figure) == getattr(open_loop, figure)


@pytest.mark.parametrize("policy", ["open-loop", "pdn"])
def test_the_uncertainty_is_true(results: dict[Flight, Result], policy: str) -> None:
    """The sum over seeds of the final pose's NEES is chi-squared with six degrees of freedom a seed."""
    total = sum(results[Flight(policy, 1.0, seed)].nees for seed in SEEDS)
    low, high = chi2.ppf([0.025, 0.975], 6 * len(SEEDS))
    assert low < total < high


def test_the_hull_is_photographed_as_believed(results: dict[Flight, Result]) -> None:
    for result in results.values():
        assert result.covered_believed_m2 == pytest.approx(result.covered_true_m2, rel=0.01)
        assert result.covered_true_m2 > 0.98 * result.target_m2
