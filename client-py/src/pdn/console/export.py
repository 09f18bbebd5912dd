"""`pdn export`: a mission's journal in the formats of other tools."""

from __future__ import annotations

import json
from contextlib import nullcontext
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from .export_csv import write_csv
from .export_g2o import write_g2o
from .export_mcap import write_mcap
from .failures import CommandFailed
from .journal_file import read_journal


def register(app: typer.Typer) -> None:
    """Adds `export`."""
    app.command("export")(export)


def export(
    journal: Annotated[
        Path, typer.Argument(help="The journal: <state-dir>/<vehicle>/<number>-<mission>.redb.")
    ],
    mcap: Annotated[
        Path | None,
        typer.Option(
            "--mcap", metavar="FILE", help="Decisions, poses, coverage and candidates, for Foxglove."
        ),
    ] = None,
    csv: Annotated[
        Path | None, typer.Option("--csv", metavar="FOLDER", help="Tables, units in their headers.")
    ] = None,
    g2o: Annotated[
        Path | None,
        typer.Option(
            "--g2o", metavar="FILE", help="The pose graph: estimates, odometry and relative factors."
        ),
    ] = None,
    pdnd: Annotated[
        Path,
        typer.Option(
            "--pdnd", metavar="PROGRAM", envvar="PDND_BINARY", help="The daemon's program, which reads it."
        ),
    ] = Path("target/release/pdnd"),
    as_json: Annotated[bool, typer.Option("--json", help="Tell what was written as JSON.")] = False,
) -> None:
    """Export a mission's journal as MCAP, as CSV tables or as a g2o pose graph.

    The journal is only read; while a daemon has it open, stop the daemon or export a copy. Poses are the
    estimates that the journal ends with.
    """
    if mcap is None and csv is None and g2o is None:
        raise CommandFailed("nothing to write: give --mcap, --csv or --g2o")
    with Console(stderr=True).status("reading the journal") if not as_json else nullcontext():
        read = read_journal(journal, pdnd)
        told: dict[str, Any] = {"journal": str(journal), "records": len(read.records)}
        if csv is not None:
            told["csv"] = [str(path) for path in write_csv(read, csv)]
        if g2o is not None:
            vertices, edges = write_g2o(read, g2o)
            told["g2o"] = {"file": str(g2o), "vertices": vertices, "edges": edges}
        if mcap is not None:
            told["mcap"] = {"file": str(mcap), "messages": write_mcap(read, mcap)}
    print(json.dumps(told) if as_json else _sentences(told))


def _sentences(told: dict[str, Any]) -> str:
    lines = [f"{told['records']} records of {told['journal']}"]
    if "csv" in told:
        lines.append(f"tables: {', '.join(told['csv'])}")
    if "g2o" in told:
        g2o = told["g2o"]
        lines.append(f"pose graph: {g2o['file']}, {g2o['vertices']} vertices, {g2o['edges']} edges")
    if "mcap" in told:
        messages = ", ".join(f"{count} on {topic}" for topic, count in told["mcap"]["messages"].items())
        lines.append(f"MCAP: {told['mcap']['file']}, {messages}")
    return "\n".join(lines)
