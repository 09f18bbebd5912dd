"""The client library: connect a vehicle or an operator's program to the planner.

    import pdn.client

    with pdn.client.connect("auv-1") as client:
        client.configure({"mission": "hull-7", "target": {"facets": [...]}})
        client.start("survey begins")
        with client.mission_stream() as events:
            events.keyframe(0, pose, saliency=(0.8, 0.3))
            seq = events.keyframe(1, saliency=(0.7, 0.3))
            ...
            print(client.decision(after=seq).reason)

Reading order: `client`, `questions` and `commands` (what can be asked), `stream` and `events` (what a vehicle
sends), `sender`, `outbox` and `outbox_file` (why nothing is lost), `watch`, `vehicle_session`, `session` and
`lifetime` (Zenoh), `certificates` and `diagnosis` (why it does not work), `errors`.
"""

from .client import Client, connect, split_endpoints
from .diagnosis import DEFAULT_ENDPOINT, DEFAULT_VEHICLE
from .errors import (
    BadReply,
    Closed,
    Conflict,
    ConnectionFailed,
    DeadlineMissed,
    EventsRefused,
    Forked,
    IllegalTransition,
    MissionGap,
    MissionLost,
    MissionUnknown,
    NotAllowed,
    OutboxFull,
    OutboxUnusable,
    Overloaded,
    PdnError,
    PlannerAbsent,
    Refused,
    StreamBroken,
    Timeout,
    TwoPublishers,
)
from .stream import MissionStream
from .watch import PlannerPresence, Watch, Watched

__all__ = [
    "DEFAULT_ENDPOINT",
    "DEFAULT_VEHICLE",
    "BadReply",
    "Client",
    "Closed",
    "Conflict",
    "ConnectionFailed",
    "DeadlineMissed",
    "EventsRefused",
    "Forked",
    "IllegalTransition",
    "MissionGap",
    "MissionLost",
    "MissionStream",
    "MissionUnknown",
    "NotAllowed",
    "OutboxFull",
    "OutboxUnusable",
    "Overloaded",
    "PdnError",
    "PlannerAbsent",
    "PlannerPresence",
    "Refused",
    "StreamBroken",
    "Timeout",
    "TwoPublishers",
    "Watch",
    "Watched",
    "connect",
    "split_endpoints",
]
