//! How far a mission's history has come: what of it is still to be written down, and what is durable.

use crate::error::StateError;
use crate::history::{Entry, Record};
use pdn_schemas::codec::CodecError;
use pdn_schemas::record::Kind;

/// Events turned away that a journal notes; what comes beyond is told on `out/rejected` only, so that a
/// sender who is refused for ever does not fill the disk.
pub const MAX_TURNED_AWAY: u64 = 1024;

/// The history of one mission, seen from the mission.
#[derive(Clone, Debug, Default)]
pub(crate) struct RecordLog {
    /// Records so far, written or not.
    records: u64,
    turned_away: u64,
    /// What waits to be written; none if nobody writes.
    unwritten: Option<Vec<Record>>,
    durable_seq: u64,
}

impl RecordLog {
    /// A history of so many records that nobody keeps.
    pub(crate) fn after(records: u64) -> RecordLog {
        RecordLog { records, ..RecordLog::default() }
    }

    /// From now on what is added after the first `records` waits to be written.
    pub(crate) fn keep(&mut self, records: u64) {
        self.records = records;
        self.unwritten = Some(Vec::new());
    }

    /// Counts a record that is written already.
    pub(crate) fn skip(&mut self, entry: Kind) {
        self.records += 1;
        self.turned_away += u64::from(entry == Kind::TurnedAway);
    }

    /// Records so far.
    pub(crate) fn records(&self) -> u64 {
        self.records
    }

    /// Whether anybody writes.
    pub(crate) fn is_kept(&self) -> bool {
        self.unwritten.is_some()
    }

    /// Adds an entry.
    ///
    /// # Errors
    /// [`StateError::Internal`] if it cannot be encoded; nothing has changed then.
    pub(crate) fn add(&mut self, entry: &Entry) -> Result<(), StateError> {
        self.push(|| entry.record())
    }

    /// Adds an entry that is encoded only if somebody writes.
    ///
    /// # Errors
    /// As [`RecordLog::add`].
    pub(crate) fn push(
        &mut self,
        record: impl FnOnce() -> Result<Record, CodecError>,
    ) -> Result<(), StateError> {
        if self.is_kept() {
            let describe =
                |error| StateError::Internal { evidence: format!("a record cannot be written: {error}") };
            self.push_record(record().map_err(describe)?);
        } else {
            self.records += 1;
        }
        Ok(())
    }

    /// Adds a record.
    pub(crate) fn push_record(&mut self, record: Record) {
        if let Some(unwritten) = &mut self.unwritten {
            unwritten.push(record);
        }
        self.records += 1;
    }

    /// Notes an event that was turned away, as long as there is room for such notes.
    pub(crate) fn turn_away(&mut self, entry: &Entry) -> Result<(), StateError> {
        if self.turned_away >= MAX_TURNED_AWAY {
            return Ok(());
        }
        self.turned_away += 1;
        self.add(entry)
    }

    /// What waits to be written; from now on it is the caller's.
    pub(crate) fn take_unwritten(&mut self) -> Vec<Record> {
        self.unwritten.as_mut().map(std::mem::take).unwrap_or_default()
    }

    /// Every event below is durable.
    pub(crate) fn mark_durable(&mut self, durable_seq: u64) {
        self.durable_seq = self.durable_seq.max(durable_seq);
    }

    /// All events below are durable, of those below `next_seq`. Where nobody writes, applied is all there is.
    pub(crate) fn durable_seq(&self, next_seq: u64) -> u64 {
        if self.is_kept() { self.durable_seq } else { next_seq }
    }
}
