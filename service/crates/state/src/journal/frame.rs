//! A record in its frame, from which it can be found and judged without the tables around it.
//!
//! ```text
//! bytes   little-endian
//!  0..4   "PDJ1", of which the last character is the format
//!  4..12  identity of the journal, a number drawn when it was made
//! 12..20  number of the record, from 0
//! 20..24  how often the journal has been opened for writing
//! 24..28  kind
//! 28..32  length n of the payload
//! 32..36  CRC-32 of the layouts by which payloads are written, in the order of kinds
//! 36..40  the CRC of the record before, 0 for the first
//! 40..    payload, n bytes
//!   ..+4  CRC-32 (IEEE) of everything from byte 0
//! ```

use crate::history::Record;
use crate::journal::error::JournalError;
use pdn_schemas::codec::history::Generation;
use pdn_schemas::limits::MAX_REPLY_BYTES;
use pdn_schemas::record::Kind;
use pdn_schemas::registry::kind_layout_hash;
use std::collections::BTreeMap;
use std::sync::LazyLock;

/// What a frame begins with.
pub(crate) const MAGIC: [u8; 4] = *b"PDJ1";

/// Bytes before the payload.
pub(crate) const HEAD_BYTES: usize = 40;

/// Where a record stands in its journal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Place {
    /// Which journal.
    pub(crate) identity: u64,
    /// Which record of it.
    pub(crate) number: u64,
    /// In which opening it was written.
    pub(crate) opening: u32,
    /// CRC of the record before.
    pub(crate) crc_before: u32,
}

/// A frame that is whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Frame<'a> {
    pub(crate) place: Place,
    pub(crate) kind: u32,
    /// By which layouts the payload was written.
    pub(crate) layouts: u32,
    pub(crate) payload: &'a [u8],
    pub(crate) crc: u32,
}

/// The record's frame, and its CRC.
pub(crate) fn framed(place: Place, record: &Record) -> (Vec<u8>, u32) {
    let mut bytes = Vec::with_capacity(HEAD_BYTES + record.payload.len() + 4);
    bytes.extend_from_slice(&MAGIC);
    bytes.extend_from_slice(&place.identity.to_le_bytes());
    bytes.extend_from_slice(&place.number.to_le_bytes());
    bytes.extend_from_slice(&place.opening.to_le_bytes());
    bytes.extend_from_slice(&record.kind.number().to_le_bytes());
    let length = u32::try_from(record.payload.len()).unwrap_or(u32::MAX);
    bytes.extend_from_slice(&length.to_le_bytes());
    bytes.extend_from_slice(&layouts().to_le_bytes());
    bytes.extend_from_slice(&place.crc_before.to_le_bytes());
    bytes.extend_from_slice(&record.payload);
    let crc = crc32fast::hash(&bytes);
    bytes.extend_from_slice(&crc.to_le_bytes());
    (bytes, crc)
}

/// Bytes of the frame that begins here, by its head; none if this is no head.
pub(crate) fn length(head: &[u8]) -> Option<usize> {
    let length = head.starts_with(&MAGIC).then(|| u32_at(head, 28)).flatten()? as usize;
    (length <= MAX_REPLY_BYTES).then_some(HEAD_BYTES + length + 4)
}

impl<'a> Frame<'a> {
    /// The frame that these bytes begin with, if it is whole.
    pub(crate) fn parse(bytes: &'a [u8]) -> Option<Frame<'a>> {
        let bytes = bytes.get(..length(bytes)?)?;
        let (body, crc) = bytes.split_at(bytes.len() - 4);
        let crc = u32_at(crc, 0)?;
        if crc32fast::hash(body) != crc {
            return None;
        }
        let place = Place {
            identity: u64_at(body, 4)?,
            number: u64_at(body, 12)?,
            opening: u32_at(body, 20)?,
            crc_before: u32_at(body, 36)?,
        };
        let (kind, layouts) = (u32_at(body, 24)?, u32_at(body, 32)?);
        Some(Frame { place, kind, layouts, payload: &body[HEAD_BYTES..], crc })
    }

    /// The record in it, in the present layout whichever generation wrote it.
    ///
    /// # Errors
    /// [`JournalError::Layout`] if it was written by layouts that this version does not know;
    /// [`JournalError::Damaged`] for a kind that this format has not, or a payload that is none of its
    /// generation's.
    pub(crate) fn record(&self) -> Result<Record, JournalError> {
        let damaged = |what| JournalError::damaged(self.place.number, what);
        let kind =
            || Kind::from_number(self.kind).ok_or_else(|| damaged(format!("there is no kind {}", self.kind)));
        if self.layouts == layouts() {
            return Ok(Record { kind: kind()?, payload: self.payload.to_vec() });
        }
        let earlier = earlier_with(self.layouts).ok_or_else(|| JournalError::Layout {
            schema: "what it records".to_owned(),
            found: self.layouts.into(),
            expected: layouts().into(),
            software: "the version".to_owned(),
        })?;
        let kind = kind()?;
        let payload = earlier.translate(kind, self.payload);
        let payload = payload.map_err(|error| damaged(format!("as an earlier version wrote it: {error}")))?;
        Ok(Record { kind, payload })
    }
}

/// CRC-32 of the hash of each kind's layout.
pub(crate) fn layouts() -> u32 {
    static LAYOUTS: LazyLock<u32> =
        LazyLock::new(|| crc_of(Kind::ALL.iter().map(|kind| kind_layout_hash(*kind))));
    *LAYOUTS
}

/// The generation whose layouts have this CRC.
fn earlier_with(layouts: u32) -> Option<&'static Generation> {
    static BY_CRC: LazyLock<BTreeMap<u32, &Generation>> = LazyLock::new(|| {
        let crc = |generation: &Generation| {
            crc_of(generation.kinds().iter().filter_map(|name| generation.hash(name)))
        };
        Generation::all().iter().map(|generation| (crc(generation), generation)).collect()
    });
    BY_CRC.get(&layouts).copied()
}

fn crc_of(hashes: impl Iterator<Item = u64>) -> u32 {
    let mut crc = crc32fast::Hasher::new();
    hashes.for_each(|hash| crc.update(&hash.to_le_bytes()));
    crc.finalize()
}

fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..at + 4)?.try_into().ok().map(u32::from_le_bytes)
}

fn u64_at(bytes: &[u8], at: usize) -> Option<u64> {
    bytes.get(at..at + 8)?.try_into().ok().map(u64::from_le_bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_whole_or_none() {
        let place = Place { identity: 7, number: 3, opening: 2, crc_before: 9 };
        let record = Record { kind: Kind::Link, payload: b"a payload".to_vec() };
        let (bytes, crc) = framed(place, &record);
        let frame = Frame::parse(&bytes).expect("it is whole");
        assert_eq!((frame.place, frame.crc), (place, crc));
        assert_eq!(frame.record(), Ok(record));
        for end in 0..bytes.len() {
            assert_eq!(Frame::parse(&bytes[..end]), None);
        }
        for bit in 0..8 * bytes.len() {
            let mut flipped = bytes.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            assert_eq!(Frame::parse(&flipped), None, "bit {bit}");
        }
    }

    #[test]
    fn the_newest_generation_has_the_layouts_of_what_is_written() {
        let newest = earlier_with(layouts()).expect("the present layouts are those of a generation");
        assert!(std::ptr::eq(newest, Generation::all().last().expect("there is one")));
        assert!(earlier_with(layouts() ^ 1).is_none());
    }

    /// The published check value of CRC-32 (IEEE).
    #[test]
    fn the_crc_is_the_published_one() {
        assert_eq!(crc32fast::hash(b"123456789"), 0xcbf4_3926);
    }
}
