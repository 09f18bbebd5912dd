"""How a failure ends the program: one or two sentences on standard error, and an exit code."""

from __future__ import annotations

import sys
from typing import Any

import typer
from typer.core import TyperGroup

from pdn import wire
from pdn.client.errors import ConnectionFailed, PdnError, PlannerAbsent, Timeout

FAILED = 1
USAGE = 2
NO_CONNECTION = 3
TIMED_OUT = 4
INTERRUPTED = 130


class CommandFailed(Exception):
    """A command cannot do what it was asked for; the message is for the person who asked."""


def exit_code(error: BaseException) -> int:
    """The exit code that stands for an error."""
    if isinstance(error, (ConnectionFailed, PlannerAbsent)):
        return NO_CONNECTION
    if isinstance(error, Timeout):
        return TIMED_OUT
    return FAILED


class Commands(TyperGroup):
    """A group of commands that turns this program's errors into sentences and exit codes."""

    def invoke(self, ctx: Any) -> Any:
        """Runs the command; with `--debug` errors keep their traceback."""
        try:
            return super().invoke(ctx)
        except (PdnError, CommandFailed, wire.WireError, OSError) as error:
            if ctx.params.get("debug"):
                raise
            print(f"Error: {error}", file=sys.stderr)
            raise typer.Exit(exit_code(error)) from error
        except KeyboardInterrupt:
            if ctx.params.get("debug"):
                raise
            raise typer.Exit(INTERRUPTED) from None
