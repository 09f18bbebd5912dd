"""Planar rectangles for one side of R/V Gunnerus below her design waterline, from her published offset table.

The scenario `gunnerus` carries the numbers that this prints; it is kept so that anybody can see where they
come from::

    python client-py/tools/gunnerus_facets.py ../shared/data/hull_gunnerus/gunnerus.json

Method: the offset table (half-breadths over waterlines and stations, null counted as the centre plane) is cut
at the draught and triangulated. Triangles are sorted into patches: by 6 lengths of the ship, and within each
by whether they face sideways or down; the centre plane aft, which the skeg fills, is a row of its own. Each
patch becomes the rectangle in its area-weighted best plane that has its area, its centroid and the proportion
of its second moments. What is lost is the curvature inside a patch: the distance of the hull from the
rectangles' planes is printed.

World: north-east-down with the origin at the fore end of the waterline, the ship heading north; her starboard
side, which faces east. Rectangles run aft (u) and down or inwards (v).
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

PUBLISHED_WETTED_M2 = 200.98
COLUMNS = 6
ROWS = {"side": (0.0, 2.4), "bottom": (2.4, 7.2), "skeg": (7.2, 7.8)}
"""Where each row of patches lies on the sheet: about its girth amidships."""
SKEG_ENDS_M = 19.0
"""From the stern; forward of it the centre plane is the stem's."""

SMALL_M2 = 3.0
"""A patch of less joins the other one of its length of the ship."""


def triangles(path: Path) -> Array:
    """n x 3 x 3, m, world."""
    hull = json.loads(path.read_text(encoding="utf-8"))
    draught = hull["designState"]["calculationParameters"]["Draft_design"]
    size, offsets = hull["structure"]["hull"]["attributes"], hull["structure"]["hull"]["halfBreadths"]
    heights = np.array(offsets["waterlines"]) * size["Depth"]
    stations = np.array(offsets["stations"]) * size["LOA"]
    half = np.array([[v or 0.0 for v in row] for row in offsets["table"]]) * size["BOA"] / 2.0
    above = int(np.searchsorted(heights, draught))
    share = (draught - heights[above - 1]) / (heights[above] - heights[above - 1])
    waterline = half[above - 1] * (1.0 - share) + half[above] * share
    half = np.vstack([half[:above], waterline])
    heights = np.append(heights[:above], draught)
    points = np.stack(
        [
            np.broadcast_to(stations - size["LOA"], half.shape),
            half,
            np.broadcast_to((draught - heights)[:, None], half.shape),
        ],
        axis=-1,
    )
    a, b, c, d = points[:-1, :-1], points[:-1, 1:], points[1:, :-1], points[1:, 1:]
    both = np.concatenate([np.stack([a, b, c], axis=2), np.stack([d, c, b], axis=2)])
    return np.asarray(both.reshape(-1, 3, 3))


def rectangle(patch: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Origin, u, v, both lengths, and the distance of each triangle's centre from the plane, of one patch."""
    area, normal = _areas(patch)
    centres = patch.mean(axis=1)
    middle = np.average(centres, axis=0, weights=area)
    # Second moments of triangles about the patch's centroid: corners' middles weigh exactly.
    mids = 0.5 * (patch + np.roll(patch, 1, axis=1))
    spread = np.einsum("t,tki,tkj->ij", area / 3.0, mids - middle, mids - middle) / area.sum()
    facing = np.average(normal, axis=0, weights=area)
    plane = np.linalg.eigh(spread)[1][:, 0]
    plane *= np.sign(plane @ facing)
    u = np.array([-1.0, 0.0, 0.0]) - plane * (plane @ np.array([-1.0, 0.0, 0.0]))
    u /= np.linalg.norm(u)
    v = np.cross(plane, u)
    lengths = np.sqrt(12.0 * np.array([u @ spread @ u, v @ spread @ v]))
    lengths *= np.sqrt(area.sum() / lengths.prod())
    origin = middle - 0.5 * lengths[0] * u - 0.5 * lengths[1] * v
    return origin, u, v, lengths, np.abs((centres - middle) @ plane)


def main() -> None:
    """Print the facets as TOML and the check on the area."""
    mesh = triangles(Path(sys.argv[1]))
    area, normal = _areas(mesh)
    mesh, normal, area = mesh[area > 0.0], normal[area > 0.0], area[area > 0.0]
    centres = mesh.mean(axis=1)
    length = -mesh[:, :, 0].min()
    from_bow = -centres[:, 0]
    column = np.minimum((from_bow / length * COLUMNS).astype(int), COLUMNS - 1)
    centre_plane = (mesh[:, :, 1] == 0.0).all(axis=1)
    skeg = centre_plane & (from_bow > length - SKEG_ENDS_M)
    # The steep flanks that run into the skeg belong to the bottom as the vehicle sees it.
    side = ~skeg & (np.abs(normal[:, 1]) >= np.abs(normal[:, 2])) & ((centres[:, 2] < 1.0) | (column < 4))
    row = np.where(skeg, 2, np.where(side, 0, 1))
    for k in range(COLUMNS):
        for small, large in ((0, 1), (1, 0)):
            patch = (row == small) & (column == k)
            if area[patch].sum() < SMALL_M2:
                row[patch] = large
    total, away = 0.0, []
    for index, (name, (low, high)) in enumerate(ROWS.items()):
        for k in range(COLUMNS):
            chosen = (row == index) & (column == k)
            if not chosen.any():
                continue
            origin, u, v, lengths, distance = rectangle(mesh[chosen])
            total += float(lengths.prod())
            away.append(np.stack([distance, area[chosen]]))
            print("[[facets]]")
            print(f'name = "{name} {k + 1}"')
            for key, value in (("origin", origin), ("u", u), ("v", v)):
                print(f"{key} = [{', '.join(f'{x:.9f}' for x in value)}]")
            print(f"length_u_m = {lengths[0]:.4f}\nlength_v_m = {lengths[1]:.4f}")
            edges = [round(float(length) / COLUMNS * edge, 2) for edge in (k, k + 1)]
            print(f"unwrapped_u_m = {edges}\nunwrapped_v_m = [{low}, {high}]\n")
    distance, weight = np.concatenate(away, axis=1)
    rms = np.sqrt(np.average(distance**2, weights=weight))
    print(f"# surface {area.sum():.2f} m2, rectangles {total:.2f} m2, published {PUBLISHED_WETTED_M2} m2")
    print(f"# rectangles differ from the published area by {100 * (total / PUBLISHED_WETTED_M2 - 1):.2f} %")
    print(f"# hull from rectangles' planes: rms {rms:.3f} m, greatest {distance.max():.3f} m")


def _areas(mesh: Array) -> tuple[Array, Array]:
    """Area and unit normal, outwards (to starboard, or down), of each triangle."""
    cross = np.cross(mesh[:, 1] - mesh[:, 0], mesh[:, 2] - mesh[:, 0])
    norm = np.linalg.norm(cross, axis=1)
    normal = cross / np.maximum(norm, 1e-300)[:, None]
    outward = normal[:, 1] + 1e-3 * normal[:, 2]
    return 0.5 * norm, normal * np.where(outward < 0.0, -1.0, 1.0)[:, None]


if __name__ == "__main__":
    main()
