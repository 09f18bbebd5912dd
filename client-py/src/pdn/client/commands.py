"""What changes a mission: configuring it and moving it from phase to phase."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from pdn import wire

from .requester import Requester


class Commands(Requester):
    """The commands of the contract, each answered by the mission as it then stands."""

    def configure(
        self, config: wire.MissionConfig | Mapping[str, Any], *, timeout_s: float | None = None
    ) -> wire.MissionState:
        """A new mission, from a typed configuration or from a mapping as in JSON or TOML, which the
        planner completes.
        """
        if isinstance(config, wire.MissionConfig):
            return self._request(wire.Topic.OP_CONFIGURE, config, wire.MissionState, timeout_s)
        payload = json.dumps(config, allow_nan=False).encode()
        return self._session.ask(
            wire.Topic.OP_CONFIGURE,
            wire.MissionState,
            self._timeout_s(timeout_s),
            payload=payload,
            encoding=wire.encoding(wire.MissionConfig, wire.Format.JSON),
        )

    def start(
        self, reason: str = "", *, mission: str | None = None, timeout_s: float | None = None
    ) -> wire.MissionState:
        """From `configured` to `running`."""
        return self._command(wire.Topic.OP_START, reason, mission, timeout_s)

    def pause(
        self, reason: str = "", *, mission: str | None = None, timeout_s: float | None = None
    ) -> wire.MissionState:
        """From `running` to `paused`: events still count, decisions are not given."""
        return self._command(wire.Topic.OP_PAUSE, reason, mission, timeout_s)

    def resume(
        self, reason: str = "", *, mission: str | None = None, timeout_s: float | None = None
    ) -> wire.MissionState:
        """From `paused` or `held` to `running`."""
        return self._command(wire.Topic.OP_RESUME, reason, mission, timeout_s)

    def hold(
        self, reason: str = "", *, mission: str | None = None, timeout_s: float | None = None
    ) -> wire.MissionState:
        """From `running` to `held`: no decisions until someone resumes, as after a restart of the planner."""
        return self._command(wire.Topic.OP_HOLD, reason, mission, timeout_s)

    def complete(
        self, reason: str = "", *, mission: str | None = None, timeout_s: float | None = None
    ) -> wire.MissionState:
        """Ends the mission as planned."""
        return self._command(wire.Topic.OP_COMPLETE, reason, mission, timeout_s)

    def abort(
        self, reason: str = "", *, mission: str | None = None, timeout_s: float | None = None
    ) -> wire.MissionState:
        """Ends the mission before its end."""
        return self._command(wire.Topic.OP_ABORT, reason, mission, timeout_s)

    def _command(
        self, topic: wire.Topic, reason: str, mission: str | None, timeout_s: float | None
    ) -> wire.MissionState:
        return self._request(
            topic, wire.Command(reason=reason), wire.MissionState, timeout_s, mission=mission
        )
