"""Asking the planner with this library's time-outs: what questions and commands have in common."""

from __future__ import annotations

from typing import TypeVar

from pdn import wire

from .link import ANSWER_MARGIN_S, Link

M = TypeVar("M")


class Asking:
    """One vehicle's link, and how long its owner waits for answers."""

    def __init__(self, link: Link, timeout_s: float) -> None:
        self.timeout_s = timeout_s
        self._link = link

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
        patience_s = self._patience(timeout_s)
        if deadline_ms is None:
            deadline_ms = max(1, round(1000.0 * max(patience_s - ANSWER_MARGIN_S, 0.5 * patience_s)))
        else:
            patience_s = max(patience_s, 0.001 * deadline_ms + ANSWER_MARGIN_S)
        return self._send(topic, message, kind, patience_s, deadline_ms=deadline_ms, **parameters)

    def _send(
        self,
        topic: wire.Topic,
        message: object | None,
        kind: type[M],
        timeout_s: float | None,
        **parameters: object,
    ) -> M:
        form = self._link.form
        return self._link.ask(
            topic,
            kind,
            self._patience(timeout_s),
            payload=None if message is None else wire.encode(message, form),
            encoding=None if message is None else wire.encoding(type(message), form),
            parameters=parameters,
        )

    def _patience(self, timeout_s: float | None) -> float:
        return self.timeout_s if timeout_s is None else timeout_s
