//! The durable record of a mission: a file to which records are added and never changed.
//!
//! Reading order: [`error`] (what can become of a journal), `frame` (a record with what it needs to be found
//! and judged alone), `header` (what the file says of itself), here the tables that hold the frames, `scan`
//! (frames without tables), `salvage` (what is left of a damaged file), `overlay` (reading without a trace),
//! [`files`] (which file is whose).
//!
//! The tables are redb's: a tree of pages that are copied, never overwritten, with a checksum each, and two
//! alternating roots. A commit writes pages and root, syncs, makes the root the valid one, and syncs again;
//! so a root that is valid is whole, and whatever else is found was never acknowledged. The checksums are
//! read when the file is opened. A frame has its own CRC and that of the frame before it: a record is what
//! was written, and comes after what it came after.

pub mod error;
mod frame;
mod header;
mod scan;

pub mod files;
mod overlay;
pub mod salvage;

pub use error::JournalError;
pub(crate) use frame::layouts;
pub use header::Header;

use crate::history::Record;
use frame::{Frame, Place, framed};
use overlay::Overlay;
use redb::{
    Builder, Database, ReadOnlyTable, ReadableDatabase, ReadableTable, ReadableTableMetadata, StorageBackend,
    TableDefinition,
};
use std::collections::BTreeMap;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

const RECORDS: TableDefinition<u64, &[u8]> = TableDefinition::new("records");

/// Bytes that the tables of one journal keep in memory.
const CACHE_BYTES: usize = 8 << 20;

/// Records of one commit at most; what more there is waits for the next.
pub const MAX_GROUP_RECORDS: usize = 8192;

/// Bytes of the payloads of one commit at most, but for the last of its records.
pub const MAX_GROUP_BYTES: usize = 32 << 20;

/// A journal that is open.
#[derive(Debug)]
pub struct Journal {
    tables: Database,
    header: Header,
    opening: u32,
    next: Next,
    taken_over: u64,
}

/// The place of the next record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Next {
    number: u64,
    crc_before: u32,
}

impl Journal {
    /// Makes a journal in empty storage, with its first records; they are durable when this returns.
    ///
    /// # Errors
    /// What the disk says. The storage must then be made empty before it is used again.
    pub fn create(
        storage: impl StorageBackend,
        header: Header,
        records: &[Record],
    ) -> Result<Journal, JournalError> {
        let tables = Builder::new().set_cache_size(CACHE_BYTES).create_with_backend(storage)?;
        let next = Next { number: 0, crc_before: 0 };
        let mut journal = Journal { tables, header, opening: 1, next, taken_over: 0 };
        journal.commit(records, true)?;
        Ok(journal)
    }

    /// Opens a journal to go on with it. Every page is compared with its checksum before anything is written,
    /// and records that a crash left written but not committed are taken over if they are whole and follow on
    /// the last.
    ///
    /// # Errors
    /// Each outcome by its name; a storage that is not whole is left as it is.
    pub fn open(storage: impl StorageBackend) -> Result<Journal, JournalError> {
        let storage: Arc<dyn StorageBackend> = Arc::new(storage);
        let (header, last) = guarded(|| {
            let mut builder = Builder::new();
            builder.set_cache_size(CACHE_BYTES).set_check_integrity_on_open(true);
            let tables = builder.create_with_backend(Overlay::new(storage.clone())?)?;
            let header = Header::read(&tables)?;
            let last = last_frame(&tables, &header)?;
            Ok((header, last))
        })?;
        let left = uncommitted(storage.as_ref(), header.identity, last.next)?;
        let tables = guarded(|| {
            Ok(Builder::new().set_cache_size(CACHE_BYTES).create_with_backend(Shared(storage))?)
        })?;
        let (opening, taken_over) = (last.opening + 1, left.len() as u64);
        let mut journal = Journal { tables, header, opening, next: last.next, taken_over };
        if !left.is_empty() {
            journal.append(&left)?;
        }
        Ok(journal)
    }

    /// What it says of itself.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Records in it, all durable.
    pub fn len(&self) -> u64 {
        self.next.number
    }

    /// Whether there is none, which no whole journal is.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Records that a crash had left uncommitted and that were taken over by [`Journal::open`].
    pub fn taken_over(&self) -> u64 {
        self.taken_over
    }

    /// Adds records, at most [`MAX_GROUP_RECORDS`]; all are durable when this returns.
    ///
    /// # Errors
    /// What the disk says. How many of the records are in the journal is then only known after it has been
    /// opened anew, and until then nothing can be added.
    pub fn append(&mut self, records: &[Record]) -> Result<(), JournalError> {
        self.commit(records, false)
    }

    /// The records in order, each compared with its CRC and with that of the one before it.
    ///
    /// # Errors
    /// What the disk says.
    pub fn records(&self) -> Result<Records, JournalError> {
        guarded(|| {
            let table = self.tables.begin_read()?.open_table(RECORDS)?;
            Ok(Records {
                table,
                identity: self.header.identity,
                next: Next { number: 0, crc_before: 0 },
                len: self.len(),
            })
        })
    }

    /// CRC of the record before this one, by which what belongs to the journal up to there is known; 0 before
    /// the first.
    ///
    /// # Errors
    /// [`JournalError::Damaged`] if the record before is not in it or not whole, and what the disk says.
    pub fn crc_before(&self, number: u64) -> Result<u32, JournalError> {
        let Some(before) = number.checked_sub(1) else { return Ok(0) };
        guarded(|| {
            let table = self.tables.begin_read()?.open_table(RECORDS)?;
            let missing = || JournalError::damaged(before, "it is not in the table");
            let bytes = ReadableTable::get(&table, before)?.ok_or_else(missing)?;
            Ok(whole(bytes.value(), self.header.identity, before)?.crc)
        })
    }

    fn commit(&mut self, records: &[Record], first: bool) -> Result<(), JournalError> {
        let mut next = self.next;
        let mut group = self.tables.begin_write()?;
        // One sync for pages and root, one for the root's validity: what is valid was whole before.
        group.set_two_phase_commit(true);
        if first {
            self.header.write(&group)?;
        }
        {
            let mut table = group.open_table(RECORDS)?;
            for record in records {
                let place = Place {
                    identity: self.header.identity,
                    number: next.number,
                    opening: self.opening,
                    crc_before: next.crc_before,
                };
                let (bytes, crc) = framed(place, record);
                table.insert(next.number, bytes.as_slice())?;
                next = Next { number: next.number + 1, crc_before: crc };
            }
        }
        group.commit()?;
        self.next = next;
        Ok(())
    }
}

/// The records of a journal, in order.
pub struct Records {
    table: ReadOnlyTable<u64, &'static [u8]>,
    identity: u64,
    next: Next,
    len: u64,
}

impl Records {
    /// The next record with its number.
    fn read(&mut self) -> Result<Record, JournalError> {
        let number = self.next.number;
        let found = guarded(|| {
            let missing = || JournalError::damaged(number, "it is not in the table");
            let bytes = ReadableTable::get(&self.table, number)?.ok_or_else(missing)?;
            let frame = whole(bytes.value(), self.identity, number)?;
            if frame.place.crc_before != self.next.crc_before {
                return Err(JournalError::damaged(number, "it does not follow on the one before it"));
            }
            Ok((frame.record()?, frame.crc))
        });
        let (record, crc_before) = found?;
        self.next = Next { number: number + 1, crc_before };
        Ok(record)
    }
}

impl Iterator for Records {
    type Item = Result<(u64, Record), JournalError>;

    fn next(&mut self) -> Option<Self::Item> {
        let number = self.next.number;
        if number >= self.len {
            return None;
        }
        let read = self.read();
        if read.is_err() {
            self.len = number; // nothing follows on what is damaged
        }
        Some(read.map(|record| (number, record)))
    }
}

/// Files that were damaged from outside are found out by checksums; should one make the tables stumble before
/// that, it is damaged as well.
fn guarded<T>(act: impl FnOnce() -> Result<T, JournalError>) -> Result<T, JournalError> {
    catch_unwind(AssertUnwindSafe(act)).unwrap_or_else(|_| {
        Err(JournalError::Damaged { record: None, what: "its tables do not hold together".to_owned() })
    })
}

/// The last record of a journal.
struct Last {
    opening: u32,
    next: Next,
}

fn last_frame(tables: &Database, header: &Header) -> Result<Last, JournalError> {
    let table = tables.begin_read()?.open_table(RECORDS)?;
    let empty = || JournalError::damaged(0, "there is no record");
    let (number, bytes) = ReadableTable::last(&table)?.ok_or_else(empty)?;
    let number = number.value();
    if table.len()? != number + 1 {
        return Err(JournalError::damaged(number, "there are fewer records than their numbers say"));
    }
    let frame = whole(bytes.value(), header.identity, number)?;
    let next = Next { number: number + 1, crc_before: frame.crc };
    Ok(Last { opening: frame.place.opening, next })
}

fn whole(bytes: &[u8], identity: u64, number: u64) -> Result<Frame<'_>, JournalError> {
    let broken = || JournalError::damaged(number, "its CRC is not that of its bytes");
    let frame = Frame::parse(bytes).ok_or_else(broken)?;
    if (frame.place.identity, frame.place.number) != (identity, number) {
        return Err(JournalError::damaged(number, "another record stands in its place"));
    }
    Ok(frame)
}

/// The records that lie in the storage outside of the tables and follow on the last one, one on the other; of
/// several in one place those of the latest opening.
fn uncommitted(
    storage: &dyn StorageBackend,
    identity: u64,
    mut next: Next,
) -> Result<Vec<Record>, JournalError> {
    let mut found: BTreeMap<u64, Vec<(Place, u32, Record)>> = BTreeMap::new();
    let numbers = next.number..next.number + MAX_GROUP_RECORDS as u64;
    scan::scan(storage, Some(identity), |_, frame| {
        let (true, Ok(record)) = (numbers.contains(&frame.place.number), frame.record()) else { return };
        let same = found.entry(frame.place.number).or_default();
        if same.iter().all(|(place, crc, _)| (*place, *crc) != (frame.place, frame.crc)) {
            same.push((frame.place, frame.crc, record));
        }
    })?;
    let mut left = Vec::new();
    while let Some(same) = found.remove(&next.number) {
        let follows = |(place, ..): &(Place, u32, Record)| place.crc_before == next.crc_before;
        let latest = same.into_iter().filter(follows).max_by_key(|(place, ..)| place.opening);
        let Some((_, crc_before, record)) = latest else { break };
        next = Next { number: next.number + 1, crc_before };
        left.push(record);
    }
    Ok(left)
}

/// Storage that is read beside the tables.
#[derive(Debug)]
struct Shared(Arc<dyn StorageBackend>);

impl StorageBackend for Shared {
    fn len(&self) -> io::Result<u64> {
        self.0.len()
    }

    fn read(&self, offset: u64, out: &mut [u8]) -> io::Result<()> {
        self.0.read(offset, out)
    }

    fn set_len(&self, len: u64) -> io::Result<()> {
        self.0.set_len(len)
    }

    fn sync_data(&self) -> io::Result<()> {
        self.0.sync_data()
    }

    fn write(&self, offset: u64, data: &[u8]) -> io::Result<()> {
        self.0.write(offset, data)
    }

    fn close(&self) -> io::Result<()> {
        self.0.close()
    }
}
