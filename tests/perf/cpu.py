"""CPU time and memory of this process."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import ParamSpec, TypeVar

Arguments = ParamSpec("Arguments")
Result = TypeVar("Result")


def timed(
    work: Callable[Arguments, Result], *arguments: Arguments.args, **named: Arguments.kwargs
) -> tuple[Result, float]:
    """The result of work(*arguments), and the CPU time of all threads of this process, ms."""
    start = time.process_time_ns()
    result = work(*arguments, **named)
    return result, (time.process_time_ns() - start) * 1e-6


def resident_mb() -> float:
    return _status_mb("VmRSS:")


def peak_mb() -> float:
    return _status_mb("VmHWM:")


def forget_peak() -> None:
    """Lets the most that was ever held count from now on."""
    Path("/proc/self/clear_refs").write_text("5")


def _status_mb(field: str) -> float:
    for line in Path("/proc/self/status").read_text().splitlines():
        if line.startswith(field):
            return float(line.split()[1]) * 1024e-6
    raise RuntimeError(f"/proc/self/status has no {field}")
