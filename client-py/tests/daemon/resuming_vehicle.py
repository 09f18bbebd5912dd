"""A vehicle that a test kills and starts again: `resuming_vehicle.py ENDPOINT FOLDER KEYFRAMES`.

What it tells follows from the number of the event alone, so it goes on wherever its outbox says that it
stands.
"""

import sys

import numpy as np

from pdn.client import MissionStream, connect
from pdn.wire import Pose

LEVEL = (0.0, 0.0, 0.0, 1.0)
STEP = Pose(translation=(0.5, 0.0, 0.0), rotation=LEVEL)
ASKS_EVERY = 20
COVARIANCE = 1e-4 * np.eye(6)


def tell(events: MissionStream, seq: int) -> None:
    """Event 0 is the first keyframe; then come a keyframe and its odometry by turns."""
    number = (seq + 1) // 2
    if seq % 2 or seq == 0:
        start = Pose(translation=(0.0, 0.0, 0.0), rotation=LEVEL) if seq == 0 else None
        told = events.keyframe(number, start, saliency=(0.5, 0.5))
    else:
        told = events.odometry(number - 1, number, STEP, COVARIANCE)
    assert told == seq


def main(endpoint: str, folder: str, keyframes: str) -> None:
    with connect("auv", endpoint) as client, client.mission_stream(outbox=folder) as events:
        print(events.next_seq, flush=True)
        for seq in range(events.next_seq, 2 * int(keyframes) - 1):
            tell(events, seq)
            if seq % ASKS_EVERY == 0:
                client.mission(after=seq)


if __name__ == "__main__":
    main(*sys.argv[1:])
