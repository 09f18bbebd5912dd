"""What the peers take for the input that pdn-perf wrote; each command is a process of its own and prints
JSON.

It keeps to one processor, and what is timed runs in C++ on one thread.
"""

import argparse
import json
import os
from collections.abc import Sequence
from pathlib import Path

import gtsam_stream
import gtsam_ways
from cholmod_way import cholmod_batch
from cpu import forget_peak, peak_mb, resident_mb
from exactness import exactness
from survey_file import SurveyFile, spread


def evaluate(survey: SurveyFile, counts: Sequence[int], runs: int) -> dict[str, object]:
    """Each way with `runs` of the candidates; what is once for K candidates is measured for each K."""
    some = spread(runs, survey.candidates)
    ways = [
        gtsam_ways.batch(survey, some),
        gtsam_ways.isam2_copies(survey, some),
        cholmod_batch(survey, some),
    ]
    always = [_told(way) for way in ways]
    by_count = {}
    for count in counts:
        all_of_count = spread(count, survey.candidates)
        run = [all_of_count[place] for place in spread(runs, len(all_of_count))]
        by_count[str(len(all_of_count))] = _told(gtsam_ways.untouched_once(survey, run, all_of_count))
    return {"always": always, "by_count": by_count}


def memory(survey: SurveyFile, way: str, count: int) -> dict[str, float]:
    """Of one way with `count` candidates, one after the other."""
    candidates = spread(count, survey.candidates)
    forget_peak()
    before = resident_mb()
    match way:
        case "batch":
            gtsam_ways.batch(survey, candidates, ["COLAMD"])
        case "isam2":
            gtsam_ways.isam2_copies(survey, candidates)
        case "untouched":
            gtsam_ways.untouched_once(survey, candidates, candidates, ["COLAMD"])
    return {"before": before, "peak": peak_mb()}


def _told(way: gtsam_ways.Way) -> dict[str, object]:
    return {"name": way.name, "shared": way.shared, "candidate": way.mean, "runs": len(way.candidate)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)
    for name in ("evaluate", "memory", "stream", "exact"):
        commands.add_parser(name).add_argument("input", type=Path)
    of = commands.choices
    of["evaluate"].add_argument("--candidates", type=lambda text: [int(word) for word in text.split(",")])
    of["evaluate"].add_argument("--runs", type=int)
    of["memory"].add_argument("--way", choices=["batch", "isam2", "untouched"])
    of["memory"].add_argument("--candidates", type=int)
    of["stream"].add_argument("--setting", choices=list(gtsam_stream.SETTINGS))
    of["exact"].add_argument("--ours", type=Path, help="what `pdn-perf run` printed")
    of["exact"].add_argument("--runs", type=int)
    arguments = parser.parse_args()
    os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
    survey = SurveyFile(arguments.input)
    match arguments.command:
        case "evaluate":
            found = evaluate(survey, arguments.candidates, arguments.runs)
        case "memory":
            found = memory(survey, arguments.way, arguments.candidates)
        case "stream":
            found = gtsam_stream.stream(survey, *gtsam_stream.SETTINGS[arguments.setting])
        case _:
            ours = json.loads(arguments.ours.read_text())["terminals"]
            found = exactness(survey, ours, arguments.runs)
    print(json.dumps(found))


if __name__ == "__main__":
    main()
