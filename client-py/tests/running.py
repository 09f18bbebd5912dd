"""A daemon that a test starts, stops and kills."""

from __future__ import annotations

import subprocess
import time
from dataclasses import dataclass
from pathlib import Path


@dataclass
class Daemon:
    """A running pdnd."""

    binary: Path
    endpoint: str
    folder: Path
    process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        """Starts it and waits until it is ready."""
        log = self.folder / "pdnd.log"
        with log.open("ab") as output:
            command = [str(self.binary), "--listen", self.endpoint, "--state-dir", str(self.folder / "state")]
            process = self.process = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT)
        give_up_s = time.monotonic() + 20.0
        health = [str(self.binary), "health", "--connect", self.endpoint]
        while subprocess.run(health, capture_output=True, check=False).returncode != 0:
            assert process.poll() is None, f"pdnd ended with {process.returncode}:\n{log.read_text()}"
            assert time.monotonic() < give_up_s, f"pdnd was not ready within 20 s:\n{log.read_text()}"
            time.sleep(0.02)

    def kill(self) -> None:
        """Ends it as a power cut would."""
        if self.process is not None:
            self.process.kill()
            self.process.wait()

    def signal(self, number: int) -> None:
        """Sends it a signal."""
        assert self.process is not None
        self.process.send_signal(number)
