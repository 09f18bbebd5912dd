//! A mission as a fold of events: the same configuration and events give the same state, and so the same
//! decisions, bit for bit.
//!
//! Reading order. What can go wrong and how much is allowed: [`error`], [`limits`]. What happens to a mission:
//! [`lifecycle`], [`event`], `ingest` (the order of events), [`history`] (entry by entry), `record_log` (what of it is
//! written down). What events do: `change` (an event that has been checked), `settings`, `graph_builder` (which keyframes are in
//! the graph and which wait), `fold` (the pose graph, the area and P_L that grow with them), `coverage_tracker`, `survey`, `view`
//! (the state at a moment, immutable). Who owns it: [`mission`], [`vehicle`]. What is answered: [`answer`]. What
//! survives: [`journal`] (the file), [`checkpoint`] (what spares solving it again), [`recovery`] (a mission from its journal), [`replay`] (its decisions once more).
//! Where the messages of the contract meet the types of the method: `convert`, and nowhere else.
//!
//! Nothing here reads a clock or starts a thread, and only [`journal`] does input and output: the time is passed in,
//! questions that take long are jobs that the caller runs where it likes, and what is to be written waits to be taken
//! ([`Vehicle::take_unwritten`]), since [`Vehicle::configure`], [`Vehicle::offer`], [`Vehicle::command`] and
//! [`Mission::record`] are all that changes one.

pub mod error;
pub mod limits;

pub mod lifecycle;

pub mod event;
mod ingest;
pub mod outcome;

mod record_log;
pub mod history;

mod graph_builder;
mod change;
mod settings;

mod relinearization;

mod fold;
mod survey;
mod coverage_tracker;
mod view;

pub mod mission;
pub mod vehicle;

pub mod answer;

pub mod journal;

pub mod checkpoint;
pub mod recovery;
pub mod replay;

mod convert;

pub use answer::{
    DecisionJob, DecisionOutcome, DecisionRequest, EvaluateJob, GraphJob, WaypointsJob, WhatIf,
};
pub use error::StateError;
pub use event::{Event, Undecodable};
pub use history::{Entry, Record, SOFTWARE};
pub use journal::{Journal, JournalError};
pub use lifecycle::Operation;
pub use limits::Limits;
pub use mission::Mission;
pub use outcome::{OfferOutcome, Refusal};
pub use vehicle::{Absence, PreparedMission, Unwritten, Vehicle};
