"""`pdn import` with a real daemon: what is refused, what is left behind however it ends, and the optimum."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from graphs import Graph, Measured, optimum
from running import Daemon
from typer.testing import CliRunner, Result

from pdn import wire
from pdn.cli import build
from pdn.client import MissionUnknown, connect
from pdn.console.pose_graph import Transform, read_pose_graph
from pdn.wire import Phase

FACET = {"origin": [0, 0, 0], "u": [1, 0, 0], "v": [0, 1, 0], "length_u_m": 10, "length_v_m": 10}


def imported(daemon: Daemon, *arguments: str) -> Result:
    return CliRunner().invoke(
        build(), ["import", "--quiet", *arguments, "-e", daemon.endpoint, "--vehicle", "auv"]
    )


def report(daemon: Daemon, path: Path, *arguments: str) -> Any:
    result = imported(daemon, str(path), "--json", *arguments)
    assert result.exit_code == 0, result.stderr
    return json.loads(result.stdout)


def written(folder: Path, graph: Graph, name: str = "graph.g2o", **form: Any) -> Path:
    path = folder / name
    path.write_bytes(graph.text(**form).encode())
    return path


def drawn(seed: int, poses: int = 8, closures: int = 6) -> Graph:
    return Graph.random(np.random.default_rng(seed), poses, closures)


def with_false_loop(graph: Graph) -> Graph:
    """One closure more, off by 40 m; its line is the last."""
    information = np.diag([400.0] * 3 + [2500.0] * 3)
    far = Transform((40.0, -30.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    return dataclasses.replace(
        graph, edges=[*graph.edges, Measured(0, len(graph.vertices) - 1, far, information)]
    )


def too_sure(graph: Graph, times: float) -> Graph:
    """The same measurements, their standard deviations stated so many times too small."""
    edges = [dataclasses.replace(edge, information=times**2 * edge.information) for edge in graph.edges]
    return dataclasses.replace(graph, edges=edges)


def phase(daemon: Daemon) -> Phase:
    with connect("auv", daemon.endpoint) as client:
        return client.mission().phase


# --- what contradicts the graph ---


def test_a_false_loop_ends_the_import_and_its_mission(daemon: Daemon, tmp_path: Path) -> None:
    path = written(tmp_path, with_false_loop(drawn(1)))
    result = imported(daemon, str(path), "--mission", "one")
    assert result.exit_code == 1
    assert "its mission one is aborted" in result.stderr
    error = next(line for line in result.stderr.splitlines() if line.startswith("Error: "))
    last = path.read_text().count("\n")
    assert f"graph.g2o:{last}: edge 0 -> 7 lies " in error
    for way_out in ("--keep-going", "--robust cauchy", "--gate off"):
        assert way_out in error
    assert phase(daemon) is Phase.ABORTED
    # Nothing stands in the way of the next one.
    assert imported(daemon, str(path), "--keep-going").exit_code == 0


def test_what_is_refused_is_left_out_listed_and_can_be_imported(daemon: Daemon, tmp_path: Path) -> None:
    graph = drawn(2)
    path = written(tmp_path, with_false_loop(graph))
    clean = report(daemon, written(tmp_path, graph, "clean.g2o"))
    refused = tmp_path / "refused.g2o"
    told = report(daemon, path, "--keep-going", "--refused", str(refused))
    assert told["refused"] == 1
    (far,) = told["farthest"]
    assert far["line"] == path.read_text().count("\n")
    assert far["sigmas"] > 20.0
    assert told["chi2"] == pytest.approx(clean["chi2"], rel=1e-9)
    assert told["degrees_of_freedom"] == clean["degrees_of_freedom"]
    (edge,) = read_pose_graph(refused.read_bytes(), str(refused)).edges
    assert (edge.from_, edge.to, edge.relative.translation) == (0, 7, (40.0, -30.0, 0.0))
    assert (
        f"# line {far['line']}, edge 0 -> 7: {far['sigmas']:g} standard deviations away"
        in refused.read_text()
    )
    assert report(daemon, refused)["edges"] == 1
    in_words = imported(daemon, str(path), "--keep-going").stdout
    assert "refused and left out: 1 measurement, the farthest first" in in_words
    assert "edge 0 -> 7" in in_words


def test_a_false_prior_is_refused_as_a_false_edge_is(daemon: Daemon, tmp_path: Path) -> None:
    graph = drawn(9)
    false = Measured(7, 7, Transform((1e3, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)), 1e4 * np.eye(6))
    path = written(tmp_path, dataclasses.replace(graph, priors=[false]), fix=0)
    assert "prior of 7 lies " in imported(daemon, str(path)).stderr
    refused = tmp_path / "refused.g2o"
    told = report(daemon, path, "--keep-going", "--refused", str(refused))
    assert (told["refused"], told["priors"]) == (1, 1)
    assert told["degrees_of_freedom"] == 6 * (len(graph.edges) + 1 - 8)
    assert report(daemon, refused)["last_pose"]["translation"][0] == pytest.approx(1e3)


def test_a_robust_loss_weighs_it_down(daemon: Daemon, tmp_path: Path) -> None:
    path = written(tmp_path, with_false_loop(drawn(3)))
    told = report(daemon, path, "--robust", "cauchy:2")
    assert told["settings"] == {"robust": {"relative": {"cauchy": 2.0}}}
    assert told["refused"] == 0
    assert "robust loss weighs chi2 down" in told["consistency"]
    with connect("auv", daemon.endpoint) as client:
        assert wire.to_plain(client.mission().config.robust.relative) == {"cauchy": 2.0}


def test_a_graph_that_is_far_too_sure_comes_in_with_the_gate_off(daemon: Daemon, tmp_path: Path) -> None:
    graph = too_sure(drawn(4, poses=40, closures=60), 9.0)
    path = written(tmp_path, graph)
    assert imported(daemon, str(path)).exit_code == 1
    told = report(daemon, path, "--gate", "off")
    assert told["settings"] == {"gate_sigmas": None}
    assert told["chi2"] == pytest.approx(optimum(read_pose_graph(path.read_bytes(), "graph")), rel=1e-9)
    # 81 times the true noise; over 366 degrees of freedom drawn chi2 is within 20 % of them.
    assert told["chi2_per_degree"] == pytest.approx(81.0, rel=0.25)
    assert "standard deviations are 9" in told["consistency"] or "are 8." in told["consistency"]
    assert report(daemon, path, "--gate", "2000")["settings"] == {"gate_sigmas": 2000.0}


def test_how_far_from_consistent_is_told(daemon: Daemon, tmp_path: Path) -> None:
    graph = drawn(5, poses=40, closures=60)
    as_stated = report(daemon, written(tmp_path, graph))
    assert as_stated["degrees_of_freedom"] == 6 * (39 + 60) + 6 - 6 * 40
    assert as_stated["consistency"].startswith("Consistent: ")
    sure = report(daemon, written(tmp_path, too_sure(graph, 2.0)))
    assert sure["chi2"] == pytest.approx(4.0 * as_stated["chi2"], rel=1e-6)
    assert "are 2 times too small" in sure["consistency"]
    unsure = report(daemon, written(tmp_path, too_sure(graph, 0.5)))
    assert "are 2 times too large" in unsure["consistency"]


# --- however it ends ---

LONG = 3000
"""Keyframes of an import that is not over before it is interrupted."""


def long_import(daemon: Daemon, folder: Path) -> subprocess.Popen[str]:
    """An import that is under way: some of its keyframes are in the graph, most are not sent."""
    information = np.diag([400.0] * 3 + [2500.0] * 3)
    step = Transform((1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0))
    path = folder / "long.g2o"
    path.write_text("\n".join(Measured(k, k + 1, step, information).text() for k in range(LONG)))
    program = str(Path(sys.executable).parent / "pdn")
    command = [program, "import", "--quiet", str(path), "-e", daemon.endpoint, "--vehicle", "auv"]
    running = subprocess.Popen([*command, "--mission", "long"], stderr=subprocess.PIPE, text=True)
    with connect("auv", daemon.endpoint) as client:
        end_s = time.monotonic() + 60.0
        while True:
            with contextlib.suppress(MissionUnknown):
                if client.mission().keyframes > 10:
                    return running
            assert running.poll() is None, "the import is over before it could be interrupted"
            assert time.monotonic() < end_s
            time.sleep(0.01)


@pytest.mark.parametrize(
    ("number", "code", "says"),
    [
        (signal.SIGINT, 130, "given up (interrupted); its mission long is aborted"),
        (signal.SIGTERM, 143, "given up (ended by SIGTERM); its mission long is aborted"),
        (signal.SIGHUP, 129, "given up (ended by SIGHUP); its mission long is aborted"),
    ],
)
def test_an_interrupted_import_aborts_its_mission(
    daemon: Daemon, tmp_path: Path, number: int, code: int, says: str
) -> None:
    running = long_import(daemon, tmp_path)
    running.send_signal(number)
    _, errors = running.communicate(timeout=30)
    assert (running.returncode, errors.count("Traceback")) == (code, 0), errors
    assert says in errors
    assert phase(daemon) is Phase.ABORTED


def test_an_import_whose_mission_somebody_ends_says_so(daemon: Daemon, tmp_path: Path) -> None:
    running = long_import(daemon, tmp_path)
    with connect("auv", daemon.endpoint) as client:
        client.abort("the operator wants it so")
    _, errors = running.communicate(timeout=30)
    assert running.returncode == 1
    assert "its mission long had ended already" in errors
    assert "takes no more events" in errors


def test_after_a_killed_import_it_is_clear_what_to_do(daemon: Daemon, tmp_path: Path) -> None:
    running = long_import(daemon, tmp_path)
    running.kill()
    running.communicate(timeout=30)
    path = str(written(tmp_path, drawn(6)))
    refused = imported(daemon, path)
    assert refused.exit_code == 1
    assert "mission long of vehicle auv stands in the way: it is running" in refused.stderr
    assert "--replace" in refused.stderr
    assert "--vehicle NAME" in refused.stderr
    replaced = imported(daemon, path, "--replace")
    assert replaced.exit_code == 0, replaced.stderr
    assert "mission long, which an earlier import had left running, is aborted" in replaced.stderr
    with connect("auv", daemon.endpoint) as client:
        assert client.mission(mission="long").phase is Phase.ABORTED
    # The daemon holds it when it comes back, and that changes nothing.
    other = imported(daemon, path, "--mission", "long")
    assert other.exit_code == 1
    assert "has had a mission long" in other.stderr
    assert "never used twice" in other.stderr


def test_a_mission_that_is_no_import_is_never_replaced(daemon: Daemon, tmp_path: Path) -> None:
    path = str(written(tmp_path, drawn(7)))
    with connect("auv", daemon.endpoint) as client:
        client.configure({"mission": "dive", "target": {"facets": [FACET]}})
        client.start("a dive")
        result = imported(daemon, path, "--replace")
        assert result.exit_code == 1
        assert "mission dive of vehicle auv stands in the way" in result.stderr
        assert "no import, so --replace does not end it" in result.stderr
        assert client.mission().phase is Phase.RUNNING
        client.complete("the end")
    assert imported(daemon, path).exit_code == 0


def test_a_mission_that_a_restart_has_held_is_still_known_as_an_import(
    daemon: Daemon, tmp_path: Path
) -> None:
    running = long_import(daemon, tmp_path)
    running.kill()
    running.communicate(timeout=30)
    daemon.kill()
    daemon.start()
    path = str(written(tmp_path, drawn(6)))
    assert "it is held since" in imported(daemon, path).stderr
    assert imported(daemon, path, "--replace").exit_code == 0


def test_an_id_that_no_mission_can_have_is_wrong_usage(daemon: Daemon, tmp_path: Path) -> None:
    result = imported(daemon, str(written(tmp_path, drawn(8))), "--mission", "Dive 3")
    assert result.exit_code == 2
    assert "must have 1 to 64 characters" in result.stderr


# --- the optimum, whatever the form ---


@pytest.mark.parametrize("seed", range(3))
def test_the_form_of_a_graph_changes_nothing(daemon: Daemon, tmp_path: Path, seed: int) -> None:
    random = np.random.default_rng(seed)
    graph = drawn(10 + seed)
    expected = optimum(read_pose_graph(graph.text().encode(), "graph"))
    names = dict(zip(graph.vertices, (int(name) for name in random.permutation(1000)[:8]), strict=True))
    lines = graph.text().splitlines()
    random.shuffle(lines)
    shuffled = tmp_path / "shuffled.g2o"
    shuffled.write_text("\n".join(lines))
    turned = [edge.reversed() if random.random() < 0.5 else edge for edge in graph.edges]
    forms = {
        "plain": written(tmp_path, graph, "plain.g2o"),
        "shuffled": shuffled,
        "renamed": written(tmp_path, graph.renamed(names), "renamed.g2o"),
        "moved": written(tmp_path, graph.moved(Graph.random_pose(random, 100.0)), "moved.g2o"),
        "turned": written(tmp_path, dataclasses.replace(graph, edges=turned), "turned.g2o"),
        "crlf": written(tmp_path, graph, "crlf.g2o", end="\r\n"),
        "held": written(tmp_path, graph, "held.g2o", fix=5),
    }
    for form, path in forms.items():
        told = report(daemon, path)
        # The planner takes its steps to 1e-7, on which chi2 depends in second order.
        assert told["chi2"] == pytest.approx(expected, rel=1e-9), form


def test_a_plane_has_the_optimum_of_the_plane(daemon: Daemon, tmp_path: Path) -> None:
    """A square whose steps are 0.1 m short: each takes a quarter of what is missing, or turns for it."""
    path = tmp_path / "plane.g2o"
    quarter = np.pi / 2
    path.write_text(
        "".join(
            f"EDGE_SE2 {k} {(k + 1) % 4} {1.0 - 0.1 * (k == 0)} 0 {quarter!r} 100 0 0 100 0 1000\n"
            for k in range(4)
        )
    )
    told = report(daemon, path, "--plane-sigmas", "0.5,0.5")
    tight = report(daemon, path, "--plane-sigmas", "0.001,0.001")
    assert told["degrees_of_freedom"] == 3
    assert told["chi2"] == pytest.approx(tight["chi2"], rel=1e-9)
    assert 0.1 < told["chi2"] < 1.0
    assert abs(told["last_pose"]["translation"][2]) < 1e-12


def test_gtsam_reads_what_is_exported_to_the_same_chi2(daemon: Daemon, tmp_path: Path) -> None:
    gtsam = pytest.importorskip("gtsam", reason="needs the extra `oracles`")
    path = written(tmp_path, drawn(20, poses=30, closures=40), fix=12)
    told = report(daemon, path, "--mission", "out")
    daemon.kill()
    (journal,) = (daemon.folder / "state" / "auv").glob("*-out.redb")
    exported = tmp_path / "exported.g2o"
    command = ["export", str(journal), "--g2o", str(exported), "--pdnd", str(daemon.binary)]
    assert CliRunner().invoke(build(), command).exit_code == 0
    assert "\nFIX 12\n" in exported.read_text()
    factors, values = gtsam.readG2o(str(exported), True)
    assert factors.size() == told["edges"]
    # 2 x 1/2 sum r' W r; the information is the inverse of an inverse, of condition 1e3.
    assert 2.0 * factors.error(values) == pytest.approx(told["chi2"], rel=1e-9)
    again = read_pose_graph(exported.read_bytes(), str(exported))
    assert sorted(again.anchors) == [12]
    assert optimum(again) == pytest.approx(told["chi2"], rel=1e-9)
