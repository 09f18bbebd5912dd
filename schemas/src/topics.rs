//! What is spoken about on the wire, and with which messages: the source of `schemas/keys.md` and of the
//! Python client's topics.

/// Who speaks, and how.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Role {
    /// `in/`: an event that the vehicle publishes.
    Event,
    /// `rpc/`: a query that changes nothing.
    Question,
    /// `op/`: a query that changes a mission.
    Command,
    /// `out/`: a publication of the service.
    Publication,
    /// `alive/`: a liveliness token.
    Liveliness,
}

/// A parameter of a query: its name and what it says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parameter {
    /// As it stands before the `=`.
    pub name: &'static str,
    /// Values, unit, default.
    pub meaning: &'static str,
}

macro_rules! topics {
    ($(
        $variant:ident $suffix:literal $role:ident ($payload:expr) -> ($reply:expr)
        [$($parameter:expr),*] $doc:literal;
    )+) => {
        /// Something that is spoken about: the part of a key after `pdn/{vehicle}/v1/`.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum Topic { $(#[doc = $doc] $variant,)+ }

        impl Topic {
            /// All topics, in the order of `schemas/keys.md`.
            pub const ALL: &'static [Topic] = &[$(Topic::$variant,)+];

            /// The part of the key after `pdn/{vehicle}/v1/`; a console's ends with its name instead of `*`.
            pub const fn suffix(self) -> &'static str {
                match self { $(Topic::$variant => $suffix,)+ }
            }

            /// Who speaks, and how.
            pub const fn role(self) -> Role {
                match self { $(Topic::$variant => Role::$role,)+ }
            }

            /// Name of the message that the speaker sends, if there is one.
            pub const fn payload(self) -> Option<&'static str> {
                match self { $(Topic::$variant => $payload,)+ }
            }

            /// Name of the message that answers, if there is one.
            pub const fn reply(self) -> Option<&'static str> {
                match self { $(Topic::$variant => $reply,)+ }
            }

            /// Parameters besides [`COMMON_PARAMETERS`].
            pub const fn parameters(self) -> &'static [Parameter] {
                match self { $(Topic::$variant => &[$($parameter),*],)+ }
            }

            /// What it is for, in one sentence.
            pub const fn doc(self) -> &'static str {
                match self { $(Topic::$variant => $doc,)+ }
            }
        }
    };
}

const fn parameter(name: &'static str, meaning: &'static str) -> Parameter {
    Parameter { name, meaning }
}

/// Parameters that every question and command takes.
pub const COMMON_PARAMETERS: &[Parameter] = &[
    parameter("mission", "id of the mission; default the one configured last"),
    parameter("encoding", "`json` (default) or `bincode`, of the reply"),
    parameter("deadline_ms", "the answer is of use only so long after the query's arrival, ms"),
];

const AFTER: Parameter = parameter("after", "answer once the event of this number is applied");
const DETAIL: Parameter = parameter(
    "detail",
    "`full` adds `poses`, `links` and the table of link probabilities; `choice` is `full` with the best \
     candidate alone, and none where exploring is certain, below the allowance; default `brief`",
);
const ALPHA: Parameter = parameter("alpha", "what if: weight of the uncertainty, in [0, 1]");
const SIGMA_XY: Parameter = parameter("sigma_xy_m", "what if: allowance north and east, m");
const SIGMA_DEPTH: Parameter = parameter("sigma_depth_m", "what if: allowance down, m");
const SIGMA_TILT: Parameter = parameter("sigma_tilt_deg", "what if: allowance of roll and pitch, deg");
const SIGMA_HEADING: Parameter = parameter("sigma_heading_deg", "what if: allowance of the heading, deg");
const FROM: Parameter = parameter("from", "keyframes from this id on; default all");
const MARGINALS: Parameter =
    parameter("marginals", "`true` adds each keyframe's covariance; default `false`");

topics! {
    InKeyframe "in/keyframe" Event (Some("Keyframe")) -> (None) []
        "A place where the vehicle took an image.";
    InFactor "in/factor" Event (Some("Factor")) -> (None) []
        "A measurement that ties one or two keyframes.";
    InLink "in/link" Event (Some("LinkOutcome")) -> (None) []
        "Whether a registration that the vehicle tried has succeeded.";
    RpcDecision "rpc/decision" Question (None) -> (Some("Decision"))
        [AFTER, DETAIL, ALPHA, SIGMA_XY, SIGMA_DEPTH, SIGMA_TILT, SIGMA_HEADING]
        "Explore or revisit? With a what-if nothing is counted and any phase will do.";
    RpcEvaluate "rpc/evaluate" Question (Some("EvaluateRequest")) -> (Some("EvaluateReply"))
        [AFTER, DETAIL, ALPHA, SIGMA_XY, SIGMA_DEPTH, SIGMA_TILT, SIGMA_HEADING]
        "Paths that a person drew, evaluated as candidates.";
    RpcMission "rpc/mission" Question (None) -> (Some("MissionState")) [AFTER]
        "The mission as it stands.";
    RpcIngest "rpc/ingest" Question (None) -> (Some("IngestStatus")) []
        "Which events have arrived.";
    RpcGraph "rpc/graph" Question (None) -> (Some("GraphReply")) [AFTER, FROM, MARGINALS]
        "The pose graph.";
    RpcWaypoints "rpc/waypoints" Question (None) -> (Some("WaypointsReply")) [AFTER]
        "Clusters of salient keyframes.";
    RpcCoverage "rpc/coverage" Question (None) -> (Some("CoverageReply")) [AFTER]
        "The coverage raster of each facet.";
    RpcLinkModel "rpc/link_model" Question (None) -> (Some("LinkModelReply")) [AFTER]
        "The table of link probabilities with its counts.";
    OpConfigure "op/configure" Command (Some("MissionConfig")) -> (Some("MissionState")) []
        "A new mission; refused while another of the vehicle is active.";
    OpStart "op/start" Command (Some("Command")) -> (Some("MissionState")) []
        "From `configured` to `running`.";
    OpPause "op/pause" Command (Some("Command")) -> (Some("MissionState")) []
        "From `running` to `paused`.";
    OpResume "op/resume" Command (Some("Command")) -> (Some("MissionState")) []
        "From `paused` or `held` to `running`.";
    OpHold "op/hold" Command (Some("Command")) -> (Some("MissionState")) []
        "From `running` to `held`: no decisions until someone resumes.";
    OpComplete "op/complete" Command (Some("Command")) -> (Some("MissionState")) []
        "Ends the mission as planned.";
    OpAbort "op/abort" Command (Some("Command")) -> (Some("MissionState")) []
        "Ends the mission before its end.";
    OutAck "out/ack" Publication (Some("Ack")) -> (None) []
        "Progress of the events.";
    OutState "out/state" Publication (Some("MissionState")) -> (None) []
        "The mission, on each change and once a second.";
    OutDecided "out/decided" Publication (Some("Decision")) -> (None) []
        "Each decision that was counted.";
    OutRejected "out/rejected" Publication (Some("Problem")) -> (None) []
        "Each event that was refused, and why.";
    AlivePlanner "alive/planner" Liveliness (None) -> (None) []
        "The service is ready; declared last.";
    AliveVehicle "alive/vehicle" Liveliness (None) -> (None) []
        "The vehicle's client library is connected.";
    AliveConsole "alive/console/*" Liveliness (None) -> (None) []
        "An operator's console of that name is connected.";
}

impl Topic {
    /// The topic of that suffix; `alive/console/*` is given for a console of any name.
    pub fn from_suffix(suffix: &str) -> Option<Topic> {
        Topic::ALL.iter().copied().find(|topic| topic.suffix() == suffix)
    }
}
