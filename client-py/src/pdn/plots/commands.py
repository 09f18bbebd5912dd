"""The command ``pdn plot``: figures from run files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

FIGURES = ("5", "6", "mission")


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("plot", help=_HELP)(plot)


_HELP = """Draw a figure from the run files of `pdn sim --out`.

Figure 5 compares open loop, exhaustive revisit and PDN with alpha 1; figure 6 PDN with alpha 1, 0.75, 0.5 and
0.25 (and 0 if given), both after Kim and Eustice (2012); mission shows one run by itself."""


def plot(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN...", help="Run files.", show_default=False)],
    figure: Annotated[str, typer.Option(help="5, 6 or mission.")] = "mission",
    out: Annotated[
        Path | None, typer.Option(metavar="FILE", help="PNG to write; figure-NAME.png if not given.")
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="Print what was drawn as JSON.")] = False,
) -> None:
    """See ``_HELP``."""
    from pdn.plots import figures, style
    from pdn.plots.runs import RunError, load

    if figure not in FIGURES:
        raise typer.BadParameter(f"{figure!r} is none of {', '.join(FIGURES)}", param_hint="--figure")
    try:
        drawn = figures.draw(figure, [load(path) for path in runs])
    except RunError as error:
        raise typer.BadParameter(str(error), param_hint="RUN") from error
    path = out or Path(f"figure-{figure}.png")
    style.save(drawn, path)
    print(
        json.dumps({"figure": figure, "file": str(path), "runs": [str(run) for run in runs]})
        if as_json
        else path
    )
