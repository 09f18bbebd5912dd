"""Exponential backoff: how long the sender waits for progress before it asks the planner and sends again."""

from __future__ import annotations

from pdn.wire import limits

STALL_S = limits.RESEND_AFTER_MS / 1000.0
"""Time without progress after which the planner is asked and events are sent again, s."""

STALL_LAST_S = 6.0
"""The longest delay, s."""


class Backoff:
    """When to ask next: the delay doubles with each failure and is the first again after progress."""

    def __init__(self, now_s: float) -> None:
        self._since_s = now_s
        self._delay_s = STALL_S

    def start(self, now_s: float) -> None:
        """The delay counts from now: the first event after a time of rest is on its way."""
        self._since_s = now_s

    def succeeded(self, now_s: float) -> None:
        """Events were acknowledged."""
        self._since_s = now_s
        self._delay_s = STALL_S

    def failed(self, now_s: float) -> None:
        """Nothing was acknowledged, or nobody answered."""
        self._since_s = now_s
        self._delay_s = min(2.0 * self._delay_s, STALL_LAST_S)

    def remaining_s(self, now_s: float) -> float:
        """Time until the planner should be asked; 0 if it is due."""
        return max(0.0, self._since_s + self._delay_s - now_s)
