"""`make bench`: ours and the peers on the same input in the same run; prints tables, writes them and JSON.

Every measurement is a process of its own; nothing runs beside it that this command started.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from grid import GRIDS, Grid
from gtsam_stream import SETTINGS
from machine import machine
from tables import markdown

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
PEERS = [sys.executable, str(HERE / "peers.py")]
BOUND_S = 3600.0
BEGIN, END = "<!-- tables: begin -->\n", "<!-- tables: end -->\n"

Found = dict[str, Any]


class Bench:
    """A run over a grid."""

    def __init__(self, grid: Grid, binary: Path, daemon: Path, folder: Path) -> None:
        self.grid, self.ours, self.folder = grid, [str(binary)], folder
        self.daemon = [sys.executable, str(HERE / "daemon.py"), "--binary", str(daemon)]

    def surveys(self) -> Iterator[Found]:
        for keyframes in self.grid.keyframes:
            for percent in self.grid.salient_percent:
                yield self.survey(keyframes, percent)
        for keyframes in self.grid.alone:
            yield self.alone(keyframes)

    def survey(self, keyframes: int, percent: int) -> Found:
        grid, which = self.grid, survey_options(keyframes, percent)
        written, printed = self.folder / "input", self.folder / "ours.json"
        counts = ",".join(map(str, grid.candidates))
        runs = ["--runs", str(grid.runs)]
        title = f"{keyframes} keyframes, {percent} % salient"
        try:
            options = ["--candidates", counts, "--repeats", str(grid.repeats), "--write", str(written)]
            ours = self.json(f"{title}: ours", [*self.ours, "run", *which, *options])
            printed.write_text(json.dumps(ours))
            evaluate = [*PEERS, "evaluate", str(written), "--candidates", counts, *runs]
            exact = [*PEERS, "exact", str(written), "--ours", str(printed), "--runs", str(grid.exact_runs)]
            found: Found = {
                "keyframes": keyframes,
                "salient_percent": percent,
                "ours": {name: value for name, value in ours.items() if name != "terminals"},
                "peers": self.json(f"{title}: GTSAM and CHOLMOD", evaluate),
                "exactness": self.json(f"{title}: against the truth", exact),
            }
            if keyframes in grid.streams:
                found["isam2"] = {
                    name: self.json(
                        f"{title}: iSAM2, {name}", [*PEERS, "stream", str(written), "--setting", name]
                    )
                    for name in SETTINGS
                }
            if keyframes in grid.daemons and percent == 20:
                asked = ["--decisions", str(grid.decisions)]
                found["daemon"] = self.json(f"{title}: pdnd", [*self.daemon, str(written), *asked])
            if keyframes in grid.memories and percent == 20:
                found["memory"] = self.memory(title, which, written)
        finally:
            written.unlink(missing_ok=True)
        return found

    def memory(self, title: str, which: list[str], written: Path) -> Found:
        """MB of the same job, each in a process of its own: K candidates, and streaming."""
        count = ["--candidates", str(sorted(self.grid.candidates)[len(self.grid.candidates) // 2])]
        title = f"{title}: memory"
        ours = {
            "evaluate": [*self.ours, "evaluate-memory", str(written), *count],
            "stream": [*self.ours, "stream-memory", *which],
        }
        ways = ("batch", "isam2", "untouched")
        peers = {way: [*PEERS, "memory", str(written), "--way", way, *count] for way in ways}
        peers["stream"] = [*PEERS, "stream", str(written), "--setting", next(iter(SETTINGS))]
        found: Found = {
            "ours": {name: self.json(title, command) for name, command in ours.items()},
            "gtsam": {name: self.json(title, command) for name, command in peers.items()},
        }
        found["gtsam"]["stream"] = found["gtsam"]["stream"]["memory"]
        return found

    def alone(self, keyframes: int) -> Found:
        which, percent = survey_options(keyframes, 20), 20
        title = f"{keyframes} keyframes, {percent} % salient: ours alone"
        ours = self.json(title, [*self.ours, "run", *which, "--candidates", "50", "--repeats", "1"])
        memory = self.json(f"{title}, memory", [*self.ours, "stream-memory", *which])
        del ours["terminals"]
        return {
            "keyframes": keyframes,
            "salient_percent": percent,
            "ours": ours,
            "memory": {"ours": {"stream": memory}},
        }

    def json(self, title: str, command: list[str]) -> Found:
        print(f"-- {title}", file=sys.stderr, flush=True)
        one_thread = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
        run = subprocess.run(
            command, env=one_thread, stdout=subprocess.PIPE, text=True, timeout=BOUND_S, check=False
        )
        if run.returncode != 0:
            raise SystemExit(f"{' '.join(command)}\nended with {run.returncode}; its words stand above")
        found: Found = json.loads(run.stdout)
        return found


def survey_options(keyframes: int, percent: int) -> list[str]:
    return ["--keyframes", str(keyframes), "--salient-percent", str(percent)]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--grid", choices=list(GRIDS), default="default")
    parser.add_argument("--binary", type=Path, default=ROOT / "target/release/pdn-perf")
    parser.add_argument("--daemon", type=Path, help="pdnd, where it does not lie beside --binary")
    parser.add_argument("--out", type=Path, default=ROOT / "bench", help="folder for results.json, tables.md")
    parser.add_argument("--readme", action="store_true", help="put the tables into tests/perf/README.md")
    parser.add_argument("--again", type=Path, help="a results.json to make tables of, instead of measuring")
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    text = ""
    for results in runs(
        arguments
    ):  # Written after each survey, so that a run that is broken off leaves its part.
        text = markdown(results)
        (arguments.out / "results.json").write_text(json.dumps(results, indent=1) + "\n")
        (arguments.out / "tables.md").write_text(text)
    if arguments.readme:
        readme = HERE / "README.md"
        head, rest = readme.read_text().split(BEGIN)
        readme.write_text(head + BEGIN + text + END + rest.split(END)[1])
    print(text)


def runs(arguments: argparse.Namespace) -> Iterator[Found]:
    """The results after each survey."""
    if arguments.again:
        yield json.loads(arguments.again.read_text())
        return
    daemon = arguments.daemon or arguments.binary.with_name("pdnd")
    for binary in (arguments.binary, daemon):
        if not binary.exists():
            raise SystemExit(f"{binary} is missing: cargo build --release -p pdn-perf -p pdnd")
    results: Found = {"grid": arguments.grid, "machine": machine(), "surveys": []}
    with tempfile.TemporaryDirectory(prefix="pdn-bench-") as folder:
        bench = Bench(GRIDS[arguments.grid], arguments.binary, daemon, Path(folder))
        for survey in bench.surveys():
            results["surveys"].append(survey)
            results["machine"]["load_after"] = os.getloadavg()[0]
            yield results


if __name__ == "__main__":
    main()
