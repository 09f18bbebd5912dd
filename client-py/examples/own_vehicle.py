"""A vehicle of one's own, whole: it tells the planner what it sees and measures, and asks where to go.

Run the daemon (`pdnd`), then: python own_vehicle.py [ENDPOINT]
"""

import sys
import time

import numpy as np

from pdn.client import connect
from pdn.wire import Action, Pose

LEVEL = (0.0, 0.0, 0.0, 1.0)  # Quaternion [x, y, z, w]; the world is north, east, down.
START = Pose(translation=(0.0, 0.0, 6.5), rotation=LEVEL)
STEP = Pose(translation=(0.5, 0.0, 0.0), rotation=LEVEL)  # Half a metre ahead, in the body frame.
STEP_COVARIANCE = np.diag([0.01, 0.01, 0.01, 0.001, 0.001, 0.001]) ** 2  # [m; rad]
SEA_FLOOR = {"origin": [-2, -2, 8], "u": [0, 1, 0], "v": [1, 0, 0], "length_u_m": 4, "length_v_m": 16}

with connect("my-vehicle", *sys.argv[1:]) as client:
    client.configure({"mission": f"dive-{time.time_ns()}", "target": {"facets": [SEA_FLOOR]}})
    client.start("the first dive")
    with client.mission_stream() as events:  # Resends until the planner has everything.
        for k in range(24):
            texture = 0.9 if k < 8 else 0.2  # How rich the image is; the sea floor is bare further north.
            events.keyframe(k, START if k == 0 else None, saliency=(texture, 0.5))
            if k > 0:
                events.odometry(k - 1, k, STEP, STEP_COVARIANCE)
            events.attitude(k, LEVEL, tilt_variance_rad2=0.004**2, heading_variance_rad2=0.004**2)
            last = events.depth(k, 6.5, variance_m2=0.02**2)
        decision = client.decision(after=last)
        print(decision.reason)
        match decision.action:
            case Action.Revisit(candidate=k, keyframe=waypoint):
                print(f"go to keyframe {waypoint} along {decision.candidates[k - 1].path}, and come back")
            case Action.Explore():
                print("go on with the survey")
    client.complete("the end of the example")
