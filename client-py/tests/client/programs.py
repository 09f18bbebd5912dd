"""Programs that end in other ways than well, each a process of its own; the endpoint is its argument."""

from __future__ import annotations

import subprocess
import sys
import time

BOUND_S = 60.0
"""Longest wait for the end of a program that ends by itself within some 15 s: far above, for a busy machine,
and short of the hour and more that each of these took before.
"""

PRELUDE = """
import os, signal, sys, threading, time
from pdn import wire
from pdn.client import *

FACET = {"origin": [0, 0, 0], "u": [1, 0, 0], "v": [0, 1, 0], "length_u_m": 10, "length_v_m": 10}
endpoint = sys.argv[1]

def begin(vehicle="auv"):
    client = connect(vehicle, endpoint, timeout_s=5.0)
    client.configure({"mission": f"m{time.time_ns()}", "target": {"facets": [FACET]}})
    client.start("a test")
    return client

def told(call, *arguments, **named):
    try:
        print("returned", call(*arguments, **named), flush=True)
    except Exception as error:
        print(type(error).__name__, isinstance(error, PdnError), error, flush=True)

def in_child(work):
    pid = os.fork()
    if pid == 0:
        work()
        sys.exit(0)
    _, status = os.waitpid(pid, 0)
    print("child", os.waitstatus_to_exitcode(status), flush=True)
"""


def start(program: str, endpoint: str) -> subprocess.Popen[str]:
    """Starts a program; its output is collected."""
    return subprocess.Popen(
        [sys.executable, "-c", PRELUDE + program, endpoint],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def end(process: subprocess.Popen[str]) -> tuple[int, str, str]:
    """Exit code, output and errors once it has ended; fails, and ends it, if it does not."""
    try:
        out, err = process.communicate(timeout=BOUND_S)
    except subprocess.TimeoutExpired:
        process.kill()
        out, err = process.communicate()
        raise AssertionError(f"it did not end within {BOUND_S} s:\n{out}\n{err}") from None
    return process.returncode, out, err


def run(program: str, endpoint: str) -> tuple[int, str, str]:
    """Runs a program to its end."""
    return end(start(program, endpoint))


def until_asleep(pid: int) -> None:
    """Waits until the program's first thread sleeps, in the call that is to be interrupted."""
    give_up_s = time.monotonic() + BOUND_S
    asleep = 0
    while asleep < 5:
        with open(f"/proc/{pid}/stat", encoding="ascii", errors="replace") as stat:
            asleep = asleep + 1 if stat.read().rpartition(")")[2].split()[0] == "S" else 0
        assert time.monotonic() < give_up_s, "it never waits"
        time.sleep(0.01)
