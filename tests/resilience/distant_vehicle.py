"""A vehicle at the far end of a link that a test cuts: `distant_vehicle.py ENDPOINT KEYFRAMES_PER_S`.

Tells keyframes at that rate and prints a line with the time (s, the machine's monotonic clock), how many
events it has told and how many are durable; it ends, with all of them durable, once its standard input is
closed.
"""

import sys
import threading
import time

import numpy as np
from pdn.client import connect
from pdn.wire import Pose

LEVEL = (0.0, 0.0, 0.0, 1.0)
STEP = Pose(translation=(0.1, 0.0, 0.0), rotation=LEVEL)
COVARIANCE = 1e-4 * np.eye(6)


def main(endpoint: str, rate: str) -> None:
    ended = threading.Event()
    threading.Thread(target=lambda: (sys.stdin.read(), ended.set()), daemon=True).start()
    with connect("auv", endpoint) as client, client.mission_stream(timeout_s=120.0) as events:
        number = 0
        while not ended.wait(1.0 / float(rate)):
            start = Pose(translation=(0.0, 0.0, 8.0), rotation=LEVEL) if number == 0 else None
            events.keyframe(number, start, saliency=(0.5, 0.5))
            if number:
                events.odometry(number - 1, number, STEP, COVARIANCE)
            number += 1
            print(time.monotonic(), events.next_seq, events.durable_seq, flush=True)
        events.flush(120.0)
        print(time.monotonic(), events.next_seq, events.durable_seq, flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
