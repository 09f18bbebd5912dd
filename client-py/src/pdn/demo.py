"""The command `pdn demo`: the paper's experiment from nothing but a built daemon.

It composes what the other packages offer: starts a daemon of its own, flies `hull40` by every policy, and
leaves the table, the figures, the runs and the daemon's log in a folder.
"""

from __future__ import annotations

import json
import os
import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Any

import typer

from pdn import files

ALPHAS = (1.0, 0.75, 0.5, 0.25, 0.0)

READY_WITHIN_S = 20.0
MOST_FLIGHTS = 256
"""Each flight is a vehicle of its own; a daemon takes no more."""

STOP_WITHIN_S = 15.0
"""The daemon drains within this or is killed."""

COLUMNS = {
    "policy": ("policy", 0),
    "alpha": ("alpha", 2),
    "seed": ("seed", 0),
    "revisits": ("revisits", 0),
    "path_m": ("path, m", 1),
    "max_uncertainty": ("greatest U", 3),
    "final_uncertainty": ("U at the end", 3),
    "position_rmse_m": ("position rmse, m", 3),
    "nees": ("NEES (6)", 2),
    "covered_believed_m2": ("believed covered, m2", 1),
    "covered_true_m2": ("truly covered, m2", 1),
    "decisions": ("decisions", 0),
    "wall_s": ("wall, s", 1),
}
"""Of the table: heading, and digits after the point."""

_HELP = """Fly the paper's experiment and leave its figures and numbers in a folder.

Starts a daemon on a free loopback port, flies the scenario by open loop, exhaustive revisit and PDN with
alpha 1, 0.75, 0.5, 0.25 and 0, and writes table.md, results.json, figure-5.png, figure-6.png, the runs and
the daemon's log."""


def register(app: typer.Typer) -> None:
    """Add the command."""
    app.command("demo", help=_HELP)(demo)


def demo(
    daemon: Annotated[
        Path, typer.Option(metavar="FILE", envvar="PDND_BINARY", help="The daemon's program.")
    ] = Path("target/release/pdnd"),
    out: Annotated[Path, typer.Option(metavar="FOLDER", help="Where to leave everything.")] = Path("demo"),
    scenario: Annotated[str, typer.Option(help="Name or path.")] = "hull40",
    seeds: Annotated[str, typer.Option(metavar="N,N-N,...", help="Seeds; the figures show the first.")] = "1",
    jobs: Annotated[
        int, typer.Option(min=0, metavar="N", help="Flights at a time; 0 for the number of cores.")
    ] = 0,
    as_json: Annotated[bool, typer.Option("--json", help="Print the results as JSON; no progress.")] = False,
) -> None:
    """See ``_HELP``."""
    from pdn.sim.fleet import Flight, fly_all

    if not daemon.is_file():
        raise typer.BadParameter(f"there is no daemon at {daemon}; try: make build", param_hint="--daemon")
    chosen = parse_seeds(seeds)
    flights = [
        flight
        for seed in chosen
        for flight in (
            Flight("open-loop", 1.0, seed),
            Flight("exhaustive", 1.0, seed),
            *[Flight("pdn", alpha, seed) for alpha in ALPHAS],
        )
    ]
    files.make_folder(out)
    began = time.monotonic()
    with running_daemon(daemon, out / "pdnd.log") as endpoint:
        at_a_time = jobs or os.cpu_count() or 1
        results = fly_all(flights, scenario, endpoint, out / "runs", at_a_time, visible=not as_json)
    records = [asdict(result) for result in results]
    files.write_text(out / "results.json", json.dumps(records, indent=2) + "\n")
    text = table(records)
    files.write_text(out / "table.md", text)
    shown = [out / "runs" / f"{flight.name}.json" for flight in flights if flight.seed == chosen[0]]
    drawn = _draw(shown, out)
    if as_json:
        print(json.dumps(records))
        return
    print(text)
    print(f"{len(results)} flights in {time.monotonic() - began:.0f} s; {', '.join(map(str, drawn))}")


def table(records: list[dict[str, Any]]) -> str:
    """The results as a Markdown table."""
    rows = [[heading for heading, _ in COLUMNS.values()]]
    for record in records:
        cells = {
            key: f"{record[key]:.{digits}f}" if digits else f"{record[key]}"
            for key, (_, digits) in COLUMNS.items()
        }
        if record["policy"] != "pdn":
            cells["alpha"] = "-"
        rows.append(list(cells.values()))
    widths = [max(len(row[column]) for row in rows) for column in range(len(COLUMNS))]
    lines = []
    for row in rows:
        cells_of_row = " | ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True))
        lines.append(f"| {cells_of_row} |")
    rule = "|" + "|".join("-" * (width + 1) + ":" for width in widths) + "|"
    return "\n".join([lines[0], rule, *lines[1:]]) + "\n"


def parse_seeds(text: str) -> list[int]:
    """Seeds from a list such as ``1,2`` or ``1-6``."""
    seeds: list[int] = []
    try:
        for part in text.split(","):
            first, _, last = part.partition("-")
            seeds.extend(range(int(first), int(last or first) + 1))
    except ValueError:
        seeds = []
    if not seeds:
        raise typer.BadParameter(f"{text!r} is no list of seeds such as 1,2 or 1-6", param_hint="--seeds")
    return seeds


@contextmanager
def running_daemon(program: Path, log: Path) -> Iterator[str]:
    """A daemon on a free loopback port with a state directory of its own; gives its endpoint, and ends it."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
    endpoint = f"tcp/127.0.0.1:{port}"
    with tempfile.TemporaryDirectory(prefix="pdn-demo-") as state, log.open("wb") as lines:
        command = [str(program), "--listen", endpoint, "--state-dir", state]
        command += ["--set", f"max_vehicles={MOST_FLIGHTS}"]
        process = subprocess.Popen(command, stdout=lines, stderr=lines)
        try:
            _wait_until_it_listens(process, port, log)
            yield endpoint
        finally:
            process.terminate()
            try:
                process.wait(STOP_WITHIN_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()


def _wait_until_it_listens(process: subprocess.Popen[bytes], port: int, log: Path) -> None:
    give_up = time.monotonic() + READY_WITHIN_S
    while True:
        if process.poll() is not None:
            last = log.read_text(encoding="utf-8", errors="replace").strip().split("\n")[-1:]
            raise OSError(f"the daemon ended with code {process.returncode}: {' '.join(last)}; see {log}")
        try:
            socket.create_connection(("127.0.0.1", port), timeout=1.0).close()
        except OSError as error:
            if time.monotonic() > give_up:
                raise OSError(
                    f"the daemon did not listen within {READY_WITHIN_S:.0f} s; see {log}"
                ) from error
            time.sleep(0.05)
        else:
            return


def _draw(files: list[Path], out: Path) -> list[Path]:
    from pdn.plots import figures, style
    from pdn.plots.runs import load

    runs = [load(path) for path in files]
    drawn = []
    for name in ("5", "6"):
        path = out / f"figure-{name}.png"
        style.save(figures.draw(name, runs), path)
        drawn.append(path)
    return drawn
