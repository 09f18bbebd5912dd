"""A mission's journal in the formats of other tools, read back with their own readers."""

from __future__ import annotations

import csv
import dataclasses
import json
import resource
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from running import Daemon
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from pdn import wire
from pdn.cli import build
from pdn.client import connect
from pdn.console.journal_file import read_journal
from pdn.console.pose_graph import read_pose_graph
from pdn.sim import flight, remote, scenario_file
from pdn.sim.record import Run

FLOOR = scenario_file.load("seafloor")
STRICT = dataclasses.replace(
    FLOOR,
    survey=dataclasses.replace(FLOOR.survey, lines=4),
    config={**FLOOR.config, "allowable": {**FLOOR.config["allowable"], "x_m": 0.11, "y_m": 0.11}},
)


@pytest.fixture
def flown(daemon: Daemon) -> tuple[Path, Run]:
    """The journal of a mission with detours, and what the simulator says of it."""
    with connect("sim", daemon.endpoint) as client, remote.mission(client, STRICT, "strict", 1.0) as planner:
        run = flight.fly(STRICT, "pdn", 1.0, 1, planner)
    daemon.kill()
    (journal,) = (daemon.folder / "state" / "sim").glob("*.redb")
    return journal, run


def exported(journal: Path, daemon: Daemon, *arguments: str) -> Any:
    command = ["export", str(journal), "--pdnd", str(daemon.binary), "--json", *arguments]
    done = CliRunner().invoke(build(), command)
    assert done.exit_code == 0, done.output
    return json.loads(done.output)


@pytest.mark.timeout(300)
def test_a_mission_is_exported_and_read_back(daemon: Daemon, flown: tuple[Path, Run], tmp_path: Path) -> None:
    journal, run = flown
    mcap, tables, g2o = tmp_path / "m.mcap", tmp_path / "tables", tmp_path / "m.g2o"
    exported(journal, daemon, "--mcap", str(mcap), "--csv", str(tables), "--g2o", str(g2o))
    keyframes = len(run.course.uncertainty)

    rows = {path.stem: list(csv.DictReader(path.open(encoding="utf-8"))) for path in tables.glob("*.csv")}
    assert len(rows["keyframes"]) == keyframes
    assert len(rows["decisions"]) == run.result.decisions
    revisits = [row for row in rows["decisions"] if row["action"] == "revisit"]
    assert [int(row["keyframe"]) for row in revisits] == [detour["waypoint"] for detour in run.detours]
    assert [row["command"] for row in rows["commands"]] == ["configure", "start", "complete"]
    chosen = {row["decision"] for row in revisits}
    assert chosen <= {row["decision"] for row in rows["candidates"]}
    assert all(float(row["sigma_x_m"]) > 0 for row in rows["keyframes"])

    graph = read_pose_graph(g2o.read_bytes(), str(g2o))
    assert len(graph.vertices) == keyframes
    steps = {(edge.from_, edge.to): edge for edge in graph.edges}
    assert len(steps) == keyframes - 1
    # A step is what the odometry said, to the last digit or two.
    told = {
        (factor["from"], factor["to"]): factor
        for record in read_journal(journal, daemon.binary).of("factor")
        for kind, factor in record.content["factor"].items()
        if kind == "odometry"
    }
    assert told.keys() == steps.keys()
    for ends, edge in steps.items():
        measured = told[ends]["relative"]
        np.testing.assert_allclose(edge.relative.translation, measured["translation"], rtol=1e-12, atol=1e-15)
        np.testing.assert_allclose(edge.relative.rotation, measured["rotation"], rtol=1e-12, atol=1e-15)
        covariance = np.array(told[ends]["covariance"]).reshape(6, 6)
        np.testing.assert_allclose(edge.covariance, covariance, rtol=1e-9, atol=1e-18)

    with mcap.open("rb") as file:
        messages = [
            (schema.name, channel.topic, message.log_time, json.loads(message.data))
            for schema, channel, message in make_reader(file).iter_messages()
        ]
    times = [time for _, _, time, _ in messages]
    assert times == sorted(times)
    by_topic: dict[str, list[Any]] = {}
    for schema, topic, _, content in messages:
        by_topic.setdefault(f"{topic} {schema}", []).append(content)
    assert len(by_topic["/pdn/robot foxglove.PoseInFrame"]) == keyframes
    decisions = by_topic["/pdn/decision pdn.v1.Decision"]
    assert [decision["decision"] for decision in decisions] == list(range(run.result.decisions))
    (coverage,) = by_topic["/pdn/coverage foxglove.SceneUpdate"]
    corners = np.array(
        [
            [point[axis] for axis in "xyz"]
            for triangles in coverage["entities"][0]["triangles"]
            for point in triangles["points"]
        ]
    ).reshape(-1, 3, 3)
    sides = corners[:, 1:] - corners[:, :1]
    area_m2 = 0.5 * np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum()
    assert area_m2 == pytest.approx(run.result.covered_believed_m2, rel=1e-3)
    paths = by_topic["/pdn/candidates foxglove.SceneUpdate"]
    longest = max(len(line["points"]) for path in paths for line in path["entities"][0]["lines"])
    assert longest > 1


SEPARATORS = "one\u2028two\u2029three\u0085four\x0bfive\x0csix\x1cseven\x1deight\x1enine"
"""What `str.splitlines` takes for ends of lines beside the newline."""


def test_the_reasons_of_a_replayed_log_and_its_times_are_kept(daemon: Daemon, tmp_path: Path) -> None:
    day = 1_700_000_000_000_000_000
    origin = wire.Pose(translation=(0.0, 0.0, 5.0), rotation=(0.0, 0.0, 0.0, 1.0))
    step = wire.Pose(translation=(0.5, 0.0, 0.0), rotation=(0.0, 0.0, 0.0, 1.0))
    facet = {"origin": [0, 0, 8], "u": [0, 1, 0], "v": [1, 0, 0], "length_u_m": 4, "length_v_m": 4}
    with connect("auv", daemon.endpoint) as client:
        client.configure({"mission": "m", "target": {"facets": [facet]}})
        client.start(SEPARATORS)
        with client.mission_stream() as events:
            for k in range(5):
                events.keyframe(k, origin if k == 0 else None, saliency=(0.9, 0.5), stamp_ns=day + k)
                if k:
                    events.odometry(k - 1, k, step, 1e-4 * np.eye(6), stamp_ns=day + k)
                events.depth(k, 5.0, 0.01, stamp_ns=day + k)
        client.decision(after=events.next_seq - 1)
        client.complete(SEPARATORS)
    daemon.kill()
    (journal,) = (daemon.folder / "state" / "auv").glob("*.redb")
    mcap, tables = tmp_path / "m.mcap", tmp_path / "tables"
    exported(journal, daemon, "--mcap", str(mcap), "--csv", str(tables))
    with (tables / "commands.csv").open(encoding="utf-8", newline="") as file:
        reasons = [row["reason"] for row in csv.DictReader(file)]
    assert reasons == ["", SEPARATORS, SEPARATORS]
    with mcap.open("rb") as file:
        read = [
            (channel.topic, message.log_time, json.loads(message.data))
            for _, channel, message in make_reader(file).iter_messages()
        ]
    times = [time for _, time, _ in read]
    assert (min(times), max(times)) == (day, day + 4)
    assert [content["reason"] for topic, _, content in read if topic == "/pdn/command"] == [SEPARATORS] * 2

    (transform,) = [content for topic, _, content in read if topic == "/tf"]
    first = next(content for topic, _, content in read if topic == "/pdn/robot")
    assert (transform["child_frame_id"], transform["parent_frame_id"]) == (first["frame_id"], "world_enu")
    x, y, z, w = (transform["rotation"][axis] for axis in "xyzw")
    rotation = Rotation.from_quat([x, y, z, w]).as_matrix()
    # North-east-down to east-north-up, to rounding.
    np.testing.assert_allclose(rotation, [[0, 1, 0], [1, 0, 0], [0, 0, -1]], atol=1e-15)
    place = rotation @ [first["pose"]["position"][axis] for axis in "xyz"]
    assert place[2] == pytest.approx(-5.0, abs=0.1), "5 m deep is 5 m below the root"


def test_an_export_that_fails_leaves_the_files_of_before(
    daemon: Daemon, flown: tuple[Path, Run], tmp_path: Path
) -> None:
    journal, _ = flown
    tables, mcap = tmp_path / "tables", tmp_path / "m.mcap"
    exported(journal, daemon, "--csv", str(tables), "--mcap", str(mcap))
    names = ["keyframes", "factors", "links", "decisions", "candidates", "commands"]
    for path in (mcap, *(tables / f"{name}.csv" for name in names)):
        path.write_text("good")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    for option in (["--csv", str(tables)], ["--mcap", str(mcap)]):
        resource.setrlimit(resource.RLIMIT_FSIZE, (4096, limits[1]))
        try:
            command = ["export", str(journal), "--pdnd", str(daemon.binary), *option]
            done = CliRunner().invoke(build(), command)
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        assert done.exit_code == 1
        assert "was not written: " in done.stderr
    assert {path.read_text() for path in (mcap, *tables.iterdir())} == {"good"}
    assert sorted(path.stem for path in tables.iterdir()) == sorted(names), "nothing is left beside"


def test_what_cannot_be_exported_is_told(daemon: Daemon, tmp_path: Path) -> None:
    runner = CliRunner()
    nothing = runner.invoke(build(), ["export", str(tmp_path / "none.redb")])
    assert nothing.exit_code == 1
    assert "give --mcap, --csv or --g2o" in nothing.output + nothing.stderr
    missing = runner.invoke(build(), ["export", str(tmp_path / "none.redb"), "--csv", str(tmp_path)])
    assert missing.exit_code == 1
    assert "there is no journal" in missing.stderr
    foreign = tmp_path / "foreign.redb"
    foreign.write_text("#!/bin/sh\n" * 1000)
    command = ["export", str(foreign), "--csv", str(tmp_path), "--pdnd", str(daemon.binary)]
    refused = runner.invoke(build(), command)
    assert refused.exit_code == 1
    assert str(foreign) in refused.stderr
    other = tmp_path / "pdnd"
    for script, told in (("echo pdnd 9.9.9", "of release 9.9.9"), ("true", "no pdnd")):
        other.write_text(f"#!/bin/sh\n{script}\n")
        other.chmod(0o755)
        refused = runner.invoke(build(), [*command[:-1], str(other)])
        assert refused.exit_code == 1
        assert told in refused.stderr
