//! What is left of a damaged journal: its records from the first on, up to the damage.

use crate::history::{Entry, Record};
use crate::journal::error::JournalError;
use crate::journal::frame::{Frame, Place};
use crate::journal::scan::scan;
use crate::journal::{Journal, MAX_GROUP_BYTES, MAX_GROUP_RECORDS};
use pdn_schemas::record::Kind;
use redb::StorageBackend;
use std::collections::{BTreeMap, BTreeSet};

/// The records that are whole and follow one on the other, by where they lie.
#[derive(Debug)]
pub struct Salvage {
    /// Id of the vehicle, by its first record.
    pub vehicle: String,
    /// Id of the mission, by its first record.
    pub mission: String,
    /// Records that can be saved.
    pub records: u64,
    /// Records beyond the damage that are whole and have lost what they follow on.
    pub beyond: u64,
    places: Vec<(u64, usize)>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Found {
    opening: u32,
    crc_before: u32,
    crc: u32,
    offset: u64,
    bytes: usize,
}

impl Salvage {
    /// Looks for records in the bytes of the file, whatever its tables say. The file is only read.
    ///
    /// # Errors
    /// [`JournalError::Foreign`] if there is no first record; [`JournalError::Damaged`] if there are several,
    /// of which none is the file's by anything but a guess; what the disk says.
    pub fn find(storage: &dyn StorageBackend) -> Result<Salvage, JournalError> {
        let identity = the_only_journal(storage)?;
        let mut all: BTreeMap<u64, Vec<Found>> = BTreeMap::new();
        scan(storage, Some(identity), |offset, frame| {
            let Place { number, opening, crc_before, .. } = frame.place;
            let same = all.entry(number).or_default();
            if same.iter().all(|known| (known.opening, known.crc) != (opening, frame.crc)) {
                same.push(Found { opening, crc_before, crc: frame.crc, offset, bytes: frame.payload.len() });
            }
        })?;
        let (mut places, mut crc_before) = (Vec::new(), 0);
        while let Some(found) = all.get(&(places.len() as u64)) {
            let follows = found.iter().filter(|found| found.crc_before == crc_before);
            let Some(next) = follows.max() else { break };
            places.push((next.offset, next.bytes));
            crc_before = next.crc;
        }
        let records = places.len() as u64;
        let beyond = all.range(records..).count() as u64;
        let first = read(storage, 0, *places.first().ok_or_else(no_first)?)?;
        let Entry::Configured(configured) = understood(0, &first)? else { return Err(no_first()) };
        let (vehicle, mission) = (configured.vehicle, configured.config.mission);
        Ok(Salvage { vehicle, mission, records, beyond, places })
    }

    /// Writes the records that can be saved to a new journal.
    ///
    /// # Errors
    /// What either disk says.
    pub fn write(&self, from: &dyn StorageBackend, to: &mut Journal) -> Result<(), JournalError> {
        let (mut group, mut bytes) = (Vec::new(), 0);
        for (number, place) in (0_u64..).zip(&self.places).skip(usize::try_from(to.len()).unwrap_or(0)) {
            let record = read(from, number, *place)?;
            bytes += record.payload.len();
            group.push(record);
            if group.len() == MAX_GROUP_RECORDS || bytes > MAX_GROUP_BYTES {
                to.append(&group)?;
                (group, bytes) = (Vec::new(), 0);
            }
        }
        if group.is_empty() { Ok(()) } else { to.append(&group) }
    }

    /// The first record, with which a new journal begins.
    ///
    /// # Errors
    /// What the disk says.
    pub fn first(&self, storage: &dyn StorageBackend) -> Result<Record, JournalError> {
        read(storage, 0, self.places[0])
    }
}

/// The identity of the journal whose first record is in the storage.
fn the_only_journal(storage: &dyn StorageBackend) -> Result<u64, JournalError> {
    let (mut begun, mut foreign) = (BTreeSet::new(), None);
    scan(storage, None, |_, frame| match frame.record() {
        Ok(record) if frame.place.number == 0 && record.kind == Kind::Configured => {
            begun.insert(frame.place.identity);
        }
        Ok(_) => {}
        Err(error) => foreign = Some(error),
    })?;
    match begun.iter().copied().collect::<Vec<_>>()[..] {
        [identity] => Ok(identity),
        [] => Err(foreign.unwrap_or_else(no_first)),
        _ => {
            let what =
                format!("{} journals begin in it, and which one is its own cannot be told", begun.len());
            Err(JournalError::Damaged { record: Some(0), what })
        }
    }
}

fn no_first() -> JournalError {
    JournalError::Foreign { what: "no first record of a mission is in it".to_owned() }
}

fn understood(number: u64, record: &Record) -> Result<Entry, JournalError> {
    Entry::read(record).map_err(|error| JournalError::damaged(number, error.to_string()))
}

fn read(
    storage: &dyn StorageBackend,
    number: u64,
    (offset, bytes): (u64, usize),
) -> Result<Record, JournalError> {
    let mut frame = vec![0; super::frame::HEAD_BYTES + bytes + 4];
    storage.read(offset, &mut frame)?;
    let changed = || JournalError::damaged(number, "it has changed while it was read");
    Frame::parse(&frame).ok_or_else(changed)?.record()
}
