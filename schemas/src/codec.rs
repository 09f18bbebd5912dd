//! How messages travel: bincode (legacy layout: little-endian, fixed-width integers, 64-bit lengths, 32-bit
//! variant tags) and JSON. This is the only file that uses `bincode`.
//!
//! Reading order: [`encode`] and [`decode`], then `encoding` (the string that names format, message and
//! layout, and [`decode_encoded`] by it), [`history`] (what earlier layouts wrote), `head` (who sent an event
//! whose body cannot be read), `finite` and `error`.

mod encoding;
mod error;
mod finite;
mod head;
pub mod history;

pub use crate::message::{Bound, Message, MessageVisitor, visit_messages, visit_records};
pub use encoding::{decode_encoded, encoding, format_of};
pub use error::CodecError;
pub use head::{Head, decode_head};

use crate::limits::{MAX_REPLY_BYTES, MAX_REQUEST_BYTES};
use bincode::config::standard;
use bincode::error::DecodeError;

/// How a message is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Format {
    /// JSON, with the Rust field names and externally tagged enums.
    Json,
    /// bincode with the legacy layout.
    Bincode,
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

fn check_size<T: Message>(bytes: usize) -> Result<(), CodecError> {
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
