"""Flies the mission whose journal is `mission.records` against a pdnd, and leaves the journal in a folder.

    PDND_BINARY=.../pdnd python record_journal.py FOLDER

It has decisions in every detail, revisits among them, events that are refused in several ways, a pause, and a daemon that is
killed in its midst.
"""

import json
import sys
from pathlib import Path

import zenoh

TESTS = Path(__file__).resolve().parents[5] / "tests"
sys.path[:0] = [str(TESTS), str(TESTS / "e2e")]

from conftest import Daemon, start_daemon, wait_until  # noqa: E402
from json_zenoh import Json, JsonVehicle, open_session  # noqa: E402
from survey import config, fly  # noqa: E402

DETAILS = ("brief", "choice", "full")


class Flight(JsonVehicle):
    """A vehicle that asks for a decision at each eighth keyframe, and in between makes trouble."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.keyframes = folder, 0
        self.daemon: Daemon = start_daemon(folder)
        self.opened = open_session(self.daemon.endpoint)
        super().__init__(self.opened.__enter__(), "recorded", "mission")

    def event(self, kind: str, body: Json) -> int:
        if kind == "keyframe":
            self.between(self.keyframes)
            self.keyframes += 1
        return super().event(kind, body)

    def between(self, number: int) -> None:
        """Before the keyframe of that number."""
        if number == 20:
            self.trouble()
        if number == 30:
            self.ask("op/pause", {"reason": "to look around"})
            self.ask("op/resume", {"reason": "on with it"})
        if number == 41:
            self.restart()
        if number % 8 == 7:
            self.ask("rpc/decision", after=self.seq - 1, detail=DETAILS[number // 8 % 3])

    def trouble(self) -> None:
        newest = 100 + 3 * (self.keyframes - 1)
        depth = {"keyframe": 999, "depth_m": 8.5, "variance_m2": 4e-4}
        super().event("factor", {"factor": {"depth": depth}})  # of an unknown keyframe
        super().event(
            "factor", {"factor": {"depth": {**depth, "keyframe": newest, "depth_m": 80.0}}}
        )  # contradicts
        super().event("factor", {"factor": {"depth": {**depth, "keyframe": newest, "variance_m2": -1.0}}})
        super().event("link", {"from": newest, "to": newest, "registered": "perhaps"})  # cannot be read
        kind, message = self.events[5]
        other = json.dumps({**message, "stamp_ns": 1}).encode()
        self.put(
            f"in/{kind}", other, zenoh.Encoding.APPLICATION_JSON
        )  # turned away: the number has been used
        step = {"from": newest - 3, "to": newest, "relative": STEP, "covariance": TINY}
        super().event("factor", {"factor": {"odometry": step}})  # too exact to be solved with

    def restart(self) -> None:
        """The daemon is killed once all is durable, and comes back."""
        self.wait_applied()
        wait_until(lambda: self.ask("rpc/ingest")["durable_seq"] == self.seq, "all to be durable")
        self.daemon.process.kill()
        self.daemon.process.wait()
        self.opened.__exit__(None, None, None)
        self.daemon = start_daemon(self.folder)
        self.opened = open_session(self.daemon.endpoint)
        self.session = self.opened.__enter__()
        self.ask("op/resume", {"reason": "back again"})


STEP = {"translation": [0.5, 0.0, 0.0], "rotation": [0.0, 0.0, 0.0, 1.0]}
TINY = [1e-30 if row == column else 0.0 for row in range(6) for column in range(6)]


def main() -> None:
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True)
    flight = Flight(folder)
    flight.ask("op/configure", config("mission"))
    flight.ask("op/start", {"reason": "a journal is to be recorded"})
    fly(flight)
    flight.wait_applied()
    flight.ask("op/complete", {"reason": "the end"})
    flight.opened.__exit__(None, None, None)
    assert flight.daemon.stop() == 0


if __name__ == "__main__":
    main()
