"""Answers as tables for a terminal."""

from __future__ import annotations

from itertools import pairwise

from rich.console import Console
from rich.table import Table

from pdn import wire

from . import formatting

MAX_ROWS = 40
"""Rows of a table; beyond, the middle is left out: programs read `--json`."""

WIDTH_OF_FILES = 160
"""Columns where the output is no terminal."""


def print_state(state: wire.MissionState) -> None:
    """A mission as it stands."""
    for heading, line in formatting.summary(state):
        print(f"{heading:<12} {line}")


def print_decision(decision: wire.Decision) -> None:
    """A decision with every candidate."""
    print(formatting.decision(decision))
    _print(candidates(decision.exploration, decision.candidates, _chosen(decision)))
    if not decision.complete:
        print(
            f"The deadline left {len(decision.not_evaluated)} waypoints unevaluated: {decision.not_evaluated}"
        )
    timing = decision.timing
    print(
        f"alpha {decision.alpha:g}, covered {decision.covered_m2:.1f} of {decision.target_m2:.1f} m2, "
        f"events below {decision.graph_seq}; {timing.total_ms:.1f} ms"
    )


def candidates(
    exploration: wire.Exploration, others: tuple[wire.Candidate, ...], chosen: int | None
) -> Table:
    """Candidate 0 and the revisits, with the terms of the reward; the chosen one is marked."""
    table = Table(box=None, pad_edge=False)
    for heading in ("", "k", "keyframe", "one way m", "U", "peak U", "A", "penalty", "links", "alpha from"):
        table.add_column(heading, justify="right")
    table.add_row(
        "->" if chosen == 0 else "", "0", "explore", "",
        f"{exploration.uncertainty:.4f}", f"{exploration.uncertainty_ratio:.4f}",
        f"{exploration.area:.4f}", f"{exploration.penalty:.4f}", "", "",
    )  # fmt: skip
    for candidate in others:
        table.add_row(
            "->" if chosen == candidate.candidate else "",
            str(candidate.candidate),
            "drawn" if candidate.keyframe is None else str(candidate.keyframe),
            f"{candidate.one_way_m:.2f}",
            f"{candidate.uncertainty:.4f}",
            f"{candidate.peak_uncertainty:.4f}",
            f"{candidate.area:.4f}",
            f"{candidate.penalty:.4f}",
            f"{candidate.expected_links:.1f}",
            "never" if candidate.break_even_alpha is None else f"{candidate.break_even_alpha:.3f}",
        )
    return table


def print_graph(graph: wire.GraphReply) -> None:
    """The pose graph, shortened."""
    factors = ", ".join(f"{count} {kind}" for kind, count in graph.factors.items() if count)
    print(f"{len(graph.keyframes)} keyframes; factors: {factors or 'none'}; chi2 {graph.chi2:.9g}")
    table = Table(box=None, pad_edge=False)
    for heading in ("keyframe", "north m", "east m", "depth m", "S_L", "S_G", "sigma m", "sigma deg"):
        table.add_column(heading, justify="right", no_wrap=True)
    for index, keyframe in enumerate(graph.keyframes):
        if len(graph.keyframes) > MAX_ROWS and MAX_ROWS // 2 <= index < len(graph.keyframes) - MAX_ROWS // 2:
            if index == MAX_ROWS // 2:
                table.add_row("...")
            continue
        north, east, depth = keyframe.pose.translation
        spread = ("", "")
        if keyframe.covariance is not None:
            metres, degrees = formatting.sigmas(keyframe.covariance)
            spread = (
                " ".join(f"{value:.3f}" for value in metres),
                " ".join(f"{value:.2f}" for value in degrees),
            )
        table.add_row(
            str(keyframe.id), f"{north:.2f}", f"{east:.2f}", f"{depth:.2f}",
            f"{keyframe.local_saliency:.2f}", f"{keyframe.global_saliency:.2f}", *spread,
        )  # fmt: skip
    _print(table)


def print_waypoints(reply: wire.WaypointsReply) -> None:
    """The waypoints, those that decisions consider marked."""
    table = Table(box=None, pad_edge=False)
    for heading in ("keyframe", "north m", "east m", "depth m", "members", "score", "one way m", "candidate"):
        table.add_column(heading, justify="right")
    for waypoint in reply.waypoints:
        north, east, depth = waypoint.pose.translation
        table.add_row(
            str(waypoint.keyframe), f"{north:.2f}", f"{east:.2f}", f"{depth:.2f}", str(len(waypoint.members)),
            f"{waypoint.score:.3f}", "no path" if waypoint.one_way_m is None else f"{waypoint.one_way_m:.2f}",
            "yes" if waypoint.candidate else "no",
        )  # fmt: skip
    print(f"{len(reply.waypoints)} waypoints")
    _print(table)


def print_coverage(reply: wire.CoverageReply) -> None:
    """The raster of each facet, coarsened to characters: full, partly, not covered."""
    print(f"covered {reply.covered_m2:.1f} of {reply.target_m2:.1f} m2, cells of {reply.cell_m:g} m")
    for number, facet in enumerate(reply.facets):
        cells = facet.cells_u * facet.cells_v
        share = 100.0 * facet.covered_cells / cells if cells else 0.0
        print(
            f"facet {number}: {facet.cells_u} x {facet.cells_v} cells, {share:.1f} % covered; "
            "u to the right, v down"
        )
        for line in raster(facet):
            print("  " + line)


def raster(facet: wire.FacetCoverage, columns: int = 80) -> list[str]:
    """The cells of a facet in at most `columns` columns; a character stands for a block, twice as high
    as wide.
    """
    covered = [False] * (facet.cells_u * facet.cells_v)
    at, filled = 0, False
    for run in facet.runs:
        if filled:
            covered[at : at + run] = [True] * run
        at, filled = at + run, not filled
    wide = -(-facet.cells_u // columns)
    high = 2 * wide
    lines = []
    for top in range(0, facet.cells_v, high):
        line = ""
        for left in range(0, facet.cells_u, wide):
            block = [
                covered[v * facet.cells_u + u]
                for v in range(top, min(top + high, facet.cells_v))
                for u in range(left, min(left + wide, facet.cells_u))
            ]
            line += "█" if all(block) else "▒" if any(block) else "·"
        lines.append(line)
    return lines


def print_link_model(reply: wire.LinkModelReply) -> None:
    """The table of link probabilities: probability, then registered / proposed."""
    edges = [
        f"{low / reply.bins:.1f}-{high / reply.bins:.1f}" for low, high in pairwise(range(reply.bins + 1))
    ]
    table = Table(box=None, pad_edge=False)
    table.add_column("S_L")
    for edge in edges:
        table.add_column(edge, justify="right")
    for row, edge in enumerate(edges):
        bins = reply.cells[row * reply.bins : (row + 1) * reply.bins]
        table.add_row(edge, *[f"{cell.probability:.3f} ({cell.registered}/{cell.proposed})" for cell in bins])
    _print(table)


def _chosen(decision: wire.Decision) -> int:
    match decision.action:
        case wire.Action.Revisit(candidate=candidate):
            return candidate
        case _:
            return 0


def _print(table: Table) -> None:
    console = Console(highlight=False)
    if not console.is_terminal:
        console.width = WIDTH_OF_FILES
    console.print(table)
