//! Why an event, a command or a question is refused: what is wrong, where, and what to do.

pub(crate) mod translate;

use crate::journal::JournalError;
use crate::lifecycle::{IllegalTransition, how_to_run, name};
use pdn_schemas::problem::Code;
use pdn_schemas::reply::{Phase, Problem};

/// Everything that a mission can refuse. The text of each is one sentence for a person; [`StateError::code`]
/// is what programs go by.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StateError {
    /// A vehicle without any mission was asked something.
    #[error("this vehicle has no mission yet; send a MissionConfig to op/configure")]
    NoMission,
    /// No mission of that id is kept.
    #[error(
        "mission \"{mission}\" is not known; the missions kept are [{}]; configure it first",
        .kept.join(", ")
    )]
    UnknownMission {
        /// The id asked for.
        mission: String,
        /// The ids that would have been found.
        kept: Vec<String>,
    },
    /// A mission of an earlier run is not served.
    #[error("{}", absent(.mission, .why))]
    Absent {
        /// The mission.
        mission: String,
        /// Why.
        why: Absence,
    },
    /// A journal cannot be read or written.
    #[error("the journal {file}: {error}")]
    Journal {
        /// The file.
        file: String,
        /// Why.
        error: JournalError,
    },
    /// Another mission is under way.
    #[error("mission \"{mission}\" is {}; complete or abort it before configuring another", name(*.phase))]
    MissionActive {
        /// The mission under way.
        mission: String,
        /// Its phase.
        phase: Phase,
    },
    /// An id is used a second time.
    #[error("mission id \"{mission}\" has been used; choose an id that this vehicle never had")]
    MissionUsed {
        /// The id.
        mission: String,
    },
    /// The mission has ended and takes no more events.
    #[error("mission \"{mission}\" is {}; configure a new mission to send more events", name(*.phase))]
    MissionEnded {
        /// The mission.
        mission: String,
        /// How it ended.
        phase: Phase,
    },
    /// An operation that the phase does not allow.
    #[error(transparent)]
    IllegalTransition(IllegalTransition),
    /// A decision needs a running mission.
    #[error(
        "decisions are given while the mission is running, and it is {}; {}",
        name(*.phase),
        how_to_run(*.phase)
    )]
    NotRunning {
        /// The phase.
        phase: Phase,
    },
    /// Nothing to answer from yet.
    #[error("no keyframe is in the graph yet; send the first keyframe and a factor or prior that ties it")]
    NotReady,
    /// A sequence number came twice with different content.
    #[error("event {seq} was received before with other content; give each event a number of its own")]
    SequenceConflict {
        /// The number.
        seq: u64,
    },
    /// The buffer of events that wait for a missing one is full.
    #[error(
        "{buffered} events already wait for event {next_seq}; send the missing events, then event {seq} again"
    )]
    BufferFull {
        /// The event refused; its number is not consumed.
        seq: u64,
        /// The first missing event.
        next_seq: u64,
        /// Events that wait, which is the limit.
        buffered: usize,
    },
    /// The events that wait for a missing one take up too many bytes.
    #[error(
        "the events that wait for a missing one take up ahead_bytes; send the missing ones (rpc/ingest \
         tells), then event {seq} again"
    )]
    BufferBytes {
        /// The event refused; its number is not consumed.
        seq: u64,
    },
    /// A named limit of the configuration.
    #[error("{what}: the bound {bound} = {limit} is reached; {advice}")]
    Limit {
        /// What there is too much of.
        what: &'static str,
        /// The field of [`crate::Limits`].
        bound: &'static str,
        /// Its value.
        limit: u64,
        /// What to do.
        advice: &'static str,
    },
    /// A text or list that is longer than its bound.
    #[error("{field} has {count} elements or bytes, more than {bound} = {limit}; send less")]
    TooLong {
        /// Path of the field.
        field: String,
        /// Its length.
        count: u64,
        /// The field of [`crate::Limits`].
        bound: &'static str,
        /// Its value.
        limit: u64,
    },
    /// The body of an event could not be decoded though its head could.
    #[error("{message}")]
    Undecodable {
        /// `invalid`, `schema_mismatch` or `too_large`.
        code: Code,
        /// What the decoder found.
        message: String,
    },
    /// A value that no other variant describes.
    #[error("{field}: {problem}")]
    Invalid {
        /// Path of the field.
        field: String,
        /// What is wrong and what to do.
        problem: String,
    },
    /// A number that is infinite or not a number.
    #[error("{field} is {value}; send a finite number")]
    NotFinite {
        /// Path of the field.
        field: String,
        /// The number.
        value: f64,
    },
    /// A quaternion or direction that is not of length one.
    #[error("{field} has norm {norm}; send it with norm 1 within {tolerance:e}")]
    NotUnit {
        /// Path of the field.
        field: String,
        /// Its norm.
        norm: f64,
        /// What was allowed.
        tolerance: f64,
    },
    /// A number outside its range.
    #[error("{field} is {value}; it must be {range}")]
    OutOfRange {
        /// Path of the field.
        field: String,
        /// The number.
        value: f64,
        /// Where it belongs, to follow "it must be".
        range: &'static str,
    },
    /// A covariance that is not one.
    #[error(
        "{field} is not a covariance: {evidence}; send a symmetric, positive definite matrix, row by row"
    )]
    NotPositiveDefinite {
        /// Path of the field.
        field: String,
        /// Which element or pivot shows it.
        evidence: String,
    },
    /// A keyframe that no event has introduced.
    #[error("{field}: keyframe {keyframe} is not known; send its keyframe event before what refers to it")]
    UnknownKeyframe {
        /// Path of the field.
        field: String,
        /// The keyframe's id.
        keyframe: u64,
    },
    /// A keyframe id that an earlier event has used.
    #[error(
        "keyframe.id: keyframe {keyframe} exists since event {since_seq}; give each keyframe an id of its own"
    )]
    RepeatedKeyframe {
        /// The keyframe's id.
        keyframe: u64,
        /// The event that introduced it.
        since_seq: u64,
    },
    /// A camera factor whose baseline is too short to have a direction.
    #[error(
        "factor.camera: the cameras of keyframes {from} and {to} are {baseline_m} m apart, less than \
         planner.min_baseline_m = {min_baseline_m}; register a pair with a longer baseline"
    )]
    DegenerateBaseline {
        /// One keyframe.
        from: u64,
        /// The other.
        to: u64,
        /// Their cameras' distance at the current estimate, m.
        baseline_m: f64,
        /// What it must not fall below, m.
        min_baseline_m: f64,
    },
    /// A measurement that lies too far from what the graph says of its keyframes.
    #[error(
        "{field}: this measurement lies {distance:.0} standard deviations from where the graph has keyframe \
         {keyframes}, more than gate_sigmas = {bound}, and is left out; check how it was made, and whether a \
         step before it was false (then tie the next keyframe by a prior); with {loss} of the next mission \
         its outliers are weighed down instead, with a larger gate_sigmas or null it is believed"
    )]
    Contradiction {
        /// Path of the field.
        field: String,
        /// Its keyframes, for a person.
        keyframes: String,
        /// Mahalanobis distance, the measurement's noise and the belief's together.
        distance: f64,
        /// The distance from which on it is refused.
        bound: f64,
        /// The field of the configuration that sets a robust loss for the kind.
        loss: String,
    },
    /// Something that the contract names and this release does not do.
    #[error("{field}: {problem}")]
    Unsupported {
        /// Path of the field.
        field: String,
        /// What is not done and what to send instead.
        problem: &'static str,
    },
    /// With this event the system of equations could not be solved; the event is undone.
    #[error(
        "the graph cannot be solved with this event, which is undone: {evidence}; check the covariances that \
         {}: beside the others one is far too small or too large",
        keyframe.map_or("it carries".to_string(), |id| format!("it and keyframe {id} carry"))
    )]
    Singular {
        /// The keyframe at which elimination failed, where that is known.
        keyframe: Option<u64>,
        /// The pivot or the reason.
        evidence: String,
    },
    /// A covariance that a question is about cannot be computed; nothing is undone.
    #[error(
        "there is no answer, the covariance{} cannot be computed: {evidence}; check the covariances of the \
         measurements that tie {}: beside the others one is far too small or too large",
        keyframe.map_or(String::new(), |id| format!(" of keyframe {id}")),
        keyframe.map_or("the last keyframes".to_string(), |_| "it".to_string())
    )]
    SingularAnswer {
        /// The keyframe at which elimination failed, where that is known.
        keyframe: Option<u64>,
        /// The pivot or the reason.
        evidence: String,
    },
    /// The question was stopped by its deadline before anything could be answered.
    #[error("the deadline passed before an answer was ready; ask again with a later deadline_ms")]
    Stopped,
    /// A law of the program does not hold; nothing the sender did.
    #[error("internal: {evidence}; please report this with the mission's events")]
    Internal {
        /// What was found.
        evidence: String,
    },
}

/// Why a mission that has a journal is not served.
#[derive(Clone, Debug, PartialEq)]
pub enum Absence {
    /// Its journal is still to be read.
    Reading,
    /// Its journal cannot be read.
    Unreadable {
        /// The file.
        file: String,
        /// Why.
        error: JournalError,
    },
}

impl StateError {
    /// The stable code of the contract.
    pub fn code(&self) -> Code {
        match self {
            StateError::NoMission => Code::NoMission,
            StateError::UnknownMission { .. } => Code::UnknownMission,
            StateError::Absent { why: Absence::Reading, .. } => Code::NotReady,
            StateError::Absent { why: Absence::Unreadable { error, .. }, .. }
            | StateError::Journal { error, .. } => error.code(),
            StateError::MissionActive { .. }
            | StateError::IllegalTransition(_)
            | StateError::NotRunning { .. } => Code::IllegalTransition,
            StateError::MissionUsed { .. } | StateError::RepeatedKeyframe { .. } => Code::RepeatedId,
            StateError::SequenceConflict { .. } => Code::Conflict,
            StateError::TooLong { .. } => Code::TooLarge,
            StateError::MissionEnded { .. } => Code::MissionEnded,
            StateError::NotReady => Code::NotReady,
            StateError::BufferBytes { .. } => Code::Overloaded,
            StateError::BufferFull { .. } | StateError::Limit { .. } => Code::Limit,
            StateError::Undecodable { code, .. } => *code,
            StateError::Invalid { .. } => Code::Invalid,
            StateError::NotFinite { .. } => Code::NotFinite,
            StateError::NotUnit { .. } => Code::NotUnit,
            StateError::OutOfRange { .. } => Code::OutOfRange,
            StateError::NotPositiveDefinite { .. } => Code::NotPositiveDefinite,
            StateError::UnknownKeyframe { .. } => Code::UnknownKeyframe,
            StateError::DegenerateBaseline { .. } => Code::DegenerateBaseline,
            StateError::Unsupported { .. } => Code::Unsupported,
            StateError::Contradiction { .. } => Code::Contradiction,
            StateError::Singular { .. } | StateError::SingularAnswer { .. } => Code::Singular,
            StateError::Stopped => Code::Deadline,
            StateError::Internal { .. } => Code::Internal,
        }
    }

    /// What goes on the wire; `seq` is the event's number, null for a query.
    pub fn problem(&self, seq: Option<u64>) -> Problem {
        Problem::new(self.code(), self.to_string(), seq)
    }
}

fn absent(mission: &str, why: &Absence) -> String {
    match why {
        Absence::Reading => {
            format!("the journal of mission \"{mission}\" is being read; ask again in a while")
        }
        Absence::Unreadable { file, error } => {
            let remedy = match error {
                JournalError::Damaged { .. } => format!("`pdnd recover {file}` saves what is whole, and "),
                _ => String::new(), // the error says what to do
            };
            format!(
                "mission \"{mission}\" is not served, its journal {file} is kept as it is: {error}; \
                 {remedy}another mission can be configured"
            )
        }
    }
}
