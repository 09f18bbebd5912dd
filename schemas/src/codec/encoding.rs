//! The encoding that a payload carries: it names the format and, for bincode, the message, the version of the
//! contract and the hash of the message's layout, so that reordered fields are refused, not misread.

use super::history::Generation;
use super::{CodecError, Format, Message, decode};
use crate::keys::{ROOT, VERSION};
use crate::registry::layout_hash;

const JSON: &str = "application/json";
const BYTES: &str = "application/octet-stream";
const BINCODE: &str = "+bincode";

/// The encoding of a message: `application/json`, or
/// `application/octet-stream;pdn.v1.Keyframe+bincode#0123456789abcdef`, as Zenoh writes an encoding with a
/// schema.
pub fn encoding<T: Message>(format: Format) -> String {
    match format {
        Format::Json => JSON.to_owned(),
        Format::Bincode => format!("{BYTES};{}#{:016x}", schema::<T>(), layout_hash::<T>()),
    }
}

/// The message of a payload of this encoding, also where an earlier version wrote it.
///
/// # Errors
/// As [`format_of`], but for layouts of earlier generations, and as [`decode`].
pub fn decode_encoded<T: Message>(bytes: &[u8], encoding: &str) -> Result<T, CodecError> {
    match format_of::<T>(encoding) {
        Ok(format) => decode(bytes, format),
        Err(CodecError::OtherLayout { message, expected, found }) => {
            let hash = u64::from_str_radix(&found, 16).ok();
            match hash.and_then(Generation::earlier_with::<T>) {
                Some(generation) => generation.decode(bytes),
                None => Err(CodecError::OtherLayout { message, expected, found }),
            }
        }
        Err(error) => Err(error),
    }
}

/// The format in which a payload of this encoding carries a `T` of the present layout. The hash may be
/// missing.
///
/// # Errors
/// `schema_mismatch` if the encoding is none of the contract's, or names another message, version or layout.
pub fn format_of<T: Message>(encoding: &str) -> Result<Format, CodecError> {
    if encoding == JSON {
        return Ok(Format::Json);
    }
    let unknown = || CodecError::UnknownEncoding { message: T::NAME, encoding: shown(encoding) };
    let suffix = encoding.strip_prefix(BYTES).and_then(|rest| rest.strip_prefix(';')).ok_or_else(unknown)?;
    let (found, hash) = match suffix.split_once('#') {
        Some((schema, hash)) => (schema, Some(hash)),
        None => (suffix, None),
    };
    if !found.ends_with(BINCODE) {
        return Err(unknown());
    }
    if found != schema::<T>() {
        return Err(CodecError::OtherMessage { expected: schema::<T>(), found: shown(found) });
    }
    let expected = format!("{:016x}", layout_hash::<T>());
    match hash {
        Some(hash) if hash != expected => {
            Err(CodecError::OtherLayout { message: T::NAME, expected, found: shown(hash) })
        }
        _ => Ok(Format::Bincode),
    }
}

fn schema<T: Message>() -> String {
    format!("{ROOT}.{VERSION}.{}{BINCODE}", T::NAME)
}

/// As much of a foreign text as an error message should repeat.
fn shown(text: &str) -> String {
    text.chars().take(100).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::{Factor, Keyframe};

    #[test]
    fn an_encoding_names_its_format() {
        for format in [Format::Json, Format::Bincode] {
            assert_eq!(format_of::<Keyframe>(&encoding::<Keyframe>(format)), Ok(format));
        }
        let without_hash = "application/octet-stream;pdn.v1.Keyframe+bincode";
        assert_eq!(format_of::<Keyframe>(without_hash), Ok(Format::Bincode));
    }

    #[test]
    fn another_message_version_layout_or_format_is_refused() {
        let other_message = encoding::<Factor>(Format::Bincode);
        assert!(matches!(format_of::<Keyframe>(&other_message), Err(CodecError::OtherMessage { .. })));
        let other_version = "application/octet-stream;pdn.v2.Keyframe+bincode";
        assert!(matches!(format_of::<Keyframe>(other_version), Err(CodecError::OtherMessage { .. })));
        let own = encoding::<Keyframe>(Format::Bincode);
        for hash in ["#0000000000000000", "#", "#0", "#0123456789abcdefg"] {
            let other = format!("{}{hash}", own.split('#').next().unwrap());
            assert!(matches!(format_of::<Keyframe>(&other), Err(CodecError::OtherLayout { .. })), "{other}");
        }
        for foreign in
            ["", "zenoh/bytes", "text/json", "application/octet-stream", "application/octet-stream;x"]
        {
            assert!(
                matches!(format_of::<Keyframe>(foreign), Err(CodecError::UnknownEncoding { .. })),
                "{foreign}"
            );
        }
    }
}
