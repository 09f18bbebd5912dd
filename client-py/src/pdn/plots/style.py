"""Colours and type that all figures share: large enough for a talk, told apart by any eye."""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from pdn import files

# Okabe and Ito's palette: distinct for every common kind of colour vision.
GREEN, BLUE, VERMILLION, SKY, ORANGE, BLACK, GREY = (
    "#009E73",
    "#0072B2",
    "#D55E00",
    "#56B4E9",
    "#E69F00",
    "#000000",
    "#8C8C8C",
)

POLICY_COLOUR = {"open-loop": GREEN, "exhaustive": BLUE, "pdn": VERMILLION}

ALPHA_COLOUR = {1.0: "#440154", 0.75: "#3B528B", 0.5: "#21918C", 0.25: "#5EC962", 0.0: ORANGE}
"""Dark to light as the weight falls; its end, which is open loop, in another hue."""

ALPHA_DASH: dict[float, Any] = {
    1.0: "-",
    0.75: (0, (6, 1.5)),
    0.5: (0, (3, 1.5)),
    0.25: (0, (1, 1)),
    0.0: "-",
}

_TYPE: Any = {
    "font.family": "DejaVu Sans",
    "font.size": 13,
    "axes.titlesize": 14,
    "axes.labelsize": 13,
    "legend.fontsize": 11.5,
    "xtick.labelsize": 11.5,
    "ytick.labelsize": 11.5,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#E3E3E3",
    "grid.linewidth": 0.8,
    "axes.axisbelow": True,
    "legend.frameon": False,
    "figure.constrained_layout.h_pad": 0.07,
    "figure.constrained_layout.w_pad": 0.07,
    "savefig.facecolor": "white",
}


def new_figure(width_in: float, height_in: float) -> Figure:
    """An empty figure, off screen."""
    figure = Figure(figsize=(width_in, height_in), layout="constrained")
    FigureCanvasAgg(figure)
    return figure


def styled() -> AbstractContextManager[None]:
    """The shared type and colours, for as long as a figure is drawn."""
    return mpl.rc_context(_TYPE)


def colour_of_alpha(alpha: float) -> str:
    """The colour of a weight, that of the nearest one in the table."""
    return ALPHA_COLOUR[min(ALPHA_COLOUR, key=lambda known: abs(known - alpha))]


def titled(axes: Axes, letter: str, title: str) -> None:
    """A panel's letter and title."""
    axes.set_title(f"({letter}) {title}", loc="left", fontweight="bold")


def save(figure: Figure, path: Path) -> None:
    """Write a PNG of 160 dots an inch: 2133 pixels wide at 13.3 inches."""
    files.make_folder(path.parent)
    path = path if path.suffix else path.with_name(f"{path.name}.png")
    with styled(), files.replacing(path, "wb") as file:
        figure.savefig(file, dpi=160, format=path.suffix[1:])
