"""What a vehicle's computer needs of the belief engine, and whether it is there."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

Found = dict[str, Any]


@dataclass(frozen=True)
class Target:
    asked: str
    found: str
    met: bool

    @property
    def verdict(self) -> str:
        return "met" if self.met else "missed"


def targets(surveys: Sequence[Found]) -> list[Target]:
    """Those that the surveys can tell of."""
    by_name = {(survey["keyframes"], survey["salient_percent"]): survey for survey in surveys}
    found: list[Target] = []
    for percent, best, paper in ((20, 25, 50), (60, 15, None)):
        if (10_000, percent) in by_name:
            found.extend(_decision(by_name[10_000, percent], percent, best, paper))
    if (10_000, 20) in by_name:
        found.extend(_candidate(by_name[10_000, 20]))
        found.extend(_whole_decision(by_name[10_000, 20]))
    if {(2_000, 20), (20_000, 20)} <= by_name.keys():
        small, large = (_per_pose(by_name[size, 20]) for size in (2_000, 20_000))
        asked = "per pose, a candidate at N = 20,000 costs at most 2 times one at 2,000"
        found.append(Target(asked, f"{large / small:.2f} times", large <= 2 * small))
    for percent in (20, 60):
        if (10_000, percent) in by_name:
            found.extend(_update(by_name[10_000, percent]))
    if (20_000, 20) in by_name:
        found.extend(_memory(by_name[20_000, 20]))
    for survey in surveys:
        found.extend(_drift(survey))
    found.extend(_exactness([survey for survey in surveys if "exactness" in survey]))
    return found


def _decision(survey: Found, percent: int, best: int, paper: int | None) -> Iterator[Target]:
    for ours in survey["ours"]["evaluations"]:
        if ours["candidates"] != 50:
            continue
        batch, copies, _ = survey["peers"]["always"]
        ways = (batch, copies, survey["peers"]["by_count"]["50"])
        totals = [way["shared"] + 50 * way["candidate"] for way in ways]
        what = f"N = 10,000, K = 50, {percent} % salient, from scratch:"
        faster = min(totals) / ours["scratch"]
        yield Target(f"{what} {best} times the best of GTSAM's ways", f"{faster:.1f} times", faster >= best)
        if paper is not None:
            faster = totals[0] / ours["scratch"]
            yield Target(f"{what} {paper} times the paper's way", f"{faster:.1f} times", faster >= paper)


def _candidate(survey: Found) -> Iterator[Target]:
    for ours in survey["ours"]["evaluations"]:
        if ours["candidates"] == 50:
            mean = ours["candidate"]["sum"] / ours["candidate"]["count"]
            yield Target("N = 10,000, 20 % salient: under 1 ms a candidate", f"{mean:.2f} ms", mean < 1.0)
            ratio = ours["wall"][0] / ours["wall"][1]
            yield Target("2 threads 1.7 times faster than one", f"{ratio:.2f} times", ratio >= 1.7)


def whole_decisions(survey: Found) -> list[Found]:
    """What was asked of pdnd, with the candidates' number and the CPU time of their beliefs alone, ms,
    where there are any.

    Where all is told of each candidate, the beliefs are `rpc/evaluate` of the same paths. Of a choice
    they are what pdn-perf found on the smoother's tree for as many virtual nodes, and all that is told of
    one.
    """
    of = survey["daemon"]
    listed = of["weighed"][0]
    nearest = min(
        survey["ours"]["evaluations"], key=lambda found: abs(found["candidates"] - listed["candidates"])
    )
    terminal = nearest["streamed_candidate"]["sum"] / (nearest["candidates"] * nearest["virtual_nodes"])
    variants = nearest["candidate_variants"]["sum"] / nearest["candidate_variants"]["count"]
    choice = terminal * listed["candidates"] * listed["virtual_nodes"] + variants
    told = []
    for asked in of["weighed"]:
        beliefs = choice if asked["detail"] == "choice" else of["beliefs"]["cpu"]
        told.append({**asked, "what": "weighed", "considered": listed["candidates"], "beliefs": beliefs})
    return [
        *told,
        *({**asked, "what": "certain", "considered": 0, "beliefs": None} for asked in of["certain"]),
    ]


def _whole_decision(survey: Found) -> Iterator[Target]:
    for asked in whole_decisions(survey) if "daemon" in survey else ():
        how = f"{asked['detail']}, {asked['encoding']}"
        if asked["beliefs"] is None:
            asking = f"N = 10,000, a decision that is certain ({how}): under 2 ms"
            yield Target(asking, f"{asked['median']:.1f} ms", asked["median"] < 2.0)
        else:
            ratio = (asked["median"] - asked["floor"]) / asked["beliefs"]
            asking = (
                f"N = 10,000, a whole decision ({how}) but for the transport's floor: 1.5 times its beliefs"
            )
            yield Target(asking, f"{ratio:.2f} times", ratio <= 1.5)


def _per_pose(survey: Found) -> float:
    ours = survey["ours"]["evaluations"][-1]
    return float(ours["candidate"]["sum"] / ours["candidate"]["count"] / ours["poses"])


def _update(survey: Found) -> Iterator[Target]:
    what = f"N = {survey['keyframes']:,}, {survey['salient_percent']} % salient, a keyframe:"
    ours = survey["ours"]["update"]
    for name, isam2 in survey.get("isam2", {}).items():
        for figure, share in (("median", 1 / 3), ("p99", 1 / 2)):
            ratio = ours[figure] / isam2["update"][figure]
            asked = f"{what} {figure} at most {share:.2f} of iSAM2's, {name}"
            yield Target(asked, f"{ratio:.2f}", ratio <= share)


def _drift(survey: Found) -> Iterator[Target]:
    if survey["keyframes"] >= 10_000:
        drift = max(survey["ours"]["converged_drift"])
        where = f"N = {survey['keyframes']:,}, {survey['salient_percent']} % salient"
        yield Target(f"{where}: converged, at the batch optimum to 1e-6", f"{drift:.1e}", drift <= 1e-6)


def _memory(survey: Found) -> Iterator[Target]:
    of = survey.get("memory", {})
    if "gtsam" not in of:
        return
    above = {
        whose: {job: figures["peak"] - figures["before"] for job, figures in jobs.items()}
        for whose, jobs in of.items()
    }
    peers = above["gtsam"]
    least = {"stream": peers["stream"], "evaluate": min(peers[way] for way in peers if way != "stream")}
    for job, least_mb in least.items():
        ratio = above["ours"][job] / least_mb
        what = f"N = {survey['keyframes']:,}, {survey['salient_percent']} % salient:"
        asked = f"{what} memory to {job} at most half of GTSAM's least"
        yield Target(asked, f"{ratio:.2f}", ratio <= 0.5)


def _exactness(surveys: Iterable[Found]) -> Iterator[Target]:
    worst = None
    for survey in surveys:
        errors = {name: error["rms"] for name, error in survey["exactness"]["errors"].items()}
        ours = max(errors["ours, at once"], errors["ours, streamed"])
        ratios = (ours / errors["GTSAM batch"], ours / errors["CHOLMOD"])
        if worst is None or min(ratios) > min(worst[0]):
            worst = (ratios, survey)
    if worst is not None:
        (gtsam, cholmod), survey = worst
        where = f"N = {survey['keyframes']:,}, {survey['salient_percent']} %"
        found = f"{gtsam:.1f} of GTSAM's, {cholmod:.1f} of CHOLMOD's at worst ({where})"
        asked = "scaled error (rms) at most twice that of GTSAM or CHOLMOD"
        yield Target(asked, found, min(gtsam, cholmod) <= 2)
