"""The mission of an import: what stands in its way, and that it is over when the import is, however that
ends.
"""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

from pdn import wire
from pdn.client import Client, IllegalTransition, MissionUnknown, PdnError

from . import formatting
from .failures import CommandFailed

NOMINAL_FACET: dict[str, Any] = {
    "origin": [0.0, 0.0, 0.0],
    "u": [1.0, 0.0, 0.0],
    "v": [0.0, 1.0, 0.0],
    "length_u_m": 1.0,
    "length_v_m": 1.0,
}
"""A mission needs a surface to photograph, a pose graph has none: this square metre stands for it, and
coverage and decisions of an imported mission mean nothing. It is also what a mission of an import is known
by.
"""

ABORT_TIMEOUT_S = 5.0
"""Longest wait for the planner when an import is given up, s."""

ACTIVE = (wire.Phase.RUNNING, wire.Phase.PAUSED, wire.Phase.HELD)


class Terminated(BaseException):
    """A signal asks the program to end."""

    def __init__(self, number: int) -> None:
        super().__init__(f"ended by {signal.Signals(number).name}")
        self.exit_code = 128 + number


def configuration(mission: str, settings: dict[str, Any]) -> dict[str, Any]:
    """What an import's mission is configured with, `settings` included."""
    return {
        "mission": mission,
        "target": {"facets": [NOMINAL_FACET]},
        "first_keyframe_sigmas": None,
        **settings,
    }


@contextmanager
def running(client: Client, config: dict[str, Any], reason: str) -> Iterator[None]:
    """A running mission for the length of the block, completed at its end. If the block is left by an error
    or a signal (Ctrl-C, SIGTERM, SIGHUP), the mission is aborted and that is told on standard error.
    """
    mission = config["mission"]
    with _ending_signals():
        try:
            client.configure(config)
            client.start(reason, mission=mission)
            yield
            client.complete("imported", mission=mission)
        except BaseException as error:
            print(_given_up(client, mission, error), file=sys.stderr)
            raise


def clear_the_way(client: Client, mission: str, *, replace: bool) -> None:
    """Makes sure that a mission of that id can be configured; with `replace` what another import has left is
    aborted. Raises `CommandFailed` with what stands in the way and what to do.
    """
    vehicle = client.vehicle
    try:
        current = client.mission()
    except MissionUnknown:
        return
    if current.phase in ACTIVE:
        _end(client, current, replace=replace)
    try:
        used = current if current.mission == mission else client.mission(mission=mission)
    except MissionUnknown:
        return
    raise CommandFailed(
        f"vehicle {vehicle} has had a mission {mission} ({used.phase}), and an id is never used twice, with "
        "--replace neither; choose another with --mission, or leave it out for one of file name and time"
    )


def _end(client: Client, current: wire.MissionState, *, replace: bool) -> None:
    phase = formatting.phase(current)
    stands = f"mission {current.mission} of vehicle {client.vehicle} stands in the way: it is {phase}"
    apart = "or import beside it as another vehicle: --vehicle NAME"
    if not _is_of_import(current):
        raise CommandFailed(
            f"{stands}. It is no import, so --replace does not end it; end it yourself "
            f"(pdn mission complete|abort --mission {current.mission}), {apart}"
        )
    if not replace:
        raise CommandFailed(
            f"{stands}. It is an import that is still under way, or that was killed: end it with --replace "
            f"if nobody works on it, {apart}"
        )
    client.abort("replaced by another import", mission=current.mission)
    print(
        f"mission {current.mission}, which an earlier import had left {current.phase}, is aborted",
        file=sys.stderr,
    )


def _is_of_import(state: wire.MissionState) -> bool:
    facets = [wire.to_plain(facet) for facet in state.config.target.facets]
    return facets == [NOMINAL_FACET] and state.config.first_keyframe_sigmas is None


def _given_up(client: Client, mission: str, error: BaseException) -> str:
    """Aborts the mission, and says what became of it."""
    ended = isinstance(error, (KeyboardInterrupt, Terminated))
    why = (str(error) or "interrupted") if ended else "an error"
    begun = f"The import is given up ({why})" if ended else "The import is given up"
    try:
        client.abort(f"import given up: {why}", mission=mission, timeout_s=ABORT_TIMEOUT_S)
    except MissionUnknown:
        return f"{begun}; it had begun no mission."
    except IllegalTransition:
        return f"{begun}; its mission {mission} had ended already."
    except (PdnError, KeyboardInterrupt, Terminated) as failed:
        return (
            f"{begun}, and its mission {mission} could not be aborted ({str(failed) or 'interrupted'}). If "
            f"it is still there: pdn import --replace, or pdn mission abort --mission {mission}"
        )
    return f"{begun}; its mission {mission} is aborted."


@contextmanager
def _ending_signals() -> Iterator[None]:
    """SIGTERM and SIGHUP as exceptions, as Ctrl-C is one."""

    def end(number: int, frame: FrameType | None) -> None:
        del frame
        raise Terminated(number)

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.signal(number, end) for number in (signal.SIGTERM, signal.SIGHUP)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
