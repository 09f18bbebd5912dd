//! What comes in: an event or a question, as it came, not yet decoded.

use crate::answer::Answer;
use crate::parameters::Parameters;
use crate::payload::Payload;
use pdn_schemas::problem::Problem;
use pdn_schemas::topics::Topic;
use std::time::Instant;

/// A publication of the vehicle.
#[derive(Debug)]
pub struct Event {
    /// One of `in/*`.
    pub topic: Topic,
    /// What was sent.
    pub payload: Payload,
}

/// A query: `rpc/*` or `op/*`.
#[derive(Debug)]
pub struct Question {
    /// What is asked.
    pub topic: Topic,
    /// What stands after the key.
    pub parameters: Parameters,
    /// What was sent along; none is an empty one.
    pub payload: Payload,
    /// When it came, on the daemon's clock.
    pub arrived: Instant,
    /// Where the answer goes.
    pub answer: Answer,
}

/// Whatever a vehicle's thread is handed.
#[derive(Debug)]
pub enum Incoming {
    /// A publication of the vehicle.
    Event(Event),
    /// A publication under a key of the vehicle that is none of the contract's; to be told on `out/rejected`.
    Stray(Problem),
    /// A query.
    Question(Box<Question>),
}

impl Incoming {
    /// Bytes of payload that it holds.
    pub fn bytes(&self) -> usize {
        match self {
            Incoming::Event(event) => event.payload.len(),
            Incoming::Stray(problem) => problem.message.len(),
            Incoming::Question(question) => question.payload.len() + question.parameters.len(),
        }
    }
}
