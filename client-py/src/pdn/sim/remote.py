"""The planner over Zenoh: what the simulator tells and asks, as messages of the contract."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import numpy as np

from pdn import wire
from pdn.client import (
    Client,
    IllegalTransition,
    MissionStream,
    NotAllowed,
    PdnError,
    Refused,
    Timeout,
)
from pdn.sim.flight import mission_config
from pdn.sim.hardware import Attitude, Depth, Image, Odometry, Registration
from pdn.sim.planner import Decision, Fix
from pdn.sim.scenario import Scenario
from pdn.sim.se3 import Pose, quaternion_of

POLL_S = 0.2
"""How often an awaited mission, or one that is paused or held, is looked at."""

WAITING = (wire.Phase.PAUSED, wire.Phase.HELD)
"""Phases in which the vehicle stays where it is."""


@contextmanager
def mission(client: Client, scenario: Scenario, name: str, alpha: float) -> Iterator[RemotePlanner]:
    """Configure and start a mission, hand out its planner, and complete it; an error on the way aborts it."""
    client.configure(mission_config(scenario, name, alpha))
    client.start("the survey begins")
    with _streaming(client, name) as planner:
        yield planner


@contextmanager
def operators_mission(client: Client, timeout_s: float) -> Iterator[RemotePlanner]:
    """Wait for a mission that an operator has configured and started, and take it as ``mission`` does; a
    vehicle that may not command leaves completing it to the operator.
    """
    end = time.monotonic() + timeout_s
    while (name := _running(client)) is None:
        if time.monotonic() > end:
            raise Timeout(f"no operator has started a mission of this vehicle within {timeout_s:g} s")
        time.sleep(POLL_S)
    with _streaming(client, name, commands=False) as planner:
        yield planner


def _running(client: Client) -> str | None:
    try:
        state = client.mission()
    except Refused:
        return None
    return state.mission if state.phase == wire.Phase.RUNNING else None


@contextmanager
def _streaming(client: Client, name: str, *, commands: bool = True) -> Iterator[RemotePlanner]:
    stream = client.mission_stream(name, on_rejected="collect")
    try:
        yield RemotePlanner(client, stream)
        stream.flush()
    except BaseException as error:
        with suppress(PdnError):  # What went wrong first is what matters.
            client.abort(f"the simulator stopped: {type(error).__name__}", mission=name)
        raise
    else:
        try:
            client.complete("the survey is flown", mission=name)
        except NotAllowed:
            if commands:
                raise
    finally:
        stream.close()


class RemotePlanner:
    """See ``Planner``."""

    def __init__(self, client: Client, stream: MissionStream) -> None:
        self._client = client
        self._stream = stream
        self._seq = -1

    def keyframe(self, number: int, pose: Pose | None, body_from_camera: Pose, image: Image) -> None:
        """See ``Planner``."""
        self._seq = self._stream.keyframe(
            number,
            None if pose is None else to_wire(pose),
            saliency=(image.local, image.global_),
            camera=to_wire(body_from_camera),
        )

    def odometry(self, older: int, newer: int, measured: Odometry) -> None:
        """See ``Planner``."""
        self._seq = self._stream.odometry(older, newer, to_wire(measured.relative), measured.covariance)

    def attitude(self, number: int, measured: Attitude) -> None:
        """See ``Planner``."""
        self._seq = self._stream.attitude(
            number,
            quaternion_of(measured.rotation),
            measured.tilt_variance_rad2,
            measured.heading_variance_rad2,
        )

    def depth(self, number: int, measured: Depth) -> None:
        """See ``Planner``."""
        self._seq = self._stream.depth(number, measured.depth_m, measured.variance_m2)

    def registration(self, older: int, newer: int, measured: Registration | None) -> None:
        """See ``Planner``."""
        self._seq = self._stream.link(older, newer, measured is not None)
        if measured is not None:
            self._seq = self._stream.camera(
                older,
                newer,
                measured.direction.tolist(),
                quaternion_of(measured.rotation),
                measured.covariance,
            )

    def fix(self) -> Fix:
        """See ``Planner``."""
        state = self._client.mission(after=self._seq, mission=self._stream.mission)
        robot = state.robot
        if robot is None or state.uncertainty is None:
            raise RuntimeError(f"the planner has no robot after event {self._seq}: {state.health.findings}")
        return Fix(
            keyframe=robot.keyframe,
            pose=from_wire(robot.pose),
            covariance=np.array(robot.covariance, dtype=float).reshape(6, 6),
            uncertainty=state.uncertainty,
            covered_m2=state.covered_m2,
        )

    def estimates(self) -> list[Pose]:
        """See ``Planner``."""
        graph = self._client.graph(after=self._seq, mission=self._stream.mission)
        return [from_wire(keyframe.pose) for keyframe in graph.keyframes]

    def decide(self) -> Decision:
        """See ``Planner``. While the mission is paused or held the vehicle stays where it is."""
        decision = self._decision()
        action = decision.action
        exploring = decision.exploration.uncertainty
        if not isinstance(action, wire.Action.Revisit):
            return Decision(None, (), exploring, len(decision.candidates))
        chosen = next(c for c in decision.candidates if c.candidate == action.candidate)
        route = tuple(from_wire(pose) for pose in chosen.poses or ())
        return Decision(action.keyframe, route, exploring, len(decision.candidates))

    def _decision(self) -> wire.Decision:
        while True:
            try:
                return self._client.decision(after=self._seq, detail="choice", mission=self._stream.mission)
            except IllegalTransition:
                if self._phase() not in (*WAITING, wire.Phase.RUNNING):
                    raise
                while self._phase() in WAITING:
                    time.sleep(POLL_S)

    def _phase(self) -> wire.Phase:
        return self._client.mission(mission=self._stream.mission).phase

    def refused(self) -> list[str]:
        """See ``Planner``."""
        return [f"event {p.seq}: {p.code}: {p.message}" for p in self._stream.refusals]


def to_wire(pose: Pose) -> wire.Pose:
    """The contract's form of a pose."""
    x, y, z = (float(value) for value in pose.translation)
    qx, qy, qz, qw = pose.quaternion()
    return wire.Pose(translation=(x, y, z), rotation=(qx, qy, qz, qw))


def from_wire(pose: wire.Pose) -> Pose:
    """A pose from the contract's form."""
    return Pose.of(list(pose.translation), list(pose.rotation))
