"""Panels that figures are made of."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Ellipse, Rectangle

from pdn.plots.runs import Run
from pdn.plots.style import BLACK, BLUE, GREY, VERMILLION


def trajectory(axes: Axes, run: Run, *, node_size: float = 5.0) -> None:
    """The final estimate of the keyframes over the unwrapped surface: by saliency, revisits in black."""
    for facet in run.sheet["facets"]:
        (u0, u1), (v0, v1) = facet["u_m"], facet["v_m"]
        axes.add_patch(
            Rectangle((u0, v0), u1 - u0, v1 - v0, facecolor="none", edgecolor=GREY, linewidth=1.0, zorder=1)
        )
    for region in run.sheet["regions"]:
        a, b = region["half_axes_m"]
        axes.add_patch(
            Ellipse(
                region["centre_m"],
                2 * a,
                2 * b,
                facecolor="#FBE3D6",
                edgecolor=VERMILLION,
                linewidth=0.9,
                linestyle=(0, (4, 2)),
                zorder=0.5,
            )
        )
    survey = ~run.revisit
    for chosen, colour, size, layer in (
        (survey & ~run.salient, BLUE, node_size, 2),
        (survey & run.salient, VERMILLION, node_size, 3),
        (run.revisit, BLACK, 1.8 * node_size, 4),
    ):
        axes.scatter(
            run.estimated[chosen, 0], run.estimated[chosen, 1], s=size, c=colour, linewidths=0, zorder=layer
        )
    facets = run.sheet["facets"]
    low = np.min([[f["u_m"][0], f["v_m"][0]] for f in facets], axis=0)
    high = np.max([[f["u_m"][1], f["v_m"][1]] for f in facets], axis=0)
    margin = 0.02 * float((high - low).max())
    axes.set_xlim(low[0] - margin, high[0] + margin)
    axes.set_ylim(high[1] + margin, low[1] - margin)
    axes.set_aspect("equal")
    axes.grid(visible=False)
    axes.set_xlabel("along u, m")
    axes.set_ylabel("across v, m")


def trajectory_legend() -> list[Line2D]:
    """What the colours of a trajectory mean."""

    def dot(colour: str, label: str, size: float) -> Line2D:
        return Line2D([], [], marker="o", linestyle="none", color=colour, markersize=size, label=label)

    return [
        dot(BLUE, "keyframe on the survey, not salient", 6),
        dot(VERMILLION, "keyframe on the survey, salient", 6),
        dot(BLACK, "keyframe on a revisit", 7),
    ]


def uncertainty(axes: Axes, runs: Sequence[tuple[Run, dict[str, Any]]]) -> None:
    """The robot's uncertainty over the path, with the allowance and the instants of revisiting."""
    for run, line in runs:
        axes.plot(run.path_m, run.uncertainty, **{"linewidth": 2.0, **line}, label=run.label)
    for run, _ in runs:
        axes.plot(
            run.path_m[run.starts],
            run.uncertainty[run.starts],
            linestyle="none",
            marker="o",
            markersize=6.5,
            color=BLACK,
            markeredgecolor="white",
            markeredgewidth=0.8,
            zorder=5,
        )
    axes.axhline(1.0, color=BLACK, linewidth=1.2, linestyle=(0, (5, 3)), zorder=1)
    axes.annotate(
        "allowance",
        xy=(0.0, 1.0),
        xycoords=("axes fraction", "data"),
        xytext=(8, 5),
        textcoords="offset points",
        fontsize=11.5,
    )
    axes.set_xlabel("path length, m")
    axes.set_ylabel("uncertainty ratio  (|Σ| / |Σ$_{allow}$|)$^{1/6}$")
    axes.set_xlim(0.0, None)
    axes.set_ylim(0.0, None)


def remaining(axes: Axes, runs: Sequence[tuple[Run, dict[str, Any]]]) -> None:
    """The share of the target not yet covered, over the path."""
    for run, line in runs:
        axes.plot(run.path_m, run.remaining, **{"linewidth": 2.0, **line}, label=run.label)
    axes.set_xlabel("path length, m")
    axes.set_ylabel("area left / target area")
    axes.set_xlim(0.0, None)
    axes.set_ylim(0.0, 1.02)
