//! How messages travel: bincode (legacy layout: little-endian, fixed-width integers, 64-bit lengths, 32-bit
//! variant tags) and JSON. This is the only file that uses `bincode`.
//!
//! Reading order: [`Message`] and what is one, [`encode`] and [`decode`], then `encoding` (the string that
//! names format, message and layout, and [`decode_encoded`] by it), `head` (who sent an event whose body
//! cannot be read), `finite` and `error`.

mod encoding;
mod error;
mod finite;
mod head;

pub use encoding::{decode_encoded, encoding, format_of};
pub use error::CodecError;
pub use head::{Head, decode_head};

use crate::command::{Command, EvaluateRequest};
use crate::config::MissionConfig;
use crate::event::{Factor, Keyframe, LinkOutcome};
use crate::limits::{MAX_REPLY_BYTES, MAX_REQUEST_BYTES};
use crate::record::{CommandTaken, Configured, DecisionTaken, Reopened, UnreadEvent};
use crate::reply::{
    Ack, CoverageReply, Decision, EvaluateReply, GraphReply, IngestStatus, LinkModelReply, MissionState,
    Problem, WaypointsReply,
};
use bincode::config::standard;
use bincode::error::DecodeError;
use schemars::JsonSchema;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fmt::Debug;

/// How a message is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Format {
    /// JSON, with the Rust field names and externally tagged enums.
    Json,
    /// bincode with the legacy layout.
    Bincode,
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

/// What travels as a payload of its own.
pub trait Message: Serialize + DeserializeOwned + JsonSchema + Clone + Debug + PartialEq {
    /// Its name in encodings, the registry and the documents.
    const NAME: &'static str;
    /// How large it may be.
    const BOUND: Bound;
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

/// The payload of a message.
///
/// # Errors
/// [`CodecError::NotFinite`] if JSON would have to carry an infinity or NaN, for which it has no form;
/// [`CodecError::TooLarge`] if no reader would take it.
pub fn encode<T: Message>(message: &T, format: Format) -> Result<Vec<u8>, CodecError> {
    let unwritable = |reason: String| CodecError::Unwritable { message: T::NAME, reason };
    let bytes = match format {
        Format::Json => {
            finite::check(message).map_err(|path| CodecError::NotFinite { message: T::NAME, path })?;
            serde_json::to_vec(message).map_err(|error| unwritable(error.to_string()))?
        }
        Format::Bincode => bincode::serde::encode_to_vec(message, standard().with_fixed_int_encoding())
            .map_err(|error| unwritable(error.to_string()))?,
    };
    check_size::<T>(bytes.len())?;
    Ok(bytes)
}

/// The message of a payload; every byte of it must belong to the message.
///
/// # Errors
/// Says what is wrong and where. Takes no more memory than a small multiple of the payload, whatever lengths
/// the payload claims.
pub fn decode<T: Message>(bytes: &[u8], format: Format) -> Result<T, CodecError> {
    check_size::<T>(bytes.len())?;
    match format {
        Format::Json => decode_json(bytes),
        Format::Bincode => decode_bincode(bytes),
    }
}

pub(crate) fn check_size<T: Message>(bytes: usize) -> Result<(), CodecError> {
    let limit = T::BOUND.max_bytes();
    if bytes > limit {
        return Err(CodecError::TooLarge { message: T::NAME, bytes, limit });
    }
    Ok(())
}

fn decode_json<T: Message>(bytes: &[u8]) -> Result<T, CodecError> {
    let mut deserializer = serde_json::Deserializer::from_slice(bytes);
    let message = serde_path_to_error::deserialize(&mut deserializer).map_err(|error| CodecError::Json {
        message: T::NAME,
        path: error.path().to_string(),
        reason: error.into_inner().to_string(),
    })?;
    deserializer.end().map_err(|error| CodecError::Json {
        message: T::NAME,
        path: ".".to_owned(),
        reason: error.to_string(),
    })?;
    Ok(message)
}

fn decode_bincode<T: Message>(bytes: &[u8]) -> Result<T, CodecError> {
    // The limit also bounds what bincode allocates for a claimed length before it reads.
    let layout = standard().with_fixed_int_encoding();
    let decoded = match T::BOUND {
        Bound::Request => bincode::serde::decode_from_slice(bytes, layout.with_limit::<MAX_REQUEST_BYTES>()),
        Bound::Reply => bincode::serde::decode_from_slice(bytes, layout.with_limit::<MAX_REPLY_BYTES>()),
    };
    let (message, read) = decoded.map_err(|error| bincode_error::<T>(error, bytes.len()))?;
    if read != bytes.len() {
        return Err(CodecError::Trailing { message: T::NAME, read, bytes: bytes.len() });
    }
    Ok(message)
}

fn bincode_error<T: Message>(error: DecodeError, bytes: usize) -> CodecError {
    match error {
        DecodeError::UnexpectedEnd { additional } => {
            CodecError::Truncated { message: T::NAME, bytes, missing: additional }
        }
        DecodeError::LimitExceeded => {
            CodecError::LyingLength { message: T::NAME, bytes, limit: T::BOUND.max_bytes() }
        }
        DecodeError::OtherString(reason) => CodecError::Bincode { message: T::NAME, reason },
        other => CodecError::Bincode { message: T::NAME, reason: other.to_string() },
    }
}
