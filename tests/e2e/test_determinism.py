"""Same events, same decisions, bit for bit, whatever the number of threads and whoever asks in between."""

import json
from pathlib import Path
from typing import Any

import pytest

from conftest import start_daemon
from json_zenoh import JsonVehicle, open_session
from survey import config, fly

Json = dict[str, Any]


class Curious(JsonVehicle):
    """Asks a question after every few events, which must not change any later answer."""

    def event(self, kind: str, body: Json) -> int:
        seq = super().event(kind, body)
        if seq % 5 == 2:
            self.ask("rpc/mission", after=seq)
        if seq % 31 == 7:
            self.ask("rpc/graph", after=seq, marginals="true")
        return seq


def decisions(folder: Path, threads: int, kind: type[JsonVehicle]) -> list[str]:
    """Decisions during and after a survey, without their timing, as text: equal text is equal bits."""
    running = start_daemon(folder, "--set", f"planner_threads={threads}")
    found: list[Json] = []
    try:
        with open_session(running.endpoint) as session:
            vehicle = kind(session, "same", "same-1")
            vehicle.ask("op/configure", config("same-1"))
            vehicle.ask("op/start", {"reason": "test"})
            fly(vehicle, lanes=3)
            found.append(vehicle.ask("rpc/decision", after=vehicle.seq - 1, detail="full"))
            found.append(vehicle.ask("rpc/decision", alpha=0.3, detail="full"))
            found.append(vehicle.ask("rpc/graph", marginals="true"))
    finally:
        running.stop()
    return [json.dumps({name: value for name, value in reply.items() if name != "timing"}) for reply in found]


@pytest.mark.parametrize(("threads", "kind"), [(1, Curious), (2, JsonVehicle), (4, Curious)])
def test_decisions_do_not_depend_on_threads_or_questions(
    tmp_path: Path, threads: int, kind: type[JsonVehicle]
) -> None:
    reference = tmp_path / "reference"
    reference.mkdir()
    assert decisions(tmp_path, threads, kind) == decisions(reference, 1, JsonVehicle)
