"""Requests to the planner with this library's time-outs: what questions and commands have in common."""

from __future__ import annotations

from typing import TypeVar

from pdn import wire

from .vehicle_session import ANSWER_MARGIN_S, VehicleSession

M = TypeVar("M")


class Requester:
    """One vehicle's session, and how long its owner waits for replies."""

    def __init__(self, session: VehicleSession, timeout_s: float) -> None:
        self.timeout_s = timeout_s
        self._session = session

    def _ask(
        self,
        topic: wire.Topic,
        kind: type[M],
        timeout_s: float | None,
        *,
        message: object | None = None,
        deadline_ms: int | None = None,
        **parameters: object,
    ) -> M:
        """A question: the planner is told by when to answer, shortly before the time-out."""
        wait_s = self._timeout_s(timeout_s)
        if deadline_ms is None:
            deadline_ms = max(1, round(1000.0 * max(wait_s - ANSWER_MARGIN_S, 0.5 * wait_s)))
        else:
            wait_s = max(wait_s, 0.001 * deadline_ms + ANSWER_MARGIN_S)
        return self._request(topic, message, kind, wait_s, deadline_ms=deadline_ms, **parameters)

    def _request(
        self,
        topic: wire.Topic,
        message: object | None,
        kind: type[M],
        timeout_s: float | None,
        **parameters: object,
    ) -> M:
        form = self._session.form
        return self._session.ask(
            topic,
            kind,
            self._timeout_s(timeout_s),
            payload=None if message is None else wire.encode(message, form),
            encoding=None if message is None else wire.encoding(type(message), form),
            parameters=parameters,
        )

    def _timeout_s(self, timeout_s: float | None) -> float:
        return self.timeout_s if timeout_s is None else timeout_s
