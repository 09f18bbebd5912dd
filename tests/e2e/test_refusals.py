"""Every message and field that can be wrong is refused with a code and a sentence; the mission is
undisturbed.
"""

import copy
import json
import queue
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import zenoh

from conftest import Daemon
from json_zenoh import ErrorReply, JsonVehicle, open_session
from survey import config

Json = dict[str, Any]
UNIT = {"translation": [0.5, 0.0, 0.0], "rotation": [0.0, 0.0, 0.0, 1.0]}
EYE6 = (np.eye(6) * 1e-4).ravel().tolist()
EYE5 = (np.eye(5) * 1e-4).ravel().tolist()
EYE3 = (np.eye(3) * 1e-4).ravel().tolist()
SALIENCY = {"saliency": {"local": 0.5, "global": 0.5}}

KEYFRAME = {"id": 3, "pose": None, "camera": None, "appearance": SALIENCY}
ODOMETRY = {"from": 1, "to": 2, "relative": UNIT, "covariance": EYE6}
CAMERA = {"from": 1, "to": 2, "direction": [0.0, -1.0, 0.0], "rotation": UNIT["rotation"], "covariance": EYE5}
ATTITUDE = {
    "keyframe": 1,
    "rotation": UNIT["rotation"],
    "tilt_variance_rad2": 1e-4,
    "heading_variance_rad2": None,
}
DEPTH = {"keyframe": 1, "depth_m": 8.5, "variance_m2": 1e-4}
POSITION = {"keyframe": 1, "position": [0.0, 0.0, 8.5], "covariance": EYE3}
PRIOR = {"keyframe": 1, "pose": UNIT, "covariance": EYE6}


def changed(body: Json, **fields: Any) -> Json:
    out = copy.deepcopy(body)
    out.update(fields)
    return out


def spoiled(values: list[float], index: int, value: float) -> list[float]:
    return [*values[:index], value, *values[index + 1 :]]


def factor(kind: str, body: Json, **fields: Any) -> tuple[str, Json]:
    return "factor", {"factor": {kind: changed(body, **fields)}}


def keyframe(**fields: Any) -> tuple[str, Json]:
    return "keyframe", changed(KEYFRAME, **fields)


FAR = {**UNIT, "translation": [100.0, 0.0, 0.0]}
SKEWED = {"translation": [0.5, 0.0, 0.0], "rotation": [0.0, 0.0, 0.1, 1.0]}
EVENTS = {
    "keyframe id repeated": ("repeated_id", keyframe(id=1)),
    "keyframe pose not a unit quaternion": ("not_unit", keyframe(pose=SKEWED)),
    "keyframe camera not a unit quaternion": ("not_unit", keyframe(camera=SKEWED)),
    "local saliency above one": (
        "out_of_range", keyframe(appearance={"saliency": {"local": 1.2, "global": 0.5}})
    ),
    "global saliency below zero": (
        "out_of_range", keyframe(appearance={"saliency": {"local": 0.2, "global": -0.5}})
    ),
    "visual words": ("unsupported", keyframe(appearance={"words": [[1, 2]]})),
    "descriptors": ("unsupported", keyframe(appearance={"descriptors": {"dim": 1, "values": [1.0]}})),
    "unknown appearance": ("invalid", keyframe(appearance={"colour": 1})),
    "unknown field": ("invalid", keyframe(colour="red")),
    "missing field": ("invalid", ("keyframe", {"id": 3})),
    "negative id": ("invalid", keyframe(id=-1)),
    "odometry to itself": ("invalid", factor("odometry", ODOMETRY, to=1)),
    "odometry from an unknown keyframe": ("unknown_keyframe", factor("odometry", ODOMETRY, **{"from": 77})),
    "odometry not a unit quaternion": ("not_unit", factor("odometry", ODOMETRY, relative=SKEWED)),
    "odometry covariance negative": (
        "not_positive_definite", factor("odometry", ODOMETRY, covariance=spoiled(EYE6, 0, -1.0))
    ),
    "odometry covariance not symmetric": (
        "not_positive_definite", factor("odometry", ODOMETRY, covariance=spoiled(EYE6, 1, 5e-5))
    ),
    "odometry covariance too short": ("invalid", factor("odometry", ODOMETRY, covariance=EYE6[:-1])),
    "relative covariance zero": (
        "not_positive_definite", factor("relative", ODOMETRY, covariance=[0.0] * 36)
    ),
    "relative to an unknown keyframe": ("unknown_keyframe", factor("relative", ODOMETRY, to=77)),
    "camera direction not unit": ("not_unit", factor("camera", CAMERA, direction=[0.0, -2.0, 0.0])),
    "camera rotation not unit": ("not_unit", factor("camera", CAMERA, rotation=[1.0, 1.0, 0.0, 0.0])),
    "camera covariance singular": (
        "not_positive_definite", factor("camera", CAMERA, covariance=spoiled(EYE5, 24, 0.0))
    ),
    "camera baseline too short": ("degenerate_baseline", factor("camera", CAMERA, to=4)),
    "attitude not unit": ("not_unit", factor("attitude", ATTITUDE, rotation=[0.0, 0.0, 0.0, 0.0])),
    "attitude tilt variance zero": ("out_of_range", factor("attitude", ATTITUDE, tilt_variance_rad2=0.0)),
    "attitude heading variance negative": (
        "out_of_range", factor("attitude", ATTITUDE, heading_variance_rad2=-1.0)
    ),
    "attitude of an unknown keyframe": ("unknown_keyframe", factor("attitude", ATTITUDE, keyframe=77)),
    "depth variance zero": ("out_of_range", factor("depth", DEPTH, variance_m2=0.0)),
    "position covariance negative": (
        "not_positive_definite", factor("position", POSITION, covariance=spoiled(EYE3, 0, -1.0))
    ),
    "prior not unit": ("not_unit", factor("prior", PRIOR, pose=SKEWED)),
    "unknown kind of factor": ("invalid", factor("sonar", DEPTH)),
    "link with an unknown keyframe": (
        "unknown_keyframe", ("link", {"from": 1, "to": 77, "registered": True})
    ),
    "link with itself": ("invalid", ("link", {"from": 1, "to": 1, "registered": True})),
    "infinite depth": ("invalid", factor("depth", DEPTH, depth_m=float("inf"))),
    "a loop closure wrong by 100 m": ("contradiction", factor("relative", ODOMETRY, to=2, relative=FAR)),
    "a depth wrong by 40 m": ("contradiction", factor("depth", DEPTH, depth_m=48.5)),
    "depth not a number": ("invalid", factor("depth", DEPTH, depth_m=float("nan"))),
}  # fmt: skip


class Mission:
    """A running mission of keyframes 1, 2 and 4 (at the place of 1) whose refusals are heard."""

    def __init__(self, session: zenoh.Session, vehicle: str) -> None:
        self.refusals: queue.Queue[Json] = queue.Queue()
        hear = lambda sample: self.refusals.put(json.loads(sample.payload.to_bytes()))  # noqa: E731
        self.subscriber = session.declare_subscriber(f"pdn/{vehicle}/v1/out/rejected", hear)
        self.vehicle = JsonVehicle(session, vehicle, f"{vehicle}-1")
        self.vehicle.ask("op/configure", config(f"{vehicle}-1"))
        self.vehicle.ask("op/start", {"reason": "test"})
        self.vehicle.event(*keyframe(id=1, pose={"translation": [1, 1, 8.5], "rotation": [0, 0, 0, 1]}))
        for new, relative in ((2, UNIT), (4, {**UNIT, "translation": [0.0, 0.0, 0.01]})):
            self.vehicle.event(*keyframe(id=new))
            self.vehicle.event(*factor("odometry", ODOMETRY, to=new, relative=relative))
        self.before = self.vehicle.wait_applied()

    def assert_refused(self, code: str, seq: int | None) -> Json:
        refusal = self.refusals.get(timeout=10)
        assert (refusal["code"], refusal["seq"]) == (code, seq), refusal
        assert len(refusal["message"]) > 20, refusal
        return refusal

    def assert_undisturbed(self) -> None:
        now = self.vehicle.wait_applied()
        for name in ("phase", "keyframes", "factors", "robot", "covered_m2", "decisions"):
            assert now[name] == self.before[name], name
        assert self.refusals.empty()


@pytest.fixture(scope="module")
def session(daemon: Daemon) -> Iterator[zenoh.Session]:
    with open_session(daemon.endpoint) as opened:
        yield opened


@pytest.fixture(scope="module")
def mission(session: zenoh.Session) -> Mission:
    return Mission(session, "refusals")


@pytest.mark.parametrize("case", EVENTS)
def test_an_event_with_bad_content_is_refused(mission: Mission, case: str) -> None:
    code, (key, body) = EVENTS[case]
    seq = mission.vehicle.event(key, body)
    mission.assert_refused(code, seq)
    mission.assert_undisturbed()


def test_a_repeat_is_ignored_and_another_content_is_a_conflict(mission: Mission) -> None:
    vehicle = mission.vehicle
    key, message = vehicle.events[0]
    vehicle.put(f"in/{key}", json.dumps(message).encode(), zenoh.Encoding.APPLICATION_JSON)
    vehicle.put(f"in/{key}", json.dumps({**message, "id": 9}).encode(), zenoh.Encoding.APPLICATION_JSON)
    mission.assert_refused("conflict", 0)
    mission.assert_undisturbed()


def bincode(suffix: str) -> zenoh.Encoding:
    return zenoh.Encoding("application/octet-stream").with_schema(suffix)


UNREADABLE = {
    "no JSON": ("invalid", b"{", zenoh.Encoding.APPLICATION_JSON),
    "truncated bincode": ("invalid", b"\x03\0\0\0\0\0\0\0ab", bincode("pdn.v1.Keyframe+bincode")),
    "wrong schema hash": ("schema_mismatch", b"", bincode("pdn.v1.Keyframe+bincode#0123456789abcdef")),
    "another message's schema": ("schema_mismatch", b"", bincode("pdn.v1.Factor+bincode")),
    "unknown encoding": ("schema_mismatch", b"hello", zenoh.Encoding.TEXT_PLAIN),
    "a length of 2^64 - 1": ("invalid", b"\xff" * 8, bincode("pdn.v1.Keyframe+bincode")),
    "10 MB": ("too_large", b"[" * 10_000_000, zenoh.Encoding.APPLICATION_JSON),
}


@pytest.mark.parametrize("case", UNREADABLE)
def test_an_unreadable_event_is_refused_without_a_number(mission: Mission, case: str) -> None:
    code, payload, encoding = UNREADABLE[case]
    mission.vehicle.put("in/keyframe", payload, encoding)
    mission.assert_refused(code, None)
    mission.assert_undisturbed()


def test_an_event_of_an_unknown_mission_is_refused(mission: Mission) -> None:
    message = {**KEYFRAME, "mission": "nobody", "seq": 0, "stamp_ns": 0}
    mission.vehicle.put("in/keyframe", json.dumps(message).encode(), zenoh.Encoding.APPLICATION_JSON)
    mission.assert_refused("unknown_mission", 0)
    mission.assert_undisturbed()


def test_an_unknown_event_key_is_refused(mission: Mission) -> None:
    mission.vehicle.put("in/sonar", b"{}", zenoh.Encoding.APPLICATION_JSON)
    mission.assert_refused("invalid", None)
    mission.assert_undisturbed()


FACET = config("x")["target"]["facets"][0]


def with_facet(**fields: Any) -> Json:
    return {"target": {"facets": [changed(FACET, **fields)], "area_m2": None}}


CONFIGURATIONS = {
    "alpha above one": ("out_of_range", {"alpha": 1.5}, "alpha"),
    "alpha below zero": ("out_of_range", {"alpha": -0.1}, "alpha"),
    "no facets": ("invalid", {"target": {"facets": [], "area_m2": None}}, "facets"),
    "facet without area": ("out_of_range", with_facet(length_u_m=0.0), "length_u_m"),
    "edge not a unit vector": ("not_unit", with_facet(u=[0.0, 2.0, 0.0]), "u"),
    "edges not orthogonal": ("invalid", with_facet(v=[0.0, 1.0, 0.0]), "v"),
    "target area zero": ("out_of_range", {"target": {"facets": [FACET], "area_m2": 0.0}}, "area_m2"),
    "target area below the facets": ("invalid", {"target": {"facets": [FACET], "area_m2": 1.0}}, "area_m2"),
    "gate below three sigmas": ("out_of_range", {"gate_sigmas": 2.0}, "gate_sigmas"),
    "allowance zero": ("out_of_range", {"allowable": {**config("x")["allowable"], "x_m": 0.0}}, "x_m"),
    "field of view of 180 degrees": (
        "out_of_range", {"camera": {"horizontal_fov_deg": 180.0}}, "horizontal_fov_deg"
    ),
    "camera mount not unit": ("not_unit", {"camera": {"body_from_camera": SKEWED}}, "body_from_camera"),
    "odometry sigma zero": (
        "out_of_range", {"odometry": {"translation_sigma_m_per_sqrt_m": [0.0, 0.1, 0.1]}}, "translation_sigma"
    ),
    "attitude sigma negative": ("out_of_range", {"attitude": {"tilt_sigma_deg": -1.0}}, "tilt_sigma_deg"),
    "depth sigma zero": ("out_of_range", {"depth": {"sigma_m": 0.0}}, "sigma_m"),
    "baselines crossed": ("invalid", {"planner": {"min_baseline_m": 1.0, "max_baseline_m": 0.5}}, "baseline"),
    "waypoint threshold above one": (
        "out_of_range", {"planner": {"waypoint_local_saliency": 2.0}}, "waypoint_local_saliency"
    ),
    "prior table too short": ("invalid", {"link_model": {"bins": 2, "prior": [[1.0, 1.0]]}}, "prior"),
    "prior table not symmetric": (
        "invalid", {"link_model": {"bins": 2, "prior": [[1, 1], [1, 2], [1, 3], [1, 1]]}}, "prior"
    ),
    "prior not positive": ("invalid", {"link_model": {"bins": 1, "prior": [[0.0, 0.0]]}}, "prior"),
    "robust constant zero": ("out_of_range", {"robust": {"camera": {"cauchy": 0.0}}}, "camera"),
    "cell zero": ("out_of_range", {"cell_m": 0.0}, "cell_m"),
    "cells without number": ("limit", {"cell_m": 1e-5}, "cell"),
    "survey of one point": ("invalid", {"survey": [[0.0, 0.0, 0.0]]}, "survey"),
    "prior sigma zero": (
        "out_of_range", {"first_keyframe_sigmas": {"translation_m": [0.0, 1.0, 1.0]}}, "translation_m"
    ),
    "mission id with a slash": ("invalid", {"mission": "a/b"}, "mission"),
    "unknown field": ("invalid", {"colour": "red"}, "colour"),
    "unknown nested field": ("invalid", {"planner": {"colour": "red"}}, "colour"),
}  # fmt: skip


@pytest.mark.parametrize("case", CONFIGURATIONS)
def test_a_bad_configuration_is_refused(session: zenoh.Session, mission: Mission, case: str) -> None:
    code, fields, where = CONFIGURATIONS[case]
    other = JsonVehicle(session, "unconfigured", "u-1")
    with pytest.raises(ErrorReply) as caught:
        other.ask("op/configure", config("u-1") | fields)
    assert caught.value.code == code, caught.value
    assert where in str(caught.value)
    mission.assert_undisturbed()


QUERIES = {
    "a mission that is active is configured again": (
        "illegal_transition",
        "op/configure",
        config("again"),
        {},
    ),
    "start while running": ("illegal_transition", "op/start", {"reason": ""}, {}),
    "resume while running": ("illegal_transition", "op/resume", {"reason": ""}, {}),
    "a command with an unknown field": ("invalid", "op/pause", {"reason": "", "colour": 1}, {}),
    "an unknown command": ("invalid", "op/fly", {"reason": ""}, {}),
    "an unknown question": ("invalid", "rpc/weather", None, {}),
    "an unknown parameter": ("invalid", "rpc/decision", None, {"colour": "red"}),
    "a parameter that is no number": ("invalid", "rpc/decision", None, {"alpha": "red"}),
    "alpha above one": ("out_of_range", "rpc/decision", None, {"alpha": 1.5}),
    "an allowance of zero": ("out_of_range", "rpc/decision", None, {"sigma_xy_m": 0}),
    "an unknown detail": ("invalid", "rpc/decision", None, {"detail": "some"}),
    "an event that never comes": ("deadline", "rpc/decision", None, {"after": 10**6, "deadline_ms": 50}),
    "an unknown mission": ("unknown_mission", "rpc/mission", None, {"mission": "nobody"}),
    "a path without points": ("invalid", "rpc/evaluate", {"paths": [[]]}, {}),
    "a path that is not finite": (
        "invalid",
        "rpc/evaluate",
        {"paths": [[[float("nan"), 0, 0], [1, 0, 0]]]},
        {},
    ),
}


@pytest.mark.parametrize("case", QUERIES)
def test_a_bad_query_is_refused(mission: Mission, case: str) -> None:
    code, key, payload, parameters = QUERIES[case]
    with pytest.raises(ErrorReply) as caught:
        mission.vehicle.ask(key, payload, **parameters)
    assert caught.value.code == code, caught.value
    assert len(str(caught.value)) > 25
    mission.assert_undisturbed()


def test_a_vehicle_that_nobody_configured(session: zenoh.Session) -> None:
    with pytest.raises(ErrorReply) as caught:
        JsonVehicle(session, "nowhere", "n-1").ask("rpc/mission")
    assert caught.value.code == "unknown_vehicle"
    assert "op/configure" in str(caught.value)


@pytest.mark.parametrize(("command", "phase"), [("pause", "paused"), ("hold", "held")])
def test_a_decision_needs_a_running_mission(session: zenoh.Session, command: str, phase: str) -> None:
    idle = Mission(session, f"idle-{command}")
    assert idle.vehicle.ask(f"op/{command}", {"reason": "test"})["phase"] == phase
    with pytest.raises(ErrorReply) as caught:
        idle.vehicle.ask("rpc/decision")
    assert caught.value.code == "illegal_transition"
    assert "resume" in str(caught.value)
    assert idle.vehicle.ask("rpc/decision", alpha=0.5)["decision"] is None


def test_an_ended_mission_takes_no_events(session: zenoh.Session) -> None:
    ended = Mission(session, "ended")
    ended.vehicle.ask("op/complete", {"reason": "test"})
    seq = ended.vehicle.event(*keyframe(id=9))
    ended.assert_refused("mission_ended", seq)
    ended.vehicle.seq = seq
    with pytest.raises(ErrorReply) as caught:
        ended.vehicle.ask("op/resume", {"reason": ""})
    assert caught.value.code == "illegal_transition"
