"""Several flights side by side, each a process and a vehicle of its own."""

from __future__ import annotations

import multiprocessing
import queue
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from pdn.sim.record import Result

if TYPE_CHECKING:
    from multiprocessing.queues import Queue

    # Name of a flight, keyframes of the survey flown, of how many.
    News = Queue[tuple[str, int, int]]


@dataclass(frozen=True)
class Flight:
    """What one vehicle flies."""

    policy: str
    alpha: float
    seed: int

    @property
    def name(self) -> str:
        """Of its vehicle, its mission and its file."""
        weight = f"-{round(100 * self.alpha):03d}" if self.policy == "pdn" else ""
        return f"{self.policy}{weight}-seed{self.seed}"


def fly_all(
    flights: list[Flight], scenario: str, endpoint: str, folder: Path, jobs: int, *, visible: bool
) -> list[Result]:
    """Fly all, ``jobs`` at a time; leaves a run file for each in the folder. The first failure ends the
    others.

    A process holds one session with the daemon, so each flight has a fresh one.
    """
    context = multiprocessing.get_context("spawn")
    news: News = context.Queue()
    with (
        _Bars(flights, visible) as bars,
        context.Pool(min(jobs, len(flights)), _begin, (news,), maxtasksperchild=1) as pool,
    ):
        pending = [
            pool.apply_async(_fly, (flight, scenario, endpoint, folder / f"{flight.name}.json"))
            for flight in flights
        ]
        while not all(job.ready() for job in pending):
            bars.drain(news)
            for job in pending:
                if job.ready():
                    job.get()
        bars.drain(news)
        return [job.get() for job in pending]


_news: News | None = None


def _begin(news: News) -> None:
    global _news
    _news = news


def _fly(flight: Flight, scenario: str, endpoint: str, out: Path) -> Result:
    import pdn.client
    from pdn.sim import flight as flying
    from pdn.sim import record, remote
    from pdn.sim.scenario_file import load

    def progress(done: int, total: int) -> None:
        if _news is not None and (done % 20 == 0 or done == total):
            _news.put((flight.name, done, total))

    loaded = load(scenario)
    with (
        pdn.client.connect(flight.name, endpoint) as client,
        remote.mission(client, loaded, flight.name, flight.alpha) as planner,
    ):
        run = flying.fly(loaded, flight.policy, flight.alpha, flight.seed, planner, progress)
    record.save(run, out)
    return run.result


class _Bars:
    """A progress bar for each flight on standard error; where that is no terminal, a line as each ends."""

    def __init__(self, flights: list[Flight], visible: bool) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

        console = Console(stderr=True)
        columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
        self._lines = visible and not console.is_terminal
        self._bar = Progress(*columns, console=console, disable=not visible or not console.is_terminal)
        self._tasks = {f.name: self._bar.add_task(f.name, total=None, start=False) for f in flights}

    def __enter__(self) -> _Bars:
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def drain(self, news: News) -> None:
        """Show what has come, until nothing has come for a fifth of a second."""
        try:
            while True:
                name, done, total = news.get(timeout=0.2)
                task = self._tasks[name]
                self._bar.start_task(task)
                self._bar.update(task, completed=done, total=total)
                if self._lines and done == total:
                    print(f"{name}: {total} keyframes of the survey flown", file=sys.stderr)
        except queue.Empty:
            return
