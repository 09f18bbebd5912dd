"""A journal as MCAP, for Foxglove and its kin: decisions with their schema, poses, coverage and candidates.

Poses, coverage and candidates use Foxglove's own JSON schemas, as far as they are written here
(https://docs.foxglove.dev/docs/visualization/message-schemas). The frame of all of them is `world`,
north-east-down, as in the journal. Foxglove and rviz draw the z of the root frame upwards, so the root is
`world_enu`, east-north-up about the same origin, and `/tf` says how the two stand to each other.
Poses are the final estimates, at the times of their keyframes; a decision stands at that of the event before.
"""

from __future__ import annotations

import json
from importlib import resources
from pathlib import Path
from typing import Any

from pdn import files

from .failures import CommandFailed
from .journal_file import Journal, Json

WORLD = "world"
ROOT = "world_enu"
ROOT_FROM_WORLD = [0.5**0.5, 0.5**0.5, 0.0, 0.0]
"""Rotation [x, y, z, w]: half a turn about the bisector of north and east, which changes them over and turns
down into up.
"""
GREY = {"r": 0.6, "g": 0.6, "b": 0.6, "a": 0.8}
CHOSEN = {"r": 0.9, "g": 0.3, "b": 0.1, "a": 1.0}
COVERED = {"r": 0.2, "g": 0.5, "b": 0.9, "a": 0.4}


def write_mcap(journal: Journal, path: Path) -> dict[str, int]:
    """Writes the file; returns the number of messages by topic. Raises `files.FileNotWritten`."""
    try:
        from mcap.writer import Writer
    except ImportError as error:
        raise CommandFailed("MCAP needs the package mcap: pip install 'pdn[export]'") from error
    counts: dict[str, int] = {}
    with files.replacing(path, "wb") as file:
        writer = Writer(file)
        writer.start(profile="", library="pdn export")
        channels = {
            topic: writer.register_channel(
                topic=topic,
                message_encoding="json",
                schema_id=writer.register_schema(name, "jsonschema", json.dumps(schema).encode()),
            )
            for topic, (name, schema) in _topics().items()
        }
        messages = sorted(_messages(journal), key=lambda message: message[0])
        for sequence, (at_ns, topic, content) in enumerate(messages):
            data = json.dumps(content).encode()
            writer.add_message(
                channels[topic], log_time=at_ns, publish_time=at_ns, sequence=sequence, data=data
            )
            counts[topic] = counts.get(topic, 0) + 1
        writer.finish()  # type: ignore[no-untyped-call]
    return counts


def _topics() -> dict[str, tuple[str, Json]]:
    decision = json.loads(resources.files("pdn.wire").joinpath("Decision.json").read_text(encoding="utf-8"))
    return {
        "/pdn/decision": ("pdn.v1.Decision", decision),
        "/pdn/command": ("pdn.Command", _object(command=_TEXT, reason=_TEXT)),
        "/tf": (
            "foxglove.FrameTransform",
            _object(
                timestamp=_TIME,
                parent_frame_id=_TEXT,
                child_frame_id=_TEXT,
                translation=_POINT,
                rotation=_QUATERNION,
            ),
        ),
        "/pdn/robot": ("foxglove.PoseInFrame", _object(timestamp=_TIME, frame_id=_TEXT, pose=_POSE)),
        "/pdn/trajectory": (
            "foxglove.PosesInFrame",
            _object(timestamp=_TIME, frame_id=_TEXT, poses={"type": "array", "items": _POSE}),
        ),
        "/pdn/candidates": ("foxglove.SceneUpdate", _SCENE),
        "/pdn/coverage": ("foxglove.SceneUpdate", _SCENE),
    }


def _messages(journal: Journal) -> list[tuple[int, str, Json]]:
    stamps = {record.content["id"]: record.at_ns for record in journal.of("keyframe")}
    keyframes = journal.graph["keyframes"]
    poses = {keyframe["id"]: _pose(keyframe["pose"]) for keyframe in keyframes}
    messages = [_root(min(stamps.values(), default=0))]
    for keyframe, pose in poses.items():
        at_ns = stamps[keyframe]
        messages.append((at_ns, "/pdn/robot", {"timestamp": _time(at_ns), "frame_id": WORLD, "pose": pose}))
    # Events alone tell the time of what happens to the vehicle; the daemon's clock may be another.
    at_ns = min(stamps.values(), default=0)
    for record in journal.records:
        if record.kind in ("keyframe", "factor", "link"):
            at_ns = record.at_ns
        elif record.kind == "decided":
            decision = record.content["decision"]
            messages.append((at_ns, "/pdn/decision", decision))
            messages.append((at_ns, "/pdn/candidates", _paths(decision, poses, at_ns)))
        elif record.kind == "command":
            command = {"command": record.content["operation"], "reason": record.content["reason"]}
            messages.append((at_ns, "/pdn/command", command))
    if keyframes:
        trajectory = {"timestamp": _time(at_ns), "frame_id": WORLD, "poses": list(poses.values())}
        messages.append((at_ns, "/pdn/trajectory", trajectory))
        messages.append((at_ns, "/pdn/coverage", _coverage(journal, at_ns)))
    return messages


def _root(at_ns: int) -> tuple[int, str, Json]:
    """`world_enu` from `world`, once, before everything else: it does not change."""
    transform = {
        "timestamp": _time(at_ns),
        "parent_frame_id": ROOT,
        "child_frame_id": WORLD,
        "translation": _HERE["position"],
        "rotation": dict(zip("xyzw", ROOT_FROM_WORLD, strict=True)),
    }
    return at_ns, "/tf", transform


def _paths(decision: Json, poses: dict[int, Json], at_ns: int) -> Json:
    """Each candidate's path as a line, the chosen one in a colour of its own."""
    chosen = decision["action"].get("revisit", {}).get("candidate")
    lines = [
        {
            "type": 0,  # A strip.
            "pose": _HERE,
            "thickness": 2.0,
            "scale_invariant": True,
            "points": [poses[keyframe]["position"] for keyframe in candidate["path"] if keyframe in poses],
            "color": CHOSEN if candidate["candidate"] == chosen else GREY,
            "colors": [],
            "indices": [],
        }
        for candidate in decision["candidates"]
    ]
    return _scene("candidates", at_ns, lines=lines)


def _coverage(journal: Journal, at_ns: int) -> Json:
    """Covered cells as triangles, facet by facet."""
    cell_m = journal.coverage["cell_m"]
    triangles = []
    for facet, raster in zip(
        journal.configured["config"]["target"]["facets"], journal.coverage["facets"], strict=True
    ):
        corner = [
            [facet[axis][k] * facet[f"length_{axis}_m"] / raster[f"cells_{axis}"] for k in range(3)]
            for axis in ("u", "v")
        ]
        points = []
        for u, v, length in _covered(raster):
            # A run of cells along u is one rectangle.
            ends = [(u, v), (u + length, v), (u + length, v + 1), (u, v), (u + length, v + 1), (u, v + 1)]
            for i, j in ends:
                place = [facet["origin"][k] + i * corner[0][k] + j * corner[1][k] for k in range(3)]
                points.append(dict(zip("xyz", place, strict=True)))
        triangles.append({"pose": _HERE, "points": points, "color": COVERED, "colors": [], "indices": []})
    entity = _scene("coverage", at_ns, triangles=triangles)
    entity["entities"][0]["metadata"] = [
        {"key": "covered_m2", "value": repr(journal.coverage["covered_m2"])},
        {"key": "target_m2", "value": repr(journal.coverage["target_m2"])},
        {"key": "cell_m", "value": repr(cell_m)},
    ]
    return entity


def _covered(raster: Json) -> list[tuple[int, int, int]]:
    """Covered runs, cut at the ends of rows: column, row, length."""
    cells_u, at, runs = raster["cells_u"], 0, []
    for index, length in enumerate(raster["runs"]):
        end = at + length
        while index % 2 and at < end:
            part = min(end, (at // cells_u + 1) * cells_u) - at
            runs.append((at % cells_u, at // cells_u, part))
            at += part
        at = end
    return runs


def _scene(name: str, at_ns: int, **primitives: Any) -> Json:
    kinds = ("arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models")
    entity = {
        "timestamp": _time(at_ns),
        "frame_id": WORLD,
        "id": name,
        "lifetime": {"sec": 0, "nsec": 0},
        "frame_locked": False,
        "metadata": [],
        **{kind: primitives.get(kind, []) for kind in kinds},
    }
    return {"deletions": [], "entities": [entity]}


def _pose(pose: Json) -> Json:
    return {
        "position": dict(zip("xyz", pose["translation"], strict=True)),
        "orientation": dict(zip("xyzw", pose["rotation"], strict=True)),
    }


def _time(at_ns: int) -> Json:
    return {"sec": at_ns // 1_000_000_000, "nsec": at_ns % 1_000_000_000}


def _object(**properties: Json) -> Json:
    return {"type": "object", "properties": properties, "required": list(properties)}


_TEXT: Json = {"type": "string"}
_NUMBER: Json = {"type": "number"}
_TIME = _object(sec={"type": "integer"}, nsec={"type": "integer"})
_POINT = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER)
_QUATERNION = _object(x=_NUMBER, y=_NUMBER, z=_NUMBER, w=_NUMBER)
_POSE = _object(position=_POINT, orientation=_QUATERNION)
_COLOR = _object(r=_NUMBER, g=_NUMBER, b=_NUMBER, a=_NUMBER)
_HERE = _pose({"translation": [0.0, 0.0, 0.0], "rotation": [0.0, 0.0, 0.0, 1.0]})


def _list(items: Json) -> Json:
    return {"type": "array", "items": items}


_MARKS = {
    "pose": _POSE,
    "points": _list(_POINT),
    "color": _COLOR,
    "colors": _list(_COLOR),
    "indices": _list({"type": "integer"}),
}
_LINE = _object(
    type={"type": "integer", "description": "0 strip, 1 loop, 2 list"},
    thickness=_NUMBER,
    scale_invariant={"type": "boolean"},
    **_MARKS,
)
_ANYTHING = _list(_object())
_ENTITY = _object(
    timestamp=_TIME,
    frame_id=_TEXT,
    id=_TEXT,
    lifetime=_TIME,
    frame_locked={"type": "boolean"},
    metadata=_list(_object(key=_TEXT, value=_TEXT)),
    arrows=_ANYTHING,
    cubes=_ANYTHING,
    spheres=_ANYTHING,
    cylinders=_ANYTHING,
    lines=_list(_LINE),
    triangles=_list(_object(**_MARKS)),
    texts=_ANYTHING,
    models=_ANYTHING,
)
_SCENE = _object(deletions=_ANYTHING, entities=_list(_ENTITY))
