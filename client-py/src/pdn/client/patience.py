"""How long to wait for progress before asking; longer each time that asking was in vain."""

from __future__ import annotations

from pdn.wire import limits

STALL_S = limits.RESEND_AFTER_MS / 1000.0
"""Time without progress after which the planner is asked and events are sent again, s."""

STALL_LAST_S = 6.0
"""The same after several vain attempts, s; it doubles from one to the other."""


class Patience:
    """When to ask next."""

    def __init__(self, now_s: float) -> None:
        self._since_s = now_s
        self._span_s = STALL_S

    def begin(self, now_s: float) -> None:
        """The first event after a time of rest is on its way."""
        self._since_s = now_s

    def progressed(self, now_s: float) -> None:
        """Something moved."""
        self._since_s = now_s
        self._span_s = STALL_S

    def asked_in_vain(self, now_s: float) -> None:
        """Nothing had moved, or nobody answered."""
        self._since_s = now_s
        self._span_s = min(2.0 * self._span_s, STALL_LAST_S)

    def left_s(self, now_s: float) -> float:
        """Time until the planner should be asked; 0 if it is due."""
        return max(0.0, self._since_s + self._span_s - now_s)
