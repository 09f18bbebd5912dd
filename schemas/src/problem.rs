//! The codes of refusals. This list is the source of `schemas/errors.md` and of the Python client's codes.

pub use crate::reply::Problem;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

macro_rules! codes {
    ($($variant:ident $name:literal: $meaning:literal, $remedy:literal;)+) => {
        /// Why something was refused. The names are stable: programs may branch on them.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
        #[serde(rename_all = "snake_case")]
        pub enum Code {
            $(#[doc = $meaning] #[doc = ""] #[doc = $remedy] $variant,)+
        }

        impl Code {
            /// All codes, in the order of `schemas/errors.md`.
            pub const ALL: &'static [Code] = &[$(Code::$variant,)+];

            /// The name on the wire.
            pub const fn name(self) -> &'static str {
                match self { $(Code::$variant => $name,)+ }
            }

            /// What it means, in one sentence.
            pub const fn meaning(self) -> &'static str {
                match self { $(Code::$variant => $meaning,)+ }
            }

            /// What to do about it, in one sentence.
            pub const fn remedy(self) -> &'static str {
                match self { $(Code::$variant => $remedy,)+ }
            }
        }
    };
}

codes! {
    Invalid "invalid":
        "The payload or a parameter cannot be read as what the key asks for.",
        "Mend the field that the message names; a client with generated messages cannot send this.";
    SchemaMismatch "schema_mismatch":
        "The encoding names another message, version or layout than this service reads under the key.",
        "Install client and service of the same version; without the hash the layout is not compared.";
    TooLarge "too_large":
        "The payload is larger than the limit for its kind.",
        "Send less at once: fewer descriptors, paths or points.";
    Unsupported "unsupported":
        "The request is well formed, but this version cannot do it.",
        "Look in the changelog for the version that can, or leave the field out.";
    NotFinite "not_finite":
        "A number is infinite or not a number.",
        "Look where the sender computes the field that the message names.";
    NotUnit "not_unit":
        "A quaternion or direction does not have length 1 within 1e-6.",
        "Normalise it before sending.";
    NotPositiveDefinite "not_positive_definite":
        "A covariance is not symmetric or not positive definite.",
        "Send the full matrix row by row, variances in m^2 and rad^2, none of them zero.";
    OutOfRange "out_of_range":
        "A number lies outside the range that its field allows.",
        "The message names the field, the value and the range.";
    DegenerateBaseline "degenerate_baseline":
        "The two cameras of a camera factor are closer than `min_baseline_m`, so its direction means \
         nothing.",
        "Leave the factor out, or register images that are farther apart.";
    UnknownKeyframe "unknown_keyframe":
        "The event or question names a keyframe that the mission does not have.",
        "Send a keyframe before the factors and outcomes that name it.";
    RepeatedId "repeated_id":
        "The id of a keyframe or mission has been used before.",
        "Give every keyframe of a mission, and every mission of a vehicle, an id of its own.";
    Conflict "conflict":
        "An event with this number but other content has been received before.",
        "Two senders share a mission, or one restarted its numbers: ask `rpc/ingest` where to go on.";
    Singular "singular":
        "With this event the graph could not be solved, or a covariance that was asked for cannot be \
         computed.",
        "Check the covariances that the message names; tie the keyframe by a prior, odometry or relative \
         factor.";
    Contradiction "contradiction":
        "The measurement lies so far from what the graph says of its keyframes that it cannot be true.",
        "Check how it was made; a robust loss for its kind in the configuration weighs outliers down \
         instead.";
    Limit "limit":
        "A bound on counts is reached; `limits` names it.",
        "The message names the bound; if it is events that wait, send the missing ones first.";
    UnknownVehicle "unknown_vehicle":
        "The service has heard nothing of this vehicle.",
        "Check the vehicle's id in the key, and configure a mission.";
    UnknownMission "unknown_mission":
        "The vehicle has no mission of this id.",
        "Check the id, and configure the mission before sending its events.";
    NoMission "no_mission":
        "The vehicle has no mission yet.",
        "Configure one with `op/configure`.";
    MissionEnded "mission_ended":
        "The mission is completed or aborted; it can be read but takes nothing more.",
        "Configure a new mission.";
    IllegalTransition "illegal_transition":
        "The phase of the mission does not allow this.",
        "The message names the phase and the commands that are legal in it.";
    NotReady "not_ready":
        "The question has no answer yet, or the service is starting or shutting down.",
        "The message says what is missing; send it, or ask again.";
    Deadline "deadline":
        "The answer was not ready by the deadline.",
        "Ask again with a later `deadline_ms`, or with a smaller `after`.";
    Overloaded "overloaded":
        "A queue of the service is full; the request was not looked at.",
        "Ask again after a while; events are sent again by the client's outbox.";
    NotDurable "not_durable":
        "The journal cannot be written now, and this must be recorded before it is answered.",
        "Make room on the disk that the message names, or mend it; the service tries again by itself.";
    JournalDamaged "journal_damaged":
        "The journal of the mission is damaged; it is kept as it is, and the mission is not served.",
        "`pdnd recover` with the file that the message names saves what is whole, up to the damage.";
    JournalUnreadable "journal_unreadable":
        "The journal of the mission cannot be read by this user, or by this version of the service.",
        "The message says which: give the service access, or read it with the version that wrote it.";
    Internal "internal":
        "The service has a fault.",
        "Report it with the message and the service's log.";
}

impl Code {
    /// The code of that name.
    pub fn from_name(name: &str) -> Option<Code> {
        Code::ALL.iter().copied().find(|code| code.name() == name)
    }
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl Problem {
    /// A refusal: what is wrong, where, and what to do; `seq` is that of the event, if one was refused.
    pub fn new(code: Code, message: impl Into<String>, seq: Option<u64>) -> Problem {
        Problem { code: code.name().to_owned(), message: message.into(), seq }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_that_serde_writes() {
        for &code in Code::ALL {
            assert_eq!(serde_json::to_value(code).unwrap(), code.name());
            assert_eq!(Code::from_name(code.name()), Some(code));
        }
        assert_eq!(Code::from_name("no_such_code"), None);
    }
}
