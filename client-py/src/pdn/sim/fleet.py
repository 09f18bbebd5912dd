"""Several flights side by side, each a process and a vehicle of its own."""

from __future__ import annotations

import multiprocessing
import sys
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from pathlib import Path
from typing import cast

from pdn.sim.record import Result


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
    """Fly all, ``jobs`` at a time; leaves a run file for each in the folder. The first failure, or the end of
    a process without a result, ends the others.

    A process holds one session with the daemon, so each flight has a fresh one.
    """
    context = multiprocessing.get_context("spawn")
    waiting = list(reversed(flights))
    running: dict[Connection, tuple[Flight, SpawnProcess]] = {}
    results: dict[Flight, Result] = {}
    with _Bars(flights, visible) as bars:
        try:
            while waiting or running:
                while waiting and len(running) < jobs:
                    flight = waiting.pop()
                    receiver, sender = context.Pipe(duplex=False)
                    file = folder / f"{flight.name}.json"
                    process = context.Process(
                        target=_run_process, args=(flight, scenario, endpoint, file, sender)
                    )
                    process.start()
                    sender.close()  # so that the end of the process is the end of the pipe
                    running[receiver] = (flight, process)
                for ready in wait(list(running)):
                    receiver = cast("Connection", ready)
                    flight, process = running[receiver]
                    result = _receive(receiver, flight, process, bars)
                    if result is not None:
                        results[flight] = result
                        process.join()
                        del running[receiver]
        finally:
            for _, process in running.values():
                process.terminate()
                process.join()
    return [results[flight] for flight in flights]


def _receive(receiver: Connection, flight: Flight, process: SpawnProcess, bars: _Bars) -> Result | None:
    """The next message of a flight: its result, or none while it reports progress."""
    try:
        message = receiver.recv()
    except EOFError:
        process.join()
        raise RuntimeError(f"the flight {flight.name} ended with code {process.exitcode}") from None
    if isinstance(message, BaseException):
        raise message
    if isinstance(message, Result):
        return message
    done, total = message
    bars.show(flight.name, done, total)
    return None


def _run_process(flight: Flight, scenario: str, endpoint: str, out: Path, sender: Connection) -> None:
    try:
        sender.send(_fly_reporting(flight, scenario, endpoint, out, sender))
    except Exception as error:
        try:
            sender.send(error)
        except Exception:  # an error that cannot cross to another process is told in words
            sender.send(RuntimeError(f"{type(error).__name__}: {error}"))


def _fly_reporting(flight: Flight, scenario: str, endpoint: str, out: Path, sender: Connection) -> Result:
    import pdn.client
    from pdn.sim import flight as flying
    from pdn.sim import record, remote
    from pdn.sim.scenario_file import load

    def progress(done: int, total: int) -> None:
        if done % 20 == 0 or done == total:
            sender.send((done, total))

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

    def show(self, name: str, done: int, total: int) -> None:
        """How far a flight is."""
        task = self._tasks[name]
        self._bar.start_task(task)
        self._bar.update(task, completed=done, total=total)
        if self._lines and done == total:
            print(f"{name}: {total} keyframes of the survey flown", file=sys.stderr)
