"""What an operator reads: bars and rasters, by hand-made cases."""

import pytest

from pdn import wire
from pdn.console.formatting import BAR_CELLS, bar, sigmas
from pdn.console.tables import raster


@pytest.mark.parametrize(
    ("value", "filled"), [(0.0, 0), (0.5, BAR_CELLS // 2), (1.0, BAR_CELLS), (9.0, BAR_CELLS)]
)
def test_a_bar_is_filled_in_proportion(value: float, filled: int) -> None:
    assert bar(value, 1.0) == "█" * filled + "░" * (BAR_CELLS - filled)


def test_a_bar_shows_its_mark() -> None:
    assert bar(0.0, 1.5, 1.0).index("│") == round(BAR_CELLS / 1.5)
    assert len(bar(2.0, 1.5, 1.0)) == BAR_CELLS


def test_sigmas_are_in_metres_and_degrees() -> None:
    covariance = [0.0] * 36
    covariance[0], covariance[14], covariance[35] = 4.0, 9.0, 1.0
    metres, degrees = sigmas(covariance)
    assert metres == [2.0, 0.0, 3.0]
    assert degrees == pytest.approx([0.0, 0.0, 57.29577951308232])


def test_a_raster_is_drawn_from_its_runs() -> None:
    # 4 x 4 cells: two rows open, two covered but for the last cell.
    facet = wire.FacetCoverage(cells_u=4, cells_v=4, covered_cells=7, runs=(8, 7, 1))
    assert raster(facet, columns=4) == ["····", "███▒"]
    assert raster(facet, columns=1) == ["▒"]


def test_a_raster_that_begins_covered() -> None:
    facet = wire.FacetCoverage(cells_u=2, cells_v=2, covered_cells=4, runs=(0, 4))
    assert raster(facet) == ["██"]
