//! Frames found in the bytes of a file, whatever the tables in it say: what is left of a damaged journal, and
//! what a crash left between written and committed.
//!
//! A page of the tree is copied whenever a record is added beside others, so a record is found several times,
//! with the same bytes. Within a whole frame nothing is looked for: what a payload carries is no frame.
//! Payloads that were overwritten in part may show what a sender has put into them, and a sender may mean
//! harm; but no sender knows the journal's identity.

use crate::journal::error::JournalError;
use crate::journal::frame::{Frame, HEAD_BYTES, MAGIC, length};
use memchr::memmem::Finder;
use redb::StorageBackend;
use std::io;

/// Bytes that are read at once.
const WINDOW_BYTES: usize = 4 << 20;

/// Bytes that heads without a whole frame may make one read in vain, as a multiple of the file's length. Only
/// a file made to hurt comes near it.
const MAX_VAIN_SHARE: u64 = 64;

/// Shows every whole frame with its offset to the visitor: those of the journal of that identity, or of any.
///
/// # Errors
/// Those of the storage; [`JournalError::Damaged`] for a file of little but broken heads.
pub(crate) fn scan(
    storage: &dyn StorageBackend,
    identity: Option<u64>,
    mut visit: impl FnMut(u64, &Frame),
) -> Result<(), JournalError> {
    let mut sought = MAGIC.to_vec();
    sought.extend(identity.into_iter().flat_map(u64::to_le_bytes));
    let finder = Finder::new(&sought);
    let end = storage.len()?;
    let (mut offset, mut vain, mut window) = (0_u64, 0_u64, Vec::new());
    while end.saturating_sub(offset) >= (HEAD_BYTES + 4) as u64 {
        read(storage, offset, WINDOW_BYTES, end, &mut window)?;
        let mut at = 0;
        offset = loop {
            let Some(found) = finder.find(&window[at..]) else {
                break offset + (window.len() + 1 - sought.len()) as u64;
            };
            at += found;
            let (place, rest) = (offset + at as u64, &window[at..]);
            if rest.len() < HEAD_BYTES && place + HEAD_BYTES as u64 <= end {
                break place; // the head goes on behind the window
            }
            let needed = length(rest).unwrap_or(0);
            if needed > rest.len() && place + needed as u64 <= end {
                let mut whole = Vec::new();
                read(storage, place, needed, end, &mut whole)?;
                vain += needed as u64;
                if let Some(frame) = Frame::parse(&whole) {
                    visit(place, &frame);
                    vain -= needed as u64;
                    break place + needed as u64;
                }
            } else if let Some(frame) = Frame::parse(rest) {
                visit(place, &frame);
                at += needed;
                continue;
            } else if needed <= rest.len() {
                vain += needed as u64;
            }
            if vain / MAX_VAIN_SHARE > end {
                let what = "it is full of heads of records that are not there".to_owned();
                return Err(JournalError::Damaged { record: None, what });
            }
            at += 1;
        };
    }
    Ok(())
}

/// Reads `wanted` bytes, or those that are left before `end`.
fn read(
    storage: &dyn StorageBackend,
    offset: u64,
    wanted: usize,
    end: u64,
    bytes: &mut Vec<u8>,
) -> io::Result<()> {
    let left = usize::try_from(end - offset).unwrap_or(usize::MAX);
    bytes.clear();
    bytes.resize(wanted.min(left), 0);
    storage.read(offset, bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::history::Record;
    use crate::journal::frame::{Place, framed};
    use pdn_schemas::record::Kind;
    use redb::backends::InMemoryBackend;

    fn storage(bytes: &[u8]) -> InMemoryBackend {
        let storage = InMemoryBackend::new();
        storage.set_len(bytes.len() as u64).expect("memory grows");
        storage.write(0, bytes).expect("memory is written");
        storage
    }

    fn found(bytes: &[u8]) -> Vec<(u64, u64)> {
        let found = [None, Some(1)].map(|identity| {
            let mut found = Vec::new();
            let visit = |offset, frame: &Frame| found.push((offset, frame.place.number));
            scan(&storage(bytes), identity, visit).expect("memory is read");
            found
        });
        assert_eq!(found[0], found[1]);
        found[0].clone()
    }

    fn frame(number: u64, payload: Vec<u8>) -> Vec<u8> {
        let place = Place { identity: 1, number, opening: 1, crc_before: 0 };
        framed(place, &Record { kind: Kind::Link, payload }).0
    }

    #[test]
    fn frames_are_found_wherever_they_lie() {
        let mut bytes = vec![0; 77];
        let mut expected = Vec::new();
        for (number, length) in
            [0, 5, 100, WINDOW_BYTES - 200, 3 * WINDOW_BYTES, 1, 60].into_iter().enumerate()
        {
            expected.push((bytes.len() as u64, number as u64));
            bytes.extend(frame(number as u64, vec![b'P'; length]));
            bytes.extend(&MAGIC[..number % 4]); // beginnings of heads, which must not hide what follows
        }
        assert_eq!(found(&bytes), expected);
        let cut = bytes.len() - 10;
        assert_eq!(found(&bytes[..cut]), expected[..6]);
    }

    #[test]
    fn a_frame_within_a_payload_is_none_unless_its_outside_is_broken() {
        let mut bytes = frame(1, frame(666, vec![]));
        assert_eq!(found(&bytes), [(0, 1)]);
        bytes[20] ^= 1;
        assert_eq!(found(&bytes), [(HEAD_BYTES as u64, 666)]);
    }

    #[test]
    fn a_file_of_broken_heads_does_not_take_for_ever() {
        let mut head = frame(0, vec![]);
        head[28..32].copy_from_slice(&1_000_000_u32.to_le_bytes());
        let bytes = head.repeat(1 << 16);
        assert!(scan(&storage(&bytes), None, |_, _| {}).is_err());
        scan(&storage(&bytes), Some(2), |_, _| {}).expect("none of the heads is the journal's");
    }
}
