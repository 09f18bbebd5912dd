//! What a message is, and which there are.

use crate::command::{Command, EvaluateRequest};
use crate::config::MissionConfig;
use crate::event::{Factor, Keyframe, LinkOutcome};
use crate::limits::{MAX_REPLY_BYTES, MAX_REQUEST_BYTES};
use crate::record::{CommandTaken, Configured, DecisionTaken, Reopened, UnreadEvent};
use crate::reply::{
    Ack, CoverageReply, Decision, EvaluateReply, GraphReply, IngestStatus, LinkModelReply, MissionState,
    Problem, WaypointsReply,
};
use schemars::JsonSchema;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fmt::Debug;

/// What travels as a payload of its own.
pub trait Message: Serialize + DeserializeOwned + JsonSchema + Clone + Debug + PartialEq {
    /// Its name in encodings, the registry and the documents.
    const NAME: &'static str;
    /// How large it may be.
    const BOUND: Bound;
}

/// How large a message may be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bound {
    /// At most [`MAX_REQUEST_BYTES`]: what the service reads.
    Request,
    /// At most [`MAX_REPLY_BYTES`]: what the service writes.
    Reply,
}

impl Bound {
    /// Bytes that a payload may have.
    pub const fn max_bytes(self) -> usize {
        match self {
            Bound::Request => MAX_REQUEST_BYTES,
            Bound::Reply => MAX_REPLY_BYTES,
        }
    }
}

/// Does the same to every message type.
pub trait MessageVisitor {
    /// Called once for each message type, in the order of `schemas/messages.md`.
    fn visit<T: Message>(&mut self);
}

macro_rules! messages {
    ($(#[$doc:meta])* $visit:ident: $($name:ident: $bound:ident,)+) => {
        $(impl Message for $name {
            const NAME: &'static str = stringify!($name);
            const BOUND: Bound = Bound::$bound;
        })+

        $(#[$doc])*
        pub fn $visit(visitor: &mut impl MessageVisitor) {
            $(visitor.visit::<$name>();)+
        }
    };
}

messages! {
    /// Shows every message that travels to the visitor.
    visit_messages:
    Keyframe: Request,
    Factor: Request,
    LinkOutcome: Request,
    MissionConfig: Request,
    Command: Request,
    EvaluateRequest: Request,
    MissionState: Reply,
    IngestStatus: Reply,
    Ack: Reply,
    Problem: Reply,
    Decision: Reply,
    EvaluateReply: Reply,
    GraphReply: Reply,
    WaypointsReply: Reply,
    CoverageReply: Reply,
    LinkModelReply: Reply,
}

messages! {
    /// Shows every record that the journal keeps besides messages to the visitor.
    visit_records:
    Configured: Reply,
    UnreadEvent: Reply,
    CommandTaken: Reply,
    DecisionTaken: Reply,
    Reopened: Reply,
}
