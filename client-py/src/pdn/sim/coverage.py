"""True coverage: the rule of the service, with true camera poses.

Each facet has a raster of square cells from its origin. A cell is covered when its centre lies in the field
of view of a camera on the facet's visible side.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from pdn.sim.scenario import Scenario
from pdn.sim.se3 import Array, Pose


class Raster:
    """Which cells have been photographed so far."""

    def __init__(self, scenario: Scenario) -> None:
        self._facets = scenario.surface.facets
        self._cell = scenario.cell_m
        self._optics = scenario.optics
        self.covered: list[NDArray[np.bool_]] = [
            np.zeros((_cells(f.length_v_m, self._cell), _cells(f.length_u_m, self._cell)), dtype=bool)
            for f in self._facets
        ]
        """A raster for each facet, indexed [v, u]."""
        x, y = self._optics.tan_half_horizontal, self._optics.tan_half_vertical
        corners = [[0.0, 0.0, 0.0]] + [[a, b, 1.0] for a in (-x, x) for b in (-y, y)]
        self._pyramid = np.array(corners) * self._optics.max_range_m

    def add(self, camera: Pose) -> None:
        """Cover what a camera at ``world_from_camera`` sees; cost: the cells below its field of view."""
        hull = self._pyramid @ camera.rotation.T + camera.translation
        for facet, raster in zip(self._facets, self.covered, strict=True):
            axes = np.stack([facet.u, facet.v, facet.normal])
            local = (hull - facet.origin) @ axes.T
            if local[0, 2] <= 0.0 or local[:, 2].min() > 0.0:
                continue
            columns = self._window(local[:, 0], raster.shape[1])
            rows = self._window(local[:, 1], raster.shape[0])
            if len(columns) == 0 or len(rows) == 0:
                continue
            # Affine in the cell's indices: the centre in the camera frame.
            in_camera = axes[:2] @ camera.rotation
            base = (facet.origin - camera.translation) @ camera.rotation
            along = ((columns + 0.5) * self._cell)[None, :, None] * in_camera[0]
            across = ((rows + 0.5) * self._cell)[:, None, None] * in_camera[1]
            raster[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1] |= self._in_view(
                base + along + across
            )

    def covered_m2(self) -> float:
        """Sum over the facets of area times the share of cells covered."""
        return sum(f.area_m2 * float(r.mean()) for f, r in zip(self._facets, self.covered, strict=True))

    def _in_view(self, points: Array) -> NDArray[np.bool_]:
        z = points[..., 2]
        optics = self._optics
        return (
            (z > 0.0)
            & (z <= optics.max_range_m)
            & (np.abs(points[..., 0]) <= optics.tan_half_horizontal * z)
            & (np.abs(points[..., 1]) <= optics.tan_half_vertical * z)
        )

    def _window(self, extent_m: Array, cells: int) -> NDArray[np.int64]:
        low = max(0, math.floor(float(extent_m.min()) / self._cell))
        high = min(cells, math.ceil(float(extent_m.max()) / self._cell) + 1)
        return np.arange(low, max(low, high), dtype=np.int64)


def _cells(length_m: float, cell_m: float) -> int:
    """Cells along an edge; a rest shorter than a millionth of a cell is rounding."""
    return max(1, math.ceil(length_m / cell_m - 1e-6))
