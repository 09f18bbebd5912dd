"""Reading scenarios: the packaged ones by name, one's own by path."""

from __future__ import annotations

import math
import tomllib
from importlib import resources
from pathlib import Path

import numpy as np

from pdn.sim.scenario import (
    Ellipse,
    Links,
    Noise,
    Optics,
    Scenario,
    ScenarioError,
    SurveyPlan,
    Table,
)
from pdn.sim.surface import Facet, Surface


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
