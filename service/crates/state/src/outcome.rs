//! What became of an event.

use crate::error::StateError;
use pdn_schemas::problem::Problem;

/// What became of an event that was offered.
#[derive(Clone, Debug, PartialEq)]
pub struct OfferOutcome {
    /// Id of the mission.
    pub mission: String,
    /// Events that were applied now: this one and those that waited for it.
    pub applied: u64,
    /// Whether it has been here before with the same content, and is ignored.
    pub repeat: bool,
    /// What was refused now, this event or an earlier one, for `out/rejected`.
    pub refused: Vec<Refusal>,
    /// All events below are consumed.
    pub next_seq: u64,
}

/// An event that was refused.
#[derive(Clone, Debug, PartialEq)]
pub struct Refusal {
    /// Number of the event.
    pub seq: u64,
    /// Why.
    pub error: StateError,
}

impl Refusal {
    /// What goes on the wire.
    pub fn problem(&self) -> Problem {
        self.error.problem(Some(self.seq))
    }
}

impl OfferOutcome {
    /// Nothing has become of it yet.
    pub(crate) fn of(mission: &str, next_seq: u64) -> OfferOutcome {
        let mission = mission.to_string();
        OfferOutcome { mission, applied: 0, repeat: false, refused: Vec::new(), next_seq }
    }

    /// It was refused.
    pub(crate) fn refused(mission: &str, seq: u64, next_seq: u64, error: StateError) -> OfferOutcome {
        let refused = vec![Refusal { seq, error }];
        OfferOutcome { refused, ..OfferOutcome::of(mission, next_seq) }
    }
}
