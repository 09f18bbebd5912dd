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

pub mod limits;

pub mod lifecycle;

pub mod event;
pub mod history;
pub mod journal;

mod settings;
mod survey;

mod change;

pub mod error;
pub mod outcome;

mod relinearization;
mod view;

pub mod request;

mod convert;

mod coverage_tracker;
mod fold;
mod gate;
mod graph_builder;

mod ingest;
mod record_log;

pub mod answer;
pub mod checkpoint;
pub mod mission;

pub mod recovery;
pub mod replay;

pub mod vehicle;

pub use answer::{DecisionJob, DecisionOutcome, EvaluateJob, GraphJob, WaypointsJob};
pub use error::{Absence, StateError};
pub use event::{Event, Undecodable};
pub use history::{Entry, Record, SOFTWARE};
pub use journal::{Journal, JournalError};
pub use lifecycle::Operation;
pub use limits::Limits;
pub use mission::Mission;
pub use outcome::{OfferOutcome, Refusal};
pub use request::{DecisionRequest, WhatIf};
pub use vehicle::{PreparedMission, Unwritten, Vehicle};
