"""The results as tables in markdown."""

from collections.abc import Iterable, Sequence
from typing import Any

from targets import targets, whole_decisions

Found = dict[str, Any]


def markdown(results: Found) -> str:
    surveys = results["surveys"]
    compared = [survey for survey in surveys if "peers" in survey]
    parts = [
        machine_line(results),
        ("What was asked for", targets_table(results)),
        ("One decision: the terminal covariance of K candidates, ms of CPU", decisions(compared)),
        ("A candidate, ms of CPU", candidates(surveys)),
        ("What is shared, and the rest of a decision, ms of CPU", shared(surveys)),
        ("Two threads, ms that pass for the candidates alone", threads(surveys)),
        ("A whole decision of pdnd over Zenoh, ms that pass and of CPU, medians", daemon(surveys)),
        ("Following a keyframe, ms of CPU", updates(surveys)),
        ("Memory above what the process held with its input, MB", memory(surveys)),
        ("Scaled error of the terminal covariance", exactness(compared)),
    ]
    text = ""
    for part in parts:
        text += part + "\n" if isinstance(part, str) else f"\n### {part[0]}\n\n{part[1]}"
    return text


def machine_line(results: Found) -> str:
    of = results["machine"]
    libraries = ", ".join(f"{name} {of[name]}" for name in ("gtsam", "cvxopt", "scipy", "numpy"))
    return (
        f"Grid `{results['grid']}`, commit {of['commit']}. {of['processors']} x {of['processor']}, "
        f"{of['memory_gib']} GiB, {of['system']}, {of['rustc']}, Python {of['python']}, {libraries}. "
        f"Load {of['load']:.1f} at the beginning, {of['load_after']:.1f} at the end."
    )


def targets_table(results: Found) -> str:
    rows = [(target.asked, target.found, target.verdict) for target in targets(results["surveys"])]
    return table(("asked", "found", ""), rows) if rows else "The grid is too small to tell.\n"


def decisions(surveys: Sequence[Found]) -> str:
    rows = []
    for survey in surveys:
        batch, copies, cholmod = survey["peers"]["always"]
        for ours in survey["ours"]["evaluations"]:
            count = ours["candidates"]
            once = survey["peers"]["by_count"][str(count)]
            peers = [scaled_total(way, count) for way in (batch, copies, once, cholmod)]
            ratios = [f"{peer / ours['scratch']:.1f}" for peer in (peers[0], min(peers[:3]))]
            mine = (ours["scratch"], ours["streamed"], ours["scratch_variants"])
            rows.append((*named(survey), count, *map(ms, mine), *map(ms, peers), *ratios))
    heads = ("N", "salient, %", "K", "from scratch", "smoother's tree", "with variants")
    heads += (
        "GTSAM batch",
        "iSAM2 copies",
        "untouched once",
        "CHOLMOD batch",
        "x paper's way",
        "x best GTSAM",
    )
    return table(heads, rows)


def candidates(surveys: Iterable[Found]) -> str:
    rows = []
    for survey in surveys:
        ours = survey["ours"]["evaluations"][-1]
        one, streamed, variants = (
            ours[name] for name in ("candidate", "streamed_candidate", "candidate_variants")
        )
        mean = one["sum"] / one["count"]
        size = [f"{ours[name]:.0f}" for name in ("virtual_nodes", "links", "poses")]
        times = [mean, one["median"], one["p99"], streamed["median"], variants["median"]]
        peers = [way["candidate"] for way in survey["peers"]["always"]] if "peers" in survey else []
        if peers:
            peers.insert(2, survey["peers"]["by_count"][str(ours["candidates"])]["candidate"])
        told = [ms(time) for time in peers] or [""] * 4
        per_pose = f"{1e3 * mean / ours['poses']:.1f}"
        rows.append((*named(survey), *size, *map(ms, times), per_pose, *told))
    heads = ("N", "salient, %", "virtual nodes", "links", "poses", "mean", "median", "p99")
    heads += ("smoother's tree, median", "with variants, median", "us a pose")
    heads += ("GTSAM batch", "iSAM2 copies", "untouched once", "CHOLMOD batch")
    return table(heads, rows)


def shared(surveys: Iterable[Found]) -> str:
    rows = []
    for survey in surveys:
        ours = survey["ours"]
        tree, streamed = ours["tree"], ours["streamed_tree"]
        size = (f"{tree['mflop']:.0f}", tree["height"], tree["largest_front_rows"])
        size += (f"{streamed['mflop']:.0f}", streamed["height"])
        times = [ours[name] for name in ("shared", "marginals", "copy", "virtual_path", "decision")]
        rows.append((*named(survey), *size, *map(ms, times), ours["decision_candidates"], ours["goals"]))
    heads = ("N", "salient, %", "MFLOP", "height", "largest front, rows", "smoother's MFLOP", "its height")
    heads += ("order and eliminate", "all marginals", "copy of the smoother", "virtual path of one candidate")
    heads += ("one whole decision", "its waypoints", "goals above")
    return table(heads, rows)


def threads(surveys: Iterable[Found]) -> str:
    rows = []
    for survey in surveys:
        for ours in survey["ours"]["evaluations"]:
            one, two = ours["wall"]
            rows.append((*named(survey), ours["candidates"], ms(one), ms(two), f"{one / two:.2f}"))
    return table(("N", "salient, %", "K", "one thread", "two threads", "ratio"), rows)


def daemon(surveys: Iterable[Found]) -> str:
    rows = []
    for survey in surveys:
        for asked in whole_decisions(survey) if "daemon" in survey else ():
            beliefs = ms(asked["beliefs"]) if asked["beliefs"] else ""
            names = ("cpu", "median", "floor", "wait_ms", "queue_ms", "evaluate_ms", "total_ms")
            told = (asked["what"], asked["detail"], asked["encoding"], asked["considered"])
            size = f"{asked['bytes'] / 1e3:.0f}"
            rows.append((*named(survey), *told, beliefs, *(ms(asked[name]) for name in names), size))
    heads = (
        "N",
        "salient, %",
        "mission",
        "detail",
        "encoding",
        "K",
        "beliefs alone, CPU",
        "whole, CPU",
        "whole",
        "floor",
    )
    heads += ("`wait_ms`", "`queue_ms`", "`evaluate_ms`", "`total_ms`", "kB")
    return table(heads, rows)


def updates(surveys: Iterable[Found]) -> str:
    rows = []
    for survey in surveys:
        ours = survey["ours"]
        followers = [
            ("ours", ours["update"], ours["drift"]),
            ("ours, converged at the end", None, ours["converged_drift"]),
            ("ours, but for those that relinearize", ours["update_between"], None),
        ]
        for name, isam2 in survey.get("isam2", {}).items():
            followers.append((f"iSAM2 {name}", isam2["update"], isam2["drift"]))
            followers.append((f"iSAM2 {name}, without reading the newest pose", isam2["update_only"], None))
        for name, times, drift in followers:
            columns = ("median", "p99", "greatest", "sum")
            told = [ms(times[column]) if times else "" for column in columns]
            far = [f"{value:.1e}" for value in drift] if drift else ["", ""]
            rows.append((*named(survey), name, *told, *far))
    heads = ("N", "salient, %", "who", "median", "p99", "greatest", "sum", "drift, m", "drift, rad")
    return table(heads, rows)


def memory(surveys: Iterable[Found]) -> str:
    rows = []
    for survey in surveys:
        for whose, jobs in survey.get("memory", {}).items():
            for job, of in jobs.items():
                above = of["peak"] - of["before"]
                rows.append((*named(survey), whose, job, f"{above:.0f}", f"{of['peak']:.0f}"))
    return table(("N", "salient, %", "whose", "job", "above", "peak of the process"), rows)


def exactness(surveys: Iterable[Found]) -> str:
    rows = []
    for survey in surveys:
        of = survey["exactness"]
        for name, error in of["errors"].items():
            told = (f"{error['rms']:.1e}", f"{error['greatest']:.1e}")
            rows.append((*named(survey), of["candidates"], name, *told))
        rows.append(
            (*named(survey), of["candidates"], "the truth itself", "", f"{of['truth_correction']:.1e}")
        )
    return table(("N", "salient, %", "candidates", "whose", "rms", "greatest"), rows)


def scaled_note(surveys: Sequence[Found]) -> str:
    runs = {way["runs"] for survey in surveys for way in survey["peers"]["always"]}
    return f"The peers ran {' or '.join(map(str, sorted(runs)))} of them; their times are scaled to K."


def scaled_total(way: Found, count: int) -> float:
    """Peers are run on some candidates; all K take in proportion."""
    return float(way["shared"] + count * way["candidate"])


def named(survey: Found) -> tuple[str, int]:
    return f"{survey['keyframes']:,}", survey["salient_percent"]


def ms(time: float) -> str:
    return f"{time:,.0f}" if time >= 100 else f"{time:.3g}"


def table(heads: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "".join("| " + " | ".join(map(str, line)) + " |\n" for line in lines)
