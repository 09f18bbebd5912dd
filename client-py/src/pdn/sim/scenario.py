"""Scenarios: what is inspected, by what vehicle, with what noise; one TOML file each.

``[config]`` of a scenario is a mission's configuration in the contract's own names and units; the sensors'
noise is read from there, so that what is drawn, what is sent with each factor and what the planner expects
are one thing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from pdn.sim.se3 import Array
from pdn.sim.surface import Surface

Table = dict[str, Any]


class ScenarioError(ValueError):
    """A scenario that cannot be found, read or flown; the message says which field and why."""


@dataclass(frozen=True)
class Ellipse:
    """A salient region of the sheet."""

    centre_m: tuple[float, float]
    half_axes_m: tuple[float, float]
    local: float
    """S_L inside."""
    global_: float
    """S_G inside."""

    def contains(self, u_m: float, v_m: float) -> bool:
        """Whether a place on the sheet lies inside."""
        a = (u_m - self.centre_m[0]) / self.half_axes_m[0]
        b = (v_m - self.centre_m[1]) / self.half_axes_m[1]
        return a * a + b * b <= 1.0


@dataclass(frozen=True)
class SurveyPlan:
    """The nominal survey: parallel tracklines over the sheet, there and back."""

    standoff_m: float
    first_line_m: float
    line_spacing_m: float
    lines: int
    keyframe_spacing_m: float
    """Along the tracklines and on detours."""
    turn_spacing_m: float
    """On the way from one trackline to the next."""
    decision_every: int
    """A decision is asked at each so many keyframes of a trackline."""
    heading: Literal["across", "along"]
    """``across``: the body faces the surface and strafes along the tracklines; ``along``: it faces its
    way."""


@dataclass(frozen=True)
class Noise:
    """Standard deviations of the sensors."""

    odometry: Array
    """6, per square root of metre, [m; rad], body axes."""
    tilt_rad: float | None
    heading_rad: float | None
    depth_m: float | None
    direction_rad: float
    rotation_rad: float
    first_keyframe: Array
    """6, [m; rad], body axes."""


@dataclass(frozen=True)
class Optics:
    """The camera."""

    tan_half_horizontal: float
    tan_half_vertical: float
    max_range_m: float


@dataclass(frozen=True)
class Links:
    """Registrations: what is tried, and how often it succeeds in truth."""

    min_baseline_m: float
    max_baseline_m: float
    max_view_angle_rad: float
    max_links: int
    salient_from: float
    rate_both: float
    rate_one: float
    rate_none: float
    min_overlap: float
    """Share of the older image's footprint that the newer one must see for any success."""
    bins: int
    prior_weight: float

    def rate(self, first: float, second: float) -> float:
        """True probability that two images of these local saliencies register, given that they overlap."""
        salient = int(first >= self.salient_from) + int(second >= self.salient_from)
        return (self.rate_none, self.rate_one, self.rate_both)[salient]

    def table(self) -> Array:
        """P_L as the mission starts with it: bins x bins, by the true rate at the bins' centres."""
        centres = (np.arange(self.bins) + 0.5) / self.bins
        return np.array([[self.rate(a, b) for b in centres] for a in centres])


@dataclass(frozen=True)
class Scenario:
    """Everything that is known before a mission begins."""

    name: str
    description: str
    surface: Surface
    background: tuple[float, float]
    """S_L and S_G outside every region."""
    regions: tuple[Ellipse, ...]
    survey: SurveyPlan
    noise: Noise
    optics: Optics
    links: Links
    cell_m: float
    config: Table
    """The mission's configuration but ``mission``, ``survey`` and ``alpha``; ``target`` and ``link_model``
    filled in."""

    def saliency_at(self, u_m: float, v_m: float) -> tuple[float, float]:
        """S_L and S_G of a place on the sheet; the first region that contains it counts."""
        for region in self.regions:
            if region.contains(u_m, v_m):
                return region.local, region.global_
        return self.background
