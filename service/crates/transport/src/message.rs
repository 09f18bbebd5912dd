//! What comes in: an event or a question, as it came, not yet decoded.

use crate::answer::Answer;
use crate::parameters::Parameters;
use crate::payload::Payload;
use pdn_schemas::problem::Problem;
use pdn_schemas::topics::{Role, Topic};
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

/// What a question costs, and so which bound it counts against.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// `rpc/mission` and `rpc/ingest`: how things stand, told in no time.
    Status,
    /// Any other `rpc/*`: it is computed, or has a long answer.
    Long,
    /// `op/*`.
    Command,
}

impl Class {
    /// Each of them, in the order of their numbers.
    pub const ALL: [Class; 3] = [Class::Status, Class::Long, Class::Command];

    /// Name of the setting that bounds how many are in flight.
    pub fn bound(self) -> &'static str {
        match self {
            Class::Status => "max_status_questions",
            Class::Long => "max_questions_in_flight",
            Class::Command => "max_commands",
        }
    }
}

impl Question {
    /// Which bound it counts against.
    pub fn class(&self) -> Class {
        match self.topic {
            topic if topic.role() == Role::Command => Class::Command,
            Topic::RpcMission | Topic::RpcIngest => Class::Status,
            _ => Class::Long,
        }
    }

    /// Whether it asks how things stand now, and not after some event: then it may overtake.
    pub fn may_overtake(&self) -> bool {
        self.class() == Class::Status && !self.parameters.has_after()
    }
}

/// Whatever a vehicle's thread is handed.
#[derive(Debug)]
pub enum Incoming {
    /// A publication of the vehicle.
    Event(Event),
    /// A publication under a key of the vehicle that is none of the contract's; to be told on `out/rejected`.
    Unroutable(Problem),
    /// A query.
    Question(Box<Question>),
}

impl Incoming {
    /// The class of a question or command; none for an event.
    pub fn class(&self) -> Option<Class> {
        match self {
            Incoming::Event(_) | Incoming::Unroutable(_) => None,
            Incoming::Question(question) => Some(question.class()),
        }
    }

    /// Whether it need not wait for the events that came before it; see [`Question::may_overtake`].
    pub fn may_overtake(&self) -> bool {
        matches!(self, Incoming::Question(question) if question.may_overtake())
    }

    /// Bytes of payload that it holds.
    pub fn bytes(&self) -> usize {
        match self {
            Incoming::Event(event) => event.payload.len(),
            Incoming::Unroutable(problem) => problem.message.len(),
            Incoming::Question(question) => question.payload.len() + question.parameters.len(),
        }
    }
}
