//! A mission as a fold of events: the same configuration and events give the same state, and so the same
//! decisions, bit for bit.
//!
//! Reading order. What can go wrong and how much is allowed: [`error`], [`limits`]. What happens to a mission:
//! [`lifecycle`], [`event`], `ingest` (the order of events). What events do: `change` (an event that has been
//! checked), `settings`, `book` (which keyframes are in the graph and which wait), `fold` (the pose graph, the area and
//! P_L that grow with them), `trail`, `survey`, `view` (the state at a moment, immutable). Who owns it: [`mission`],
//! [`vehicle`]. What is answered: [`answer`]. Where the messages of the contract meet the types of the method:
//! `convert`, and nowhere else.
//!
//! Nothing here reads a clock, starts a thread or does input or output: the time is passed in, questions that take
//! long are jobs that the caller runs where it likes, and a journal wraps [`Vehicle`] from outside, since
//! [`Vehicle::configure`], [`Vehicle::offer`] and [`Vehicle::command`] are all that changes one.

pub mod error;
pub mod limits;

pub mod lifecycle;

pub mod event;
mod ingest;
pub mod offered;

mod book;
mod change;
mod settings;

mod fold;
mod survey;
mod trail;
mod view;

pub mod mission;
pub mod vehicle;

pub mod answer;

mod convert;

pub use answer::{
    DecisionJob, DecisionOutcome, DecisionRequest, EvaluateJob, GraphJob, WaypointsJob, WhatIf,
};
pub use error::StateError;
pub use event::{Event, Undecodable};
pub use lifecycle::Operation;
pub use limits::Limits;
pub use mission::Mission;
pub use offered::{Offered, Refusal};
pub use vehicle::Vehicle;
