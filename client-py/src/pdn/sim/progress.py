"""Progress of a flight on standard error."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from pdn.sim.flight import Progress


@contextmanager
def progress_bar(title: str, *, visible: bool) -> Iterator[Progress | None]:
    """A progress bar over the survey's keyframes; none where standard error is no terminal or it is not
    wanted."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    console = Console(stderr=True)
    if not visible or not console.is_terminal:
        yield None
        return
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Bar(*columns, console=console) as bar:
        task = bar.add_task(title, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)
