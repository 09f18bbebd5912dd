"""The console's part of the command line."""

from __future__ import annotations

import typer

from . import export, import_g2o, mission, watch


def register(app: typer.Typer) -> None:
    """Adds `mission`, `watch`, `import-g2o` and `export`."""
    mission.register(app)
    watch.register(app)
    import_g2o.register(app)
    export.register(app)
