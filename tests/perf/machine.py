"""What it was measured on."""

import os
import platform
import subprocess
from importlib.metadata import version
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent


def machine() -> dict[str, Any]:
    return {
        "processor": _processor(),
        "processors": os.cpu_count(),
        "memory_gib": round(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") / 2**30, 1),
        "system": f"{platform.system()} {platform.release()}",
        "rustc": _output("rustc", "--version"),
        "commit": _output("git", "describe", "--always", "--dirty"),
        "python": platform.python_version(),
        **{name: version(name) for name in ("gtsam", "cvxopt", "scipy", "numpy")},
        "load": os.getloadavg()[0],
    }


def _processor() -> str:
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.split(":")[1].strip()
    return platform.machine()


def _output(*command: str) -> str:
    try:
        run = subprocess.run(command, capture_output=True, text=True, check=True, timeout=20, cwd=HERE)
    except (OSError, subprocess.SubprocessError):
        return "unknown"
    return run.stdout.strip()
