//! Bytes as they came, with the encoding that says how to read them.

use pdn_schemas::codec::{self, Bound, CodecError, Format, Head, Message};
use pdn_schemas::limits::MAX_REQUEST_BYTES;
use zenoh::bytes::{Encoding, ZBytes};

/// Bytes that are held of a payload of which only the head matters.
const HEAD_BYTES: usize = 4096;

/// A payload of at most [`MAX_REQUEST_BYTES`], or the beginning of a larger one.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Payload {
    bytes: Vec<u8>,
    sent_bytes: usize,
    encoding: String,
}

impl Payload {
    /// Copies what is held, so that a few bytes do not hold a whole receive buffer.
    pub fn new(bytes: &ZBytes, encoding: &Encoding) -> Payload {
        let sent_bytes = bytes.len();
        let held_bytes = if sent_bytes > MAX_REQUEST_BYTES { HEAD_BYTES } else { sent_bytes };
        let mut copy = Vec::with_capacity(held_bytes);
        for slice in bytes.slices() {
            copy.extend_from_slice(&slice[..slice.len().min(held_bytes - copy.len())]);
        }
        Payload { bytes: copy, sent_bytes, encoding: encoding.to_string() }
    }

    /// Lets go of all but the beginning, from which [`Self::head`] still tells.
    pub fn truncate_to_head(&mut self) {
        self.bytes.truncate(HEAD_BYTES);
        self.bytes.shrink_to_fit();
    }

    /// Bytes that are held.
    pub fn len(&self) -> usize {
        self.bytes.len()
    }

    /// Whether nothing was sent.
    pub fn is_empty(&self) -> bool {
        self.sent_bytes == 0
    }

    /// The message that was sent.
    ///
    /// # Errors
    /// `too_large`, `schema_mismatch` or `invalid`, as the codec found.
    pub fn decode<T: Message>(&self) -> Result<T, CodecError> {
        let limit = T::BOUND.max_bytes().min(Bound::Request.max_bytes());
        if self.sent_bytes > limit {
            return Err(CodecError::TooLarge { message: T::NAME, bytes: self.sent_bytes, limit });
        }
        codec::decode_encoded(&self.bytes, &self.encoding)
    }

    /// Mission and number of an event, if they can be told whatever else is wrong.
    pub fn head(&self) -> Option<Head> {
        let json = self.encoding == Encoding::APPLICATION_JSON.to_string();
        codec::decode_head(&self.bytes, if json { Format::Json } else { Format::Bincode })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pdn_schemas::LinkOutcome;

    fn event() -> LinkOutcome {
        LinkOutcome { mission: "m".into(), seq: 7, stamp_ns: 5, from: 1, to: 2, registered: true }
    }

    #[test]
    fn both_formats_are_read() {
        for format in [Format::Json, Format::Bincode] {
            let bytes = codec::encode(&event(), format).unwrap();
            let encoding = Encoding::from(codec::encoding::<LinkOutcome>(format));
            let payload = Payload::new(&bytes.into(), &encoding);
            assert_eq!(payload.decode::<LinkOutcome>().unwrap(), event());
            assert_eq!(payload.head().unwrap().seq, 7);
        }
    }

    #[test]
    fn of_a_payload_that_is_too_large_only_the_head_is_held() {
        let mut bytes = codec::encode(&event(), Format::Bincode).unwrap();
        bytes.resize(10 * 1024 * 1024, 0);
        let payload = Payload::new(&bytes.into(), &codec::encoding::<LinkOutcome>(Format::Bincode).into());
        assert_eq!(payload.len(), HEAD_BYTES);
        assert!(matches!(
            payload.decode::<LinkOutcome>(),
            Err(CodecError::TooLarge { bytes: 10_485_760, limit: MAX_REQUEST_BYTES, .. })
        ));
        assert_eq!(payload.head().unwrap().seq, 7);
    }
}
