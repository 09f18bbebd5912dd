//! A mission as a fold of events: the same configuration and events give the same state, and so the same
//! decisions, bit for bit.
//!
//! The modules stand in the order in which each rests on those before it; none names a later one.
//!
//! - How much is allowed: [`limits`]. Phases and what leads from one to another: [`lifecycle`].
//! - What happens to a mission: [`event`], [`history`] (entry by entry), [`journal`] (the file of
//!   it).
//! - The mission's configuration in the types of the method: `settings`, `survey`. What an event says in
//!   these: `change`. What can be refused, and why: [`error`], [`outcome`].
//! - What is asked of a moment: `view` (immutable, linearised by `relinearization`), [`request`].
//! - Where the messages of the contract meet the types of the method, and nowhere else: `convert`.
//! - What of the last events does not fit, for a mission's health: `findings`.
//! - What events add up to: `gate` (whether a measurement can be true), `graph_builder` (which keyframes are
//!   in the graph and which measurements wait for one), `coverage_tracker` (the area), `fold` (all of it, and
//!   P_L).
//! - The order of events: `ingest`. What of a history is still to be written: `record_log`.
//! - What is answered: [`answer`]. One mission: [`mission`], and what spares solving for it again:
//!   [`checkpoint`]. A mission from its journal: [`recovery`]; its decisions once more: [`replay`]. Who owns
//!   missions: [`vehicle`].
//!
//! Nothing here reads a clock or starts a thread, and only [`journal`] does input and output: the time is
//! passed in, questions that take long are jobs that the caller runs where it likes, and what is to be
//! written waits to be taken ([`Vehicle::take_unwritten`]). Configurations, events, commands and
//! decisions are all that adds to a history, and a restart.

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

mod findings;

mod gate;

mod graph_builder;

mod coverage_tracker;

mod fold;

mod ingest;
mod record_log;

pub mod checkpoint;

pub mod answer;

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
