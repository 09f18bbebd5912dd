"""The command `pdn`: composes what the packages of the console, the simulator and the plots offer."""

from __future__ import annotations

import importlib
from typing import Annotated

import typer

from pdn import __version__
from pdn.console.failures import Commands
from pdn.console.options import EXIT_CODES

PARTS = ("pdn.console.commands", "pdn.sim.commands", "pdn.plots.commands", "pdn.demo")
"""Modules with a function `register(app)`, in the order of the help. They import what is heavy only when
a command runs.
"""


def _version(asked: bool) -> None:
    if asked:
        print(f"pdn {__version__}")
        raise typer.Exit


def _root(
    debug: Annotated[
        bool, typer.Option("--debug", envvar="PDN_DEBUG", help="Show the traceback of an error.")
    ] = False,
    version: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=_version, help="Print the version and stop.")
    ] = False,
) -> None:
    del debug, version  # Read from the context by whoever needs them.


def build() -> typer.Typer:
    """The whole command line."""
    app = typer.Typer(
        name="pdn",
        cls=Commands,
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,
        help=f"Command missions, watch them, simulate a vehicle.\n\n{EXIT_CODES}",
    )
    app.callback()(_root)
    for part in PARTS:
        importlib.import_module(part).register(app)
    return app


def main() -> None:
    """Entry point of the command `pdn`."""
    build()()


if __name__ == "__main__":
    main()
