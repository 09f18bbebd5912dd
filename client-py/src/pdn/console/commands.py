"""The console's part of the command line."""

from __future__ import annotations

import typer

from . import export, import_graph, mission, watch


def register(app: typer.Typer) -> None:
    """Adds `mission`, `watch`, `import` and `export`."""
    mission.register(app)
    watch.register(app)
    import_graph.register(app)
    export.register(app)
