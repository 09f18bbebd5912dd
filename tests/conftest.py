"""What several tests need: a daemon of their own on loopback, and the shared real data."""

import os
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


def shared_data(*parts: str) -> Path:
    """A file of the shared real data; the test is skipped, saying where it looked, if it is missing."""
    path = Path(os.environ.get("PDN_SHARED", ROOT.parent / "shared")) / "data" / Path(*parts)
    if not path.exists():
        pytest.skip(f"needs real data that is not here: looked for {path}; set PDN_SHARED to its folder")
    return path


def wait_until(condition: Callable[[], bool], what: str, bound_s: float = 20.0) -> None:
    """Waits for a condition, with a bound."""
    end = time.monotonic() + bound_s
    while not condition():
        assert time.monotonic() < end, f"waited {bound_s} s in vain for {what}"
        time.sleep(0.01)


def outage(duration_s: float) -> None:
    """Lets an outage last: its length is what the test gives, not a wait for something to happen."""
    time.sleep(duration_s)


@pytest.fixture(params=["ratios", pytest.param("figures", marks=pytest.mark.torture)])
def quiet_machine(request: pytest.FixtureRequest) -> bool:
    """Whether a test may also ask for its figures in seconds, which the machine's load decides.

    `make test` may run on a busy machine and compares with what that does at the same moment; `make torture`
    wants a quiet one.
    """
    return request.param == "figures"


@dataclass
class Daemon:
    """A running pdnd."""

    endpoint: str
    process: subprocess.Popen[bytes]
    log: Path

    def stop(self) -> int:
        """Asks it to end and gives its exit code."""
        self.process.terminate()
        return self.process.wait(timeout=20)


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def pdnd_binary() -> Path:
    binary = Path(os.environ.get("PDND_BINARY", ROOT / "target/release/pdnd"))
    assert binary.exists(), f"{binary} is missing: run `make build`, or set PDND_BINARY"
    return binary


def start_daemon(folder: Path, *arguments: str, protocol: str = "tcp") -> Daemon:
    """Starts pdnd on a free port and waits until `pdnd health` finds it ready."""
    endpoint = f"{protocol}/127.0.0.1:{free_port()}"
    log = folder / "pdnd.log"
    command = [str(pdnd_binary()), "--listen", endpoint, "--state-dir", str(folder / "state"), *arguments]
    with log.open("wb") as output:
        process = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT)

    def ready() -> bool:
        assert process.poll() is None, f"pdnd ended with {process.returncode}:\n{log.read_text()}"
        health = [str(pdnd_binary()), "health", "--connect", endpoint, *arguments]
        return subprocess.run(health, capture_output=True, check=False).returncode == 0

    wait_until(ready, "pdnd to be ready")
    return Daemon(endpoint, process, log)


@pytest.fixture(scope="module")
def daemon(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Daemon]:
    """One daemon for the tests of a module, each of which takes a vehicle name of its own."""
    running = start_daemon(tmp_path_factory.mktemp("pdnd"))
    yield running
    assert running.stop() == 0, running.log.read_text()
