"""The contract in Python: messages, how they are written and read, keys, codes and limits.

    >>> from pdn import wire
    >>> keyframe = wire.Keyframe(
    ...     mission="m",
    ...     seq=0,
    ...     stamp_ns=0,
    ...     id=1,
    ...     pose=wire.Pose(translation=(0.0, 0.0, 5.0), rotation=(0.0, 0.0, 0.0, 1.0)),
    ...     appearance=wire.Appearance.Saliency(local=0.5, global_=0.2),
    ... )
    >>> payload = wire.encode(keyframe)
    >>> wire.decode(wire.Keyframe, payload) == keyframe
    True
    >>> wire.key("auv-1", wire.Topic.IN_KEYFRAME)
    'pdn/auv-1/v1/in/keyframe'

**Messages** are frozen `msgspec.Struct`s named as in Rust, their fields as in the documents; `from` and
`global` are reserved in Python and called `from_` and `global_` here. An absent optional is `None`, which
is its default, and a field with a default in the contract has it here: `MissionConfig(mission="m",
target=...)` is complete. A type with optional fields before required ones takes keywords only. Lists and
matrices are tuples (`row_major(matrix)` makes one of a numpy array). `msgspec.structs.replace(message,
seq=7)` copies with changes.

**Enums** without content are `StrEnum`s (`Phase.RUNNING == "running"`). Enums with content are namespaces
of variants: `FactorKind.Odometry(from_=1, to=2, relative=..., covariance=...)`, `Loss.Cauchy(2.385)`,
`Loss.None_()`; the type of a value is `AnyFactorKind`, `AnyLoss`, ..., and `match` and `isinstance` tell
the variants apart.

**Codec**: `encode(message)` and `decode(Kind, payload)` speak bincode, or JSON with `Format.JSON`.
`encoding(Kind)` is the text for Zenoh's encoding, `format_of(Kind, encoding)` reads one. `to_json`,
`from_json`, `from_toml`, `to_plain` and `from_plain` (dicts, lists and numbers) work for every type of the
contract, not only for messages.

**Names**: `Topic`, `key(vehicle, topic)`, `console_key(vehicle, name)`, `parse_key(text)`, `Code`,
`limits.EVENT_WINDOW`.

**Errors**: all of the above raise `WireError` with `code` (a `Code`) and a message that says what is wrong
and where.
"""

from . import limits
from .arrays import row_major
from .codec import (
    Format,
    decode,
    encode,
    encoding,
    format_of,
    from_json,
    from_plain,
    from_toml,
    to_json,
    to_plain,
)
from .errors import WireError
from .keys import Key, check_id, console_key, every_vehicle, key, parse_key
from .messages import (
    Ack,
    Action,
    Allowable,
    AnyAction,
    AnyAppearance,
    AnyFactorKind,
    AnyLoss,
    Appearance,
    Attitude,
    Camera,
    Candidate,
    Command,
    CoverageReply,
    Criterion,
    Decision,
    Depth,
    EvaluateReply,
    EvaluateRequest,
    Exploration,
    Facet,
    FacetCoverage,
    Factor,
    FactorKind,
    FirstKeyframeSigmas,
    GraphKeyframe,
    GraphReply,
    Health,
    IngestStatus,
    Keyframe,
    LinkBin,
    LinkModel,
    LinkModelReply,
    LinkOutcome,
    Loss,
    MissionConfig,
    MissionState,
    Odometry,
    Phase,
    Planner,
    Policy,
    Pose,
    Problem,
    Robot,
    Robust,
    Target,
    Timing,
    Waypoint,
    WaypointsReply,
)
from .names import Code, Topic

__all__ = [
    "Ack",
    "Action",
    "Allowable",
    "AnyAction",
    "AnyAppearance",
    "AnyFactorKind",
    "AnyLoss",
    "Appearance",
    "Attitude",
    "Camera",
    "Candidate",
    "Code",
    "Command",
    "CoverageReply",
    "Criterion",
    "Decision",
    "Depth",
    "EvaluateReply",
    "EvaluateRequest",
    "Exploration",
    "Facet",
    "FacetCoverage",
    "Factor",
    "FactorKind",
    "FirstKeyframeSigmas",
    "Format",
    "GraphKeyframe",
    "GraphReply",
    "Health",
    "IngestStatus",
    "Key",
    "Keyframe",
    "LinkBin",
    "LinkModel",
    "LinkModelReply",
    "LinkOutcome",
    "Loss",
    "MissionConfig",
    "MissionState",
    "Odometry",
    "Phase",
    "Planner",
    "Policy",
    "Pose",
    "Problem",
    "Robot",
    "Robust",
    "Target",
    "Timing",
    "Topic",
    "Waypoint",
    "WaypointsReply",
    "WireError",
    "check_id",
    "console_key",
    "decode",
    "encode",
    "encoding",
    "every_vehicle",
    "format_of",
    "from_json",
    "from_plain",
    "from_toml",
    "key",
    "limits",
    "parse_key",
    "row_major",
    "to_json",
    "to_plain",
]
