"""What `pdn import` is told on its command line, as values."""

from __future__ import annotations

import math
from typing import Any

import typer

from pdn import wire

DEFAULT_PARAMETERS = {"huber": 1.345, "cauchy": 2.385}
"""Of each robust loss where none is given; Cauchy's is that of camera factors."""


def robust(text: str) -> Any:
    """A loss as in the configuration, from `none`, `huber`, `huber:C`, `cauchy` or `cauchy:C`."""
    kind, colon, parameter = text.partition(":")
    if kind == "none" and not colon:
        return "none"
    if kind not in DEFAULT_PARAMETERS:
        raise typer.BadParameter(f"{text!r} is no loss: none, huber[:C] or cauchy[:C]")
    return {kind: _positive(parameter, text) if colon else DEFAULT_PARAMETERS[kind]}


def gate(text: str) -> float | None:
    """Standard deviations, or None for `off`."""
    return None if text == "off" else _positive(text, text)


def sigmas(text: str) -> tuple[float, float]:
    """Two standard deviations, `METRES,RADIANS`."""
    parts = text.split(",")
    if len(parts) != 2:
        raise typer.BadParameter(f"{text!r} is not of the form METRES,RADIANS, for instance 0.05,0.01")
    return _positive(parts[0], text), _positive(parts[1], text)


def mission_id(text: str) -> str:
    """An id that a mission can have."""
    try:
        return wire.check_id(text, "mission")
    except wire.WireError as error:
        raise typer.BadParameter(str(error), param_hint="--mission") from error


def _positive(word: str, text: str) -> float:
    try:
        number = float(word)
    except ValueError:
        number = math.nan
    if not (math.isfinite(number) and number > 0.0):
        raise typer.BadParameter(f"{text!r}: {word!r} is no number above 0")
    return number
