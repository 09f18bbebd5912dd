"""Topics, codes of refusals, and the layout hash and size limit of every message.

Generated from the types in `schemas/src` by `cargo run --release -p pdn-schemas -- generate`.
"""

# fmt: off

from enum import StrEnum

ROOT = "pdn"
VERSION = "v1"


class Topic(StrEnum):
    """What is spoken about: the part of a key after the version."""

    IN_KEYFRAME = "in/keyframe"
    """A place where the vehicle took an image."""

    IN_FACTOR = "in/factor"
    """A measurement that ties one or two keyframes."""

    IN_LINK = "in/link"
    """Whether a registration that the vehicle tried has succeeded."""

    RPC_DECISION = "rpc/decision"
    """Explore or revisit? With a what-if nothing is counted and any phase will do."""

    RPC_EVALUATE = "rpc/evaluate"
    """Paths that a person drew, evaluated as candidates."""

    RPC_MISSION = "rpc/mission"
    """The mission as it stands."""

    RPC_INGEST = "rpc/ingest"
    """Which events have arrived."""

    RPC_GRAPH = "rpc/graph"
    """The pose graph."""

    RPC_WAYPOINTS = "rpc/waypoints"
    """Clusters of salient keyframes."""

    RPC_COVERAGE = "rpc/coverage"
    """The coverage raster of each facet."""

    RPC_LINK_MODEL = "rpc/link_model"
    """The table of link probabilities with its counts."""

    OP_CONFIGURE = "op/configure"
    """A new mission; refused while another of the vehicle is active."""

    OP_START = "op/start"
    """From `configured` to `running`."""

    OP_PAUSE = "op/pause"
    """From `running` to `paused`."""

    OP_RESUME = "op/resume"
    """From `paused` or `held` to `running`."""

    OP_HOLD = "op/hold"
    """From `running` to `held`: no decisions until someone resumes."""

    OP_COMPLETE = "op/complete"
    """Ends the mission as planned."""

    OP_ABORT = "op/abort"
    """Ends the mission before its end."""

    OUT_ACK = "out/ack"
    """Progress of the events."""

    OUT_STATE = "out/state"
    """The mission, on each change and once a second."""

    OUT_DECIDED = "out/decided"
    """Each decision that was counted."""

    OUT_REJECTED = "out/rejected"
    """Each event that was refused, and why."""

    ALIVE_PLANNER = "alive/planner"
    """The service is ready; declared last."""

    ALIVE_VEHICLE = "alive/vehicle"
    """The vehicle's client library is connected."""

    ALIVE_CONSOLE = "alive/console/*"
    """An operator's console of that name is connected."""


class Code(StrEnum):
    """Why something was refused."""

    INVALID = "invalid"
    """The payload or a parameter cannot be read as what the key asks for.

    Mend the field that the message names; a client with generated messages cannot send this.
    """

    SCHEMA_MISMATCH = "schema_mismatch"
    """The encoding names another message, version or layout than this service reads under the key.

    Install client and service of the same version; without the hash the layout is not compared.
    """

    TOO_LARGE = "too_large"
    """The payload is larger than the limit for its kind.

    Send less at once: fewer descriptors, paths or points.
    """

    UNSUPPORTED = "unsupported"
    """The request is well formed, but this version cannot do it.

    Look in the changelog for the version that can, or leave the field out.
    """

    NOT_FINITE = "not_finite"
    """A number is infinite or not a number.

    Look where the sender computes the field that the message names.
    """

    NOT_UNIT = "not_unit"
    """A quaternion or direction does not have length 1 within 1e-6.

    Normalise it before sending.
    """

    NOT_POSITIVE_DEFINITE = "not_positive_definite"
    """A covariance is not symmetric or not positive definite.

    Send the full matrix row by row, variances in m^2 and rad^2, none of them zero.
    """

    OUT_OF_RANGE = "out_of_range"
    """A number lies outside the range that its field allows.

    The message names the field, the value and the range.
    """

    DEGENERATE_BASELINE = "degenerate_baseline"
    """The two cameras of a camera factor are closer than `min_baseline_m`, so its direction means nothing.

    Leave the factor out, or register images that are farther apart.
    """

    UNKNOWN_KEYFRAME = "unknown_keyframe"
    """The event or question names a keyframe that the mission does not have.

    Send a keyframe before the factors and outcomes that name it.
    """

    REPEATED_ID = "repeated_id"
    """The id of a keyframe or mission has been used before.

    Give every keyframe of a mission, and every mission of a vehicle, an id of its own.
    """

    CONFLICT = "conflict"
    """An event with this number but other content has been received before.

    Two senders share a mission, or one restarted its numbers: ask `rpc/ingest` where to go on.
    """

    SINGULAR = "singular"
    """With this event the graph could not be solved, or a covariance that was asked for cannot be computed.

    Check the covariances that the message names; tie the keyframe by a prior, odometry or relative factor.
    """

    CONTRADICTION = "contradiction"
    """The measurement lies so far from what the graph says of its keyframes that it cannot be true.

    Check how it was made; a robust loss for its kind in the configuration weighs outliers down instead.
    """

    LIMIT = "limit"
    """A bound on counts is reached; `limits` names it.

    The message names the bound; if it is events that wait, send the missing ones first.
    """

    UNKNOWN_VEHICLE = "unknown_vehicle"
    """The service has heard nothing of this vehicle.

    Check the vehicle's id in the key, and configure a mission.
    """

    UNKNOWN_MISSION = "unknown_mission"
    """The vehicle has no mission of this id.

    Check the id, and configure the mission before sending its events.
    """

    NO_MISSION = "no_mission"
    """The vehicle has no mission yet.

    Configure one with `op/configure`.
    """

    MISSION_ENDED = "mission_ended"
    """The mission is completed or aborted; it can be read but takes nothing more.

    Configure a new mission.
    """

    ILLEGAL_TRANSITION = "illegal_transition"
    """The phase of the mission does not allow this.

    The message names the phase and the commands that are legal in it.
    """

    NOT_READY = "not_ready"
    """The question has no answer yet, or the service is starting or shutting down.

    The message says what is missing; send it, or ask again.
    """

    DEADLINE = "deadline"
    """The answer was not ready by the deadline.

    Ask again with a later `deadline_ms`, or with a smaller `after`.
    """

    OVERLOADED = "overloaded"
    """A queue of the service is full; the request was not looked at.

    Ask again after a while; events are sent again by the client's outbox.
    """

    NOT_DURABLE = "not_durable"
    """The journal cannot be written now, and this must be recorded before it is answered.

    Make room on the disk that the message names, or mend it; the service tries again by itself.
    """

    JOURNAL_DAMAGED = "journal_damaged"
    """The journal of the mission is damaged; it is kept as it is, and the mission is not served.

    `pdnd recover` with the file that the message names saves what is whole, up to the damage.
    """

    JOURNAL_UNREADABLE = "journal_unreadable"
    """The journal of the mission cannot be read by this user, or by this version of the service.

    The message says which: give the service access, or read it with the version that wrote it.
    """

    INTERNAL = "internal"
    """The service has a fault.

    Report it with the message and the service's log.
    """


LAYOUT_HASHES: dict[str, str] = {
    "Keyframe": "9b996744c8ce3ce6",
    "Factor": "9c0a6375dd43b8b9",
    "LinkOutcome": "eb06f3d26eab1bb4",
    "MissionConfig": "14399e7971cc3419",
    "Command": "3d4c3f10be4ee076",
    "EvaluateRequest": "5729dce40075a8ac",
    "MissionState": "c72e77a4359b38c4",
    "IngestStatus": "be6771bf7eb19c90",
    "Ack": "679eb1051f02c518",
    "Problem": "ae41daebb06fe784",
    "Decision": "0180d86734e8f810",
    "EvaluateReply": "dd5f5f3dbd74ebd9",
    "GraphReply": "fa0782ba2ec407a2",
    "WaypointsReply": "1ceb87d2e37077dc",
    "CoverageReply": "fa3f2fbce30c6ecc",
    "LinkModelReply": "0f63ef40593b909f",
}

MAX_BYTES: dict[str, int] = {
    "Keyframe": 4194304,
    "Factor": 4194304,
    "LinkOutcome": 4194304,
    "MissionConfig": 4194304,
    "Command": 4194304,
    "EvaluateRequest": 4194304,
    "MissionState": 67108864,
    "IngestStatus": 67108864,
    "Ack": 67108864,
    "Problem": 67108864,
    "Decision": 67108864,
    "EvaluateReply": 67108864,
    "GraphReply": 67108864,
    "WaypointsReply": 67108864,
    "CoverageReply": 67108864,
    "LinkModelReply": 67108864,
}
