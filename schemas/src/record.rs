//! What the journal keeps of a mission besides the messages that travel: `schemas/journal.md` is written from
//! here.
//!
//! Records are read by this service and by whoever takes a journal apart, never sent. They are messages all
//! the same: one codec, one way of hashing a layout. How records lie in a file is `pdn_state::journal`'s.

use crate::codec::{CodecError, Format, encode};
use crate::config::MissionConfig;
use crate::history::Generation;
use crate::registry::layout_hash;
use crate::reply::{Decision, Problem};
use crate::{Factor, Keyframe, LinkOutcome};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Version of the journal's format: of its tables, its frames and the numbers of kinds. A reader refuses any
/// other.
pub const JOURNAL_FORMAT: u32 = 1;

macro_rules! kinds {
    ($($variant:ident $number:literal $name:literal $schema:ident $meaning:literal;)+) => {
        /// What a record of the journal is.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
        pub enum Kind { $(#[doc = $meaning] $variant,)+ }

        impl Kind {
            /// All kinds, in the order of their numbers.
            pub const ALL: &'static [Kind] = &[$(Kind::$variant,)+];

            /// Its number in a frame.
            pub const fn number(self) -> u32 {
                match self { $(Kind::$variant => $number,)+ }
            }

            /// Its name where a journal is told as text.
            pub const fn name(self) -> &'static str {
                match self { $(Kind::$variant => $name,)+ }
            }

            /// The name of the message or record that is its payload.
            pub const fn schema(self) -> &'static str {
                match self { $(Kind::$variant => stringify!($schema),)+ }
            }

            /// The hash of that one's layout.
            pub fn layout_hash(self) -> u64 {
                match self { $(Kind::$variant => layout_hash::<$schema>(),)+ }
            }

            /// A payload that was written in an earlier generation, as it would be written now.
            ///
            /// # Errors
            /// As [`Generation::decode`].
            pub fn translate(self, from: &Generation, payload: &[u8]) -> Result<Vec<u8>, CodecError> {
                if from.hash(self.schema()) == Some(self.layout_hash()) {
                    return Ok(payload.to_vec());
                }
                match self {
                    $(Kind::$variant => encode(&from.decode::<$schema>(payload)?, Format::Bincode),)+
                }
            }

            /// What it says.
            pub const fn meaning(self) -> &'static str {
                match self { $(Kind::$variant => $meaning,)+ }
            }
        }
    };
}

kinds! {
    Configured 1 "configured" Configured "The mission was configured; the first record of every journal.";
    Keyframe 2 "keyframe" Keyframe "An event that has consumed its number, as it came.";
    Factor 3 "factor" Factor "An event that has consumed its number, as it came.";
    Link 4 "link" LinkOutcome "An event that has consumed its number, as it came.";
    Unread 5 "unread" UnreadEvent "An event of which only the head could be read; it has consumed its \
                                   number.";
    Refused 6 "refused" Problem "What was refused by the record before, this event or an earlier one.";
    TurnedAway 7 "turned_away" Problem "An event that was refused and has consumed no number; it changed \
                                        nothing.";
    Command 8 "command" CommandTaken "A command was carried out.";
    Decided 9 "decided" DecisionTaken "A decision was taken.";
    Reopened 10 "reopened" Reopened "The daemon was started anew; a mission that was active is held.";
}

impl Kind {
    /// The kind of that number.
    pub fn from_number(number: u32) -> Option<Kind> {
        Kind::ALL.iter().copied().find(|kind| kind.number() == number)
    }
}

/// A mission was configured, or configured anew before its first event.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Configured {
    /// Id of the vehicle.
    pub vehicle: String,
    /// Number of the mission among those of the vehicle, from 0; the greatest is the current one.
    pub ordinal: u64,
    /// When, ns since the Unix epoch on the daemon's clock.
    pub at_ns: u64,
    /// Version of the software.
    pub software: String,
    /// The bounds in force, which are the mission's until its end.
    pub bounds: Bounds,
    /// The configuration, with every default filled in.
    pub config: MissionConfig,
}

/// The bounds that decide which configurations and events a mission takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Bounds {
    /// Events, applied and refused.
    pub max_events: u64,
    /// Keyframes.
    pub max_keyframes: u64,
    /// Factors.
    pub max_factors: u64,
    /// Factors that name one keyframe.
    pub max_factors_per_keyframe: u64,
    /// Facets of the target.
    pub max_facets: u64,
    /// Cells of the coverage rasters.
    pub max_cells: u64,
    /// Points of the survey.
    pub max_survey_points: u64,
    /// Bins of each saliency in the table of link probabilities.
    pub max_link_bins: u64,
    /// Bytes of the reason of a command.
    pub max_reason_bytes: u64,
}

/// An event whose body could not be read; it has consumed its number.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UnreadEvent {
    /// Id of the mission.
    pub mission: String,
    /// Number of the event.
    pub seq: u64,
    /// The code of its refusal.
    pub code: String,
    /// What the decoder found.
    pub message: String,
}

/// A command was carried out.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CommandTaken {
    /// The last part of its key, as in `op/start`.
    pub operation: String,
    /// The reason as it was given.
    pub reason: String,
    /// When, ns since the Unix epoch on the daemon's clock.
    pub at_ns: u64,
}

/// A decision was taken and counted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DecisionTaken {
    /// It rests on the mission as it stood after so many records.
    pub basis: u64,
    /// Whether poses, links and the table of link probabilities were asked for.
    pub full: bool,
    /// Whether only the best candidate was asked for, and none where exploring is certain.
    pub choice_only: bool,
    /// Version of the software.
    pub software: String,
    /// The decision as it was told, and always with the table of link probabilities and its counts.
    pub decision: Decision,
}

/// The daemon was started anew and took the mission up from its journal.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Reopened {
    /// When, ns since the Unix epoch on the daemon's clock.
    pub at_ns: u64,
    /// Version of the software.
    pub software: String,
}
