"""Mission after mission, with clients that come and go: what the daemon takes up does not grow.

A keyframe a second makes an hour's worth of 3,600; compressed, since nothing in the daemon waits for the
clock. Missions that have ended are forgotten beyond `max_missions`, so that from then on memory has no reason
to grow.
"""

from pathlib import Path

import pytest

from attack import descriptors, memory_mib
from conftest import start_daemon, wait_until
from json_zenoh import JsonVehicle, open_session
from survey import config, fly

KEPT_MISSIONS = 2
WARM = 4
"""Missions until as many are kept as ever will be, and the allocator knows its sizes."""

SPARE_MIB = 8
SPARE = 1.10
"""What memory may be above that of the warm daemon: fragments, and the greatest of many instants."""


def fly_one(endpoint: str, mission: str, seed: int) -> int:
    """A whole mission by a session of its own; its keyframes."""
    with open_session(endpoint) as session:
        vehicle = JsonVehicle(session, "auv", mission)
        vehicle.ask("op/configure", config(mission))
        vehicle.ask("op/start", {"reason": "soak"})
        fly(vehicle, seed=seed)
        vehicle.wait_applied()
        vehicle.ask("rpc/decision", detail="full")
        vehicle.ask("rpc/graph", marginals="true")
        state = vehicle.ask("op/complete", {"reason": "soak"})
    return state["keyframes"]


@pytest.mark.timeout(1800)
@pytest.mark.parametrize("missions", [10, pytest.param(64, marks=pytest.mark.torture)])
def test_memory_and_descriptors_stay_flat(tmp_path: Path, missions: int) -> None:
    daemon = start_daemon(tmp_path, "--set", f"max_missions={KEPT_MISSIONS}")
    keyframes, memory, open_files = 0, [], []
    for number in range(missions):
        keyframes += fly_one(daemon.endpoint, f"m-{number}", number)
        wait_until(
            lambda: descriptors(daemon) <= min(open_files, default=10**6) + 1, "the session to be gone"
        )
        memory.append(memory_mib(daemon))
        open_files.append(descriptors(daemon))
    warm_mib = max(memory[:WARM])
    print(
        f"{missions} missions, {keyframes} keyframes: memory {memory[0]:.1f} MiB after the first, "
        f"{warm_mib:.1f} when warm, {max(memory[WARM:]):.1f} at most since, {memory[-1]:.1f} at the end; "
        f"descriptors {open_files[0]} to {open_files[-1]}"
    )
    assert max(memory[WARM:]) <= SPARE * warm_mib + SPARE_MIB
    assert max(open_files) - min(open_files) <= 2
    assert daemon.stop() == 0
