"""A daemon that is killed again and again during missions: what it had said is durable is there, and the
decisions are those of a daemon that was left alone.
"""

import json
import os
import random
import signal
import subprocess
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest
import zenoh

from conftest import free_port, pdnd_binary
from json_zenoh import ErrorReply, JsonVehicle, open_session
from survey import config, fly

Json = dict[str, Any]
DECIDE_EVERY = 30
BATCH = 7


@dataclass
class Script:
    """The events of a mission, made once: what is sent again is the same."""

    mission: str
    events: list[tuple[str, Json]] = field(default_factory=list)

    def event(self, kind: str, body: Json) -> int:
        seq = len(self.events)
        self.events.append((kind, {"mission": self.mission, "seq": seq, "stamp_ns": seq, **body}))
        return seq


def script(mission: str) -> Script:
    made = Script(mission)
    fly(made, lanes=3)
    return made


class Died(Exception):
    """The daemon no longer answers."""


class Life:
    """One daemon from its start to its end, however that comes."""

    def __init__(self, folder: Path, delay_s: float | None, *, from_start: bool = False) -> None:
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self.log = folder / "pdnd.log"
        command = [str(pdnd_binary()), "-l", self.endpoint, "--state-dir", str(folder / "state")]
        with self.log.open("ab") as output:
            self.process = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT)
        self._delay_s = delay_s
        if from_start:
            self.arm()

    def arm(self) -> None:
        """From now on the daemon has so long to live."""
        if self._delay_s is not None:
            threading.Timer(self._delay_s, self.process.send_signal, [signal.SIGKILL]).start()
            self._delay_s = None

    def await_ready(self) -> None:
        end = time.monotonic() + 30.0
        while time.monotonic() < end:
            health = [str(pdnd_binary()), "health", "-e", self.endpoint, "--timeout-ms", "500"]
            if self.process.poll() is not None:
                raise Died
            if subprocess.run(health, capture_output=True, check=False).returncode == 0:
                return
        raise AssertionError(f"pdnd is not ready:\n{self.log.read_text()[-3000:]}")


@dataclass
class Mission:
    """What the vehicle and its operator know of their mission."""

    script: Script
    durable: int = 0
    decisions: dict[int, str] = field(default_factory=dict)
    configured: bool = False
    started: bool = False
    completed: bool = False

    def fly(self, session: zenoh.Session, life: Life) -> None:
        """Goes on from where the daemon is, to the end."""
        vehicle = JsonVehicle(session, "auv", self.script.mission)
        ask = Requester(vehicle, life)
        if not self.configured:
            ask.once("op/configure", config(self.script.mission), "repeated_id", "illegal_transition")
            self.configured = True
        state = ask("rpc/mission", mission=self.script.mission)
        status = ask("rpc/ingest", mission=self.script.mission)
        assert status["next_seq"] >= self.durable, f"{status} after {self.durable} were durable"
        assert state["decisions"] >= len(self.decisions)
        if self.started:
            assert state["phase"] in ("held", "running", "completed"), state["phase"]
        if state["phase"] in ("configured", "held"):
            ask(
                "op/start" if state["phase"] == "configured" else "op/resume",
                {"reason": "the vehicle is well"},
            )
        self.started = True
        life.arm()
        next_seq = status["next_seq"]
        events = self.script.events
        while next_seq < len(events):
            decide_at = next_seq // DECIDE_EVERY * DECIDE_EVERY + DECIDE_EVERY - 1
            until = min(next_seq + BATCH, len(events), decide_at + 1)
            for kind, message in events[next_seq:until]:
                vehicle.put(f"in/{kind}", json.dumps(message).encode(), zenoh.Encoding.APPLICATION_JSON)
            if until == decide_at + 1:
                self.decide(ask, until - 1)
            ask("rpc/mission", after=until - 1, mission=self.script.mission)
            next_seq = self.ingested(ask, until if next_seq % 2 else 0)
        if state["phase"] != "completed":
            ask.once("op/complete", {"reason": "all is photographed"}, "illegal_transition")
        self.completed = True

    def ingested(self, ask: "Requester", durable: int) -> int:
        """The next event once those below `durable` are durable; remembers what the daemon has promised."""
        end = time.monotonic() + 30.0
        while True:
            status = ask("rpc/ingest", mission=self.script.mission)
            self.durable = max(self.durable, status["durable_seq"])
            if status["durable_seq"] >= durable:
                return int(status["next_seq"])
            assert time.monotonic() < end, f"{status}, but {durable} should be durable"

    def decide(self, ask: "Requester", after: int) -> None:
        decision = ask("rpc/decision", after=after, detail="full", mission=self.script.mission)
        text = plain(decision)
        assert decision["graph_seq"] == after + 1
        assert self.decisions.setdefault(after, text) == text, f"the decision after event {after} is another"


@dataclass
class Requester:
    """Asks again until there is an answer, as long as the daemon lives."""

    vehicle: JsonVehicle
    life: Life

    def __call__(self, key: str, payload: Json | None = None, **parameters: Any) -> Json:
        end = time.monotonic() + 60.0
        while True:
            try:
                return self.vehicle.ask(key, payload, timeout_s=1.0, **parameters)
            except (AssertionError, zenoh.ZError, json.JSONDecodeError):
                # No answer, no link, or the word of a router that the daemon has gone.
                if self.life.process.poll() is not None:
                    raise Died from None
                assert time.monotonic() < end, f"{key} is not answered"

    def once(self, key: str, payload: Json, *done_already: str) -> None:
        """A command that a daemon may have carried out and answered to nobody: it is refused then by these
        codes.
        """
        try:
            self(key, payload)
        except ErrorReply as error:
            if error.code not in done_already:
                raise


def plain(decision: Json) -> str:
    """A decision without what may differ: equal text is equal bits."""
    left_out = ("timing", "mission", "decision")
    decision["link_model"].pop("mission")
    return json.dumps({name: value for name, value in decision.items() if name not in left_out})


def undisturbed(folder: Path) -> dict[int, str]:
    folder.mkdir()
    life, mission = Life(folder, None), Mission(script("m-0"))
    try:
        life.await_ready()
        with open_session(life.endpoint) as session:
            mission.fly(session, life)
    finally:
        life.process.terminate()
        assert life.process.wait(timeout=20) == 0
    assert mission.completed
    assert len(mission.decisions) >= 5
    return mission.decisions


@pytest.mark.timeout(3600)
@pytest.mark.parametrize("kills", [6, pytest.param(200, marks=pytest.mark.torture)])
def test_a_daemon_that_is_killed_loses_nothing(tmp_path: Path, kills: int) -> None:
    expected = undisturbed(tmp_path / "undisturbed")
    chance = random.Random(kills)
    killed, begun, missions = 0, 0, [Mission(script("m-0"))]
    slowest_s = 0.0
    while killed < kills or not missions[-1].completed:
        # Most die while events and decisions come, some while they come back.
        last = killed >= kills
        from_start = chance.random() < 0.2
        delay_s = None if last else chance.uniform(0.02, 0.12) if from_start else chance.uniform(0.0, 0.5)
        begun_at = time.monotonic()
        life = Life(tmp_path, delay_s, from_start=from_start)
        begun += 1
        try:
            life.await_ready()
            slowest_s = max(slowest_s, time.monotonic() - begun_at)
            with open_session(life.endpoint) as session:
                while not missions[-1].completed or not last:
                    if missions[-1].completed:
                        missions.append(Mission(script(f"m-{len(missions)}")))
                    missions[-1].fly(session, life)
        except (Died, zenoh.ZError):
            assert life.process.wait(timeout=20) == -signal.SIGKILL, life.log.read_text()[-3000:]
            killed += 1
            continue
        life.process.terminate()
        assert life.process.wait(timeout=20) == 0
    for mission in missions:
        assert mission.decisions == {seq: expected[seq] for seq in mission.decisions}
    replayed = 0
    for journal in sorted((tmp_path / "state" / "auv").glob("*.redb")):
        replay = subprocess.run(
            [str(pdnd_binary()), "replay", str(journal)], capture_output=True, text=True, check=False
        )
        assert replay.returncode == 0, replay.stdout + replay.stderr
        replayed += 1
    assert replayed == len(missions)
    answered = sum(len(mission.decisions) for mission in missions)
    durable = sum(mission.durable for mission in missions)
    print(
        f"\n{killed} kills over {len(missions)} missions: 0 of {durable} durable events and 0 of {answered} "
        f"answered decisions lost, all decisions as undisturbed; slowest start to ready {slowest_s:.2f} s on "
        f"{os.cpu_count()} cores"
    )
