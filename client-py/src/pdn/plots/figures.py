"""The figures: the paper's 5 and 6, and one mission by itself."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.transforms import ScaledTranslation

from pdn.plots import panels
from pdn.plots.runs import Run, pick
from pdn.plots.style import (
    ALPHA_DASH,
    BLACK,
    GREY,
    POLICY_COLOUR,
    SKY,
    colour_of_alpha,
    new_figure,
    styled,
    titled,
)

FIGURE_6_ALPHAS = (1.0, 0.75, 0.5, 0.25)


def figure_5(runs: list[Run]) -> Figure:
    """Open loop, exhaustive revisit and PDN with alpha 1: where they went, how sure they were, what was left.

    After [PDN12, fig. 5].
    """
    chosen = [pick(runs, "open-loop"), pick(runs, "exhaustive"), pick(runs, "pdn", 1.0)]
    figure = new_figure(13.33, 8.6)
    halves: Any = figure.subfigures(2, 1, height_ratios=[1.0, 1.0])
    top, bottom = halves
    axes = top.subplots(1, 3, sharey=True)
    for ax, run, letter in zip(axes, chosen, "abc", strict=True):
        panels.trajectory(ax, run)
        titled(ax, letter, f"{run.label}: {_revisits(run)}")
    for ax in axes[1:]:
        ax.set_ylabel("")
    top.legend(handles=panels.trajectory_legend(), loc="outside lower center", ncols=3)
    left, right = bottom.subplots(1, 2)
    lines: list[tuple[Run, dict[str, Any]]] = [(run, {"color": POLICY_COLOUR[run.policy]}) for run in chosen]
    panels.uncertainty(left, lines)
    titled(left, "d", "uncertainty of the robot")
    handles, _ = left.get_legend_handles_labels()
    left.legend(handles=[*handles, _revisit_mark()], loc="upper left", ncols=2)
    left.set_ylim(0.0, 1.32 * max(float(run.uncertainty.max()) for run in chosen))
    panels.remaining(right, lines)
    titled(right, "e", "area still to cover")
    right.legend(loc="upper right")
    return figure


def figure_6(runs: list[Run]) -> Figure:
    """What the weight alpha does. After [PDN12, fig. 6]."""
    chosen = [pick(runs, "pdn", alpha) for alpha in FIGURE_6_ALPHAS]
    shown = [*chosen, *[run for run in runs if run.policy == "pdn" and run.alpha == 0.0][:1]]
    figure = new_figure(13.33, 8.6)
    halves: Any = figure.subfigures(2, 1, height_ratios=[1.0, 0.78])
    top, bottom = halves
    left, right = top.subplots(1, 2)
    lines: list[tuple[Run, dict[str, Any]]] = [
        (run, {"color": colour_of_alpha(run.alpha), "linestyle": ALPHA_DASH.get(run.alpha, "-")})
        for run in shown
    ]
    panels.uncertainty(left, lines)
    titled(left, "a", "uncertainty of the robot")
    handles, _ = left.get_legend_handles_labels()
    left.legend(handles=[*handles, _revisit_mark()], loc="upper left", ncols=3, columnspacing=1.2)
    left.set_ylim(0.0, 1.42 * max(float(run.uncertainty.max()) for run in shown))
    panels.remaining(right, lines)
    titled(right, "b", "area still to cover")
    right.legend(loc="upper right")
    axes = bottom.subplots(1, 4, sharey=True)
    for ax, run, letter in zip(axes, chosen, "cdef", strict=True):
        panels.trajectory(ax, run, node_size=3.0)
        titled(ax, letter, f"\N{GREEK SMALL LETTER ALPHA} = {run.alpha:g}: {_revisits(run)}")
    for ax in axes[1:]:
        ax.set_ylabel("")
    bottom.legend(handles=panels.trajectory_legend(), loc="outside lower center", ncols=3)
    return figure


def mission(run: Run) -> Figure:
    """One flight: its way, its uncertainty, what is covered, and whether the covariance was true."""
    figure = new_figure(13.33, 8.6)
    axes = figure.subplot_mosaic([["way", "sure"], ["left", "nees"]], width_ratios=[1.0, 1.0])
    ax = axes["way"]
    panels.trajectory(ax, run)
    titled(ax, "a", f"{run.label}: {_revisits(run)}, {run.path_m[-1]:.0f} m")
    ax.legend(
        handles=panels.trajectory_legend(),
        loc="upper center",
        bbox_to_anchor=(0.5, 0.0),
        bbox_transform=ax.transAxes + ScaledTranslation(0.0, -_BELOW_LABEL_IN, figure.dpi_scale_trans),
        fontsize=10.5,
    )
    line: list[tuple[Run, dict[str, Any]]] = [(run, {"color": POLICY_COLOUR[run.policy]})]
    panels.uncertainty(axes["sure"], line)
    axes["sure"].set_ylim(0.0, max(1.15, 1.1 * float(run.uncertainty.max())))
    titled(axes["sure"], "b", "uncertainty of the robot")
    ax = axes["left"]
    ax.plot(run.path_m, run.remaining, color=POLICY_COLOUR[run.policy], linewidth=2.0, label="as believed")
    ax.plot(
        run.path_m, run.remaining_true, color=BLACK, linewidth=1.5, linestyle=(0, (3, 2)), label="in truth"
    )
    ax.set(xlabel="path length, m", ylabel="area left / target area", xlim=(0, None), ylim=(0, 1.02))
    ax.legend(loc="upper right")
    titled(ax, "c", "area still to cover")
    ax = axes["nees"]
    ax.axhspan(*_CHI2_6_95, color=SKY, alpha=0.25, linewidth=0, label="95 % if the covariance is true")
    ax.plot(run.path_m, run.nees, color=GREY, linewidth=1.0, label="each keyframe, at its time")
    ax.plot(run.path_m, np.full(len(run.path_m), 6.0), color=BLACK, linewidth=1.0, linestyle=(0, (5, 3)))
    ax.set(xlabel="path length, m", ylabel="NEES, 6 degrees of freedom", xlim=(0, None))
    ax.set_ylim(0.0, max(26.0, 1.25 * float(run.nees.max())))
    ax.legend(loc="upper right")
    titled(ax, "d", "error against its own covariance")
    return figure


_CHI2_6_95 = (1.2373, 14.4494)
"""2.5 % and 97.5 % quantiles of chi-squared with 6 degrees of freedom."""


_BELOW_LABEL_IN = 0.6
"""From the lower edge of axes to below their label, however flat the axes are."""


def _revisits(run: Run) -> str:
    count = len(run.starts)
    return "1 revisit" if count == 1 else f"{count} revisits"


def _revisit_mark() -> Line2D:
    return Line2D([], [], marker="o", linestyle="none", color=BLACK, markersize=6.5, label="revisit begins")


def draw(name: str, runs: Sequence[Run]) -> Figure:
    """The figure of that name: ``5``, ``6`` or ``mission`` (of the first run)."""
    with styled():
        if name == "5":
            return figure_5(list(runs))
        if name == "6":
            return figure_6(list(runs))
        return mission(runs[0])
