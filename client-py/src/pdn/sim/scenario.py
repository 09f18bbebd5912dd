"""Scenarios: what is inspected, by what vehicle, with what noise; one TOML file each.

``[config]`` of a scenario is a mission's configuration in the contract's own names and units; the sensors'
noise is read from there, so that what is drawn, what is sent with each factor and what the planner expects
are one thing.
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any, Literal

import numpy as np

from pdn.sim.se3 import Array
from pdn.sim.surface import Facet, Surface

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
    """A decision is asked at each keyframe of the survey whose number is a multiple of this."""
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


def packaged() -> list[str]:
    """Names of the scenarios that come with the package."""
    folder = resources.files("pdn.sim") / "scenarios"
    return sorted(
        entry.name.removesuffix(".toml") for entry in folder.iterdir() if entry.name.endswith(".toml")
    )


def load(name_or_path: str) -> Scenario:
    """A packaged scenario by its name, or one's own by its path (anything with a slash or ending in
    .toml)."""
    if "/" in name_or_path or name_or_path.endswith(".toml"):
        path = Path(name_or_path)
        if not path.is_file():
            raise ScenarioError(f"there is no scenario file {path}")
        text = path.read_text(encoding="utf-8")
    elif name_or_path in packaged():
        text = (resources.files("pdn.sim") / "scenarios" / f"{name_or_path}.toml").read_text(encoding="utf-8")
    else:
        known = ", ".join(packaged())
        raise ScenarioError(f"there is no scenario {name_or_path!r}; known are {known}; or name a .toml file")
    try:
        return parse(tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(f"scenario {name_or_path} is not TOML: {error}") from error


def parse(table: Table) -> Scenario:
    """A scenario from its table; refuses one with a missing or mistyped field by the field's name."""
    try:
        return _parse(table)
    except KeyError as error:
        raise ScenarioError(f"the scenario lacks the field {error.args[0]}") from error
    except (TypeError, ValueError) as error:
        raise ScenarioError(f"the scenario cannot be read: {error}") from error


def _parse(table: Table) -> Scenario:
    config: Table = dict(table["config"])
    facets = tuple(_facet(entry) for entry in table["facets"])
    links = _links(table["registration"], config["planner"])
    rates = links.table().ravel()
    weight = links.prior_weight
    config["link_model"] = {
        "bins": links.bins,
        "prior": [[weight * float(p), weight * (1.0 - float(p))] for p in rates],
    }
    config["target"] = {"facets": [_facet_table(f) for f in facets], "area_m2": table.get("target_area_m2")}
    camera = config["camera"]
    saliency = table["saliency"]
    survey = SurveyPlan(**table["survey"])
    if survey.heading not in ("across", "along"):
        raise ScenarioError(f"survey.heading is {survey.heading!r}; known are 'across' and 'along'")
    return Scenario(
        name=table["name"],
        description=table["description"],
        surface=Surface(facets),
        background=(saliency["local"], saliency["global"]),
        regions=tuple(
            Ellipse(tuple(r["centre_m"]), tuple(r["half_axes_m"]), r["local"], r["global"])
            for r in saliency.get("regions", [])
        ),
        survey=survey,
        noise=_noise(config),
        optics=Optics(
            math.tan(math.radians(camera["horizontal_fov_deg"]) / 2.0),
            math.tan(math.radians(camera["vertical_fov_deg"]) / 2.0),
            camera["max_range_m"],
        ),
        links=links,
        cell_m=config["cell_m"],
        config=config,
    )


def _facet(table: Table) -> Facet:
    u, v = np.asarray(table["u"], dtype=float), np.asarray(table["v"], dtype=float)
    facet = Facet(
        table["name"],
        np.asarray(table["origin"], dtype=float),
        u,
        v,
        float(table["length_u_m"]),
        float(table["length_v_m"]),
        (table["unwrapped_u_m"][0], table["unwrapped_u_m"][1]),
        (table["unwrapped_v_m"][0], table["unwrapped_v_m"][1]),
    )
    unit = max(abs(float(u @ u) - 1.0), abs(float(v @ v) - 1.0), abs(float(u @ v)))
    if unit > 1e-6:
        raise ScenarioError(
            f"facet {facet.name}: u and v must be orthogonal unit vectors; they are off by {unit:.1e}"
        )
    return facet


def _facet_table(facet: Facet) -> Table:
    return {
        "origin": facet.origin.tolist(),
        "u": facet.u.tolist(),
        "v": facet.v.tolist(),
        "length_u_m": facet.length_u_m,
        "length_v_m": facet.length_v_m,
    }


def _links(table: Table, planner: Table) -> Links:
    return Links(
        min_baseline_m=planner["min_baseline_m"],
        max_baseline_m=planner["max_baseline_m"],
        max_view_angle_rad=math.radians(planner["max_view_angle_deg"]),
        max_links=planner["max_links"],
        **table,
    )


def _noise(config: Table) -> Noise:
    odometry, attitude, camera = config["odometry"], config["attitude"], config["camera"]
    first = config["first_keyframe_sigmas"]

    def radians(degrees: float | None) -> float | None:
        return None if degrees is None else math.radians(degrees)

    return Noise(
        odometry=np.concatenate(
            [
                np.asarray(odometry["translation_sigma_m_per_sqrt_m"], dtype=float),
                np.radians(odometry["rotation_sigma_deg_per_sqrt_m"]),
            ]
        ),
        tilt_rad=radians(attitude.get("tilt_sigma_deg")),
        heading_rad=radians(attitude.get("heading_sigma_deg")),
        depth_m=config["depth"].get("sigma_m"),
        direction_rad=math.radians(camera["direction_sigma_deg"]),
        rotation_rad=math.radians(camera["rotation_sigma_deg"]),
        first_keyframe=np.concatenate(
            [np.asarray(first["translation_m"], dtype=float), np.radians(first["rotation_deg"])]
        ),
    )
