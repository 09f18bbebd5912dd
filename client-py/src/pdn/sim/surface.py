"""The surface to photograph: planar rectangles in the world and their place on one unwrapped sheet.

The unwrapped coordinates (u, v), m, lay all facets side by side in a plane, as a hull's side and bottom are
laid out in the paper's figures. Salient regions and tracklines are given there.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pdn.sim.se3 import Array


@dataclass(frozen=True)
class Facet:
    """A planar rectangle, seen from the side to which ``u x v`` points."""

    name: str
    origin: Array
    """3, m: the corner of local coordinates (0, 0)."""
    u: Array
    """Unit direction of the first edge."""
    v: Array
    """Unit direction of the second edge, orthogonal to ``u``."""
    length_u_m: float
    length_v_m: float
    unwrapped_u_m: tuple[float, float]
    """Where the first edge begins and ends on the sheet."""
    unwrapped_v_m: tuple[float, float]
    """Where the second edge begins and ends on the sheet."""

    @cached_property
    def normal(self) -> Array:
        """``u x v``, towards the vehicle."""
        return np.cross(self.u, self.v)

    @property
    def area_m2(self) -> float:
        """Of the rectangle."""
        return self.length_u_m * self.length_v_m

    def point(self, local_u_m: float, local_v_m: float) -> Array:
        """World point of local coordinates, m."""
        return self.origin + local_u_m * self.u + local_v_m * self.v

    def local_v_m(self, unwrapped_v_m: float) -> float:
        """Local second coordinate of a line that runs at ``unwrapped_v_m`` on the sheet."""
        low, high = self.unwrapped_v_m
        return (unwrapped_v_m - low) / (high - low) * self.length_v_m


@dataclass(frozen=True)
class Projection:
    """The points of the surface nearest to some world points, one row each."""

    point: Array
    """n x 3, m, world."""
    unwrapped: Array
    """n x 2, m, on the sheet."""
    distance_m: Array
    """n."""


@dataclass(frozen=True)
class RayHits:
    """What rays from one origin meet, one row each."""

    point: Array
    """n x 3, m, world: where the ray meets the plane of the facet."""
    unwrapped: Array
    """n x 2, m, on the sheet: the nearest place inside the facet."""
    miss_m: Array
    """n: how far outside the facet the ray passes; 0 inside, infinite where it meets no facet's visible
    side."""


class Surface:
    """All facets together."""

    def __init__(self, facets: tuple[Facet, ...]) -> None:
        self.facets = facets
        self._origin = np.stack([f.origin for f in facets])
        self._axes = np.stack([np.stack([f.u, f.v, f.normal]) for f in facets])
        self._lengths = np.array([[f.length_u_m, f.length_v_m] for f in facets])
        self._sheet_origin = np.array([[f.unwrapped_u_m[0], f.unwrapped_v_m[0]] for f in facets])
        self._sheet_scale = (
            np.array(
                [
                    [
                        f.unwrapped_u_m[1] - f.unwrapped_u_m[0],
                        f.unwrapped_v_m[1] - f.unwrapped_v_m[0],
                    ]
                    for f in facets
                ]
            )
            / self._lengths
        )

    @property
    def area_m2(self) -> float:
        """Sum over the facets."""
        return sum(f.area_m2 for f in self.facets)

    def nearest(self, points: Array) -> Projection:
        """The nearest point of the surface for each world point (n x 3); ties to the first facet."""
        local = np.einsum("fij,nfj->nfi", self._axes, points[:, None, :] - self._origin[None])
        inside = np.clip(local[:, :, :2], 0.0, self._lengths[None])
        across = np.sum((local[:, :, :2] - inside) ** 2, axis=2) + local[:, :, 2] ** 2
        # A point beside an edge is as near to both facets that share it; rounding must not choose.
        best = np.argmax(across <= across.min(axis=1, keepdims=True) + 1e-12, axis=1)
        rows = np.arange(len(points))
        chosen = inside[rows, best]
        axes = self._axes[best]
        world = self._origin[best] + chosen[:, :1] * axes[:, 0] + chosen[:, 1:] * axes[:, 1]
        sheet = self._sheet_origin[best] + chosen * self._sheet_scale[best]
        return Projection(world, sheet, np.sqrt(across[rows, best]))

    def cast(self, origin: Array, rays: Array) -> RayHits:
        """What rays (n x 3, unit) from ``origin`` meet, each the facet that it misses least, then the nearest
        one."""
        local = np.einsum("fij,fj->fi", self._axes, origin[None] - self._origin)
        slope = np.einsum("fij,nj->nfi", self._axes, rays)
        height, rate = local[None, :, 2], slope[:, :, 2]
        facing = (height > 0.0) & (rate < -1e-9)
        reach = np.where(facing, height / np.where(facing, -rate, 1.0), 0.0)
        hit = local[None, :, :2] + reach[:, :, None] * slope[:, :, :2]
        inside = np.clip(hit, 0.0, self._lengths[None])
        miss = np.where(facing, np.linalg.norm(hit - inside, axis=2), np.inf)
        # A ray through an edge misses neither of its facets; rounding must not choose between them.
        least = miss <= miss.min(axis=1, keepdims=True) + 1e-9
        best = np.argmin(np.where(least & facing, reach, np.inf), axis=1)
        rows = np.arange(len(rays))
        sheet = self._sheet_origin[best] + inside[rows, best] * self._sheet_scale[best]
        return RayHits(origin[None] + reach[rows, best, None] * rays, sheet, miss[rows, best])
