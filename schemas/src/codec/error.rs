//! Why a payload cannot be read or written.

use crate::problem::{Code, Problem};

/// Why a payload cannot be read or written. Each text says what is wrong, where, and what to do.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CodecError {
    /// Larger than any message of its kind may be.
    #[error("a {message} of {bytes} bytes is refused: at most {limit} bytes are read; send less at once")]
    TooLarge {
        /// Name of the message.
        message: &'static str,
        /// Bytes of the payload.
        bytes: usize,
        /// Bytes allowed.
        limit: usize,
    },
    /// bincode that ends before the message does.
    #[error(
        "the {message} ends after {bytes} bytes, at least {missing} too early: send the whole payload, of \
         the same version of the contract"
    )]
    Truncated {
        /// Name of the message.
        message: &'static str,
        /// Bytes of the payload.
        bytes: usize,
        /// Bytes that are missing at least.
        missing: usize,
    },
    /// bincode that goes on after the message.
    #[error(
        "the {message} ends after {read} bytes but the payload has {bytes}: send one message, of the same \
         version of the contract"
    )]
    Trailing {
        /// Name of the message.
        message: &'static str,
        /// Bytes that belong to the message.
        read: usize,
        /// Bytes of the payload.
        bytes: usize,
    },
    /// bincode that claims a length which no payload can have.
    #[error(
        "the {message} of {bytes} bytes claims a length beyond {limit} bytes: it is damaged, or of another \
         layout"
    )]
    LyingLength {
        /// Name of the message.
        message: &'static str,
        /// Bytes of the payload.
        bytes: usize,
        /// Bytes allowed.
        limit: usize,
    },
    /// bincode with a value that its place does not allow.
    #[error("the {message} cannot be read as bincode: {reason}; it is damaged, or of another layout")]
    Bincode {
        /// Name of the message.
        message: &'static str,
        /// What the decoder found.
        reason: String,
    },
    /// JSON that is not the message.
    #[error(
        "the {message} cannot be read as JSON, at `{path}`: {reason}; schemas/messages.md lists its fields"
    )]
    Json {
        /// Name of the message.
        message: &'static str,
        /// Where, as `factor.odometry.covariance[3]`; `.` for the whole.
        path: String,
        /// What the parser found.
        reason: String,
    },
    /// A number that JSON has no form for.
    #[error("the {message} cannot be written as JSON: `{path}` is infinite or not a number")]
    NotFinite {
        /// Name of the message.
        message: &'static str,
        /// Where.
        path: String,
    },
    /// A message that cannot be written for another reason.
    #[error("the {message} cannot be written: {reason}")]
    Unwritable {
        /// Name of the message.
        message: &'static str,
        /// What the encoder found.
        reason: String,
    },
    /// An encoding that names no format of the contract.
    #[error(
        "encoding {encoding:?} is not understood: send `application/json`, or bincode as \
         `application/octet-stream;pdn.v1.{message}+bincode`"
    )]
    UnknownEncoding {
        /// Name of the message that the key asks for.
        message: &'static str,
        /// The encoding of the payload.
        encoding: String,
    },
    /// An encoding that names another message or version.
    #[error("the key asks for `{expected}`, but the payload says it is `{found}`")]
    OtherMessage {
        /// The schema that the key asks for.
        expected: String,
        /// The schema of the payload.
        found: String,
    },
    /// An encoding with the hash of another layout.
    #[error(
        "the payload's {message} has layout {found:?}, this service reads {expected}: install client and \
         service of the same version"
    )]
    OtherLayout {
        /// Name of the message.
        message: &'static str,
        /// Hash of the layout here.
        expected: String,
        /// Hash in the payload's encoding.
        found: String,
    },
}

impl CodecError {
    /// The code under which it is refused.
    pub fn code(&self) -> Code {
        match self {
            CodecError::TooLarge { .. } => Code::TooLarge,
            CodecError::UnknownEncoding { .. }
            | CodecError::OtherMessage { .. }
            | CodecError::OtherLayout { .. } => Code::SchemaMismatch,
            CodecError::NotFinite { .. } | CodecError::Unwritable { .. } => Code::Internal,
            CodecError::Truncated { .. }
            | CodecError::Trailing { .. }
            | CodecError::LyingLength { .. }
            | CodecError::Bincode { .. }
            | CodecError::Json { .. } => Code::Invalid,
        }
    }

    /// The refusal of the payload; `seq` if its head could be read.
    pub fn problem(&self, seq: Option<u64>) -> Problem {
        Problem::new(self.code(), self.to_string(), seq)
    }
}
