//! One mission's journal, what is pending for it, and its checkpoints.

use pdn_state::Mission;
use pdn_state::history::Record;
use pdn_state::journal::{Journal, JournalError, MAX_GROUP_BYTES, MAX_GROUP_RECORDS, files};
use pdn_state::vehicle::Unwritten;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How long after a failure writing is tried again.
const RETRY: Duration = Duration::from_secs(1);

/// Bytes of records that are pending while the disk cannot be written, at most.
pub const MAX_PENDING_BYTES: usize = 16 << 20;

/// Records between checkpoints, and as a share of all: a restart solves for no more than these. A checkpoint
/// costs in proportion to the mission, so a long one has fewer: with 20,000 keyframes one for each 80.
const CHECKPOINT_EVERY: u64 = 256;
const CHECKPOINT_SHARE: u64 = 256;

/// The journal of one mission.
pub struct MissionJournal {
    path: PathBuf,
    /// None after a failure, until it is open again, and once the mission has ended.
    journal: Option<Journal>,
    /// Records that are known to be durable.
    durable: u64,
    /// The records that follow on them, and their bytes.
    pending: Vec<Record>,
    pending_bytes: usize,
    next_seq: u64,
    last: bool,
    /// Records when this process last wrote a checkpoint; one that it recovered from may be old or passed
    /// over.
    checkpoint_at: u64,
    failure: Option<(JournalError, Instant)>,
}

impl MissionJournal {
    /// A mission all of which is in its journal.
    pub fn new(path: PathBuf, journal: Journal) -> MissionJournal {
        let durable = journal.len();
        MissionJournal { journal: Some(journal), ..MissionJournal::closed(path, durable) }
    }

    /// A mission whose journal of so many records cannot be written yet.
    pub fn unwritable(path: PathBuf, durable: u64, error: JournalError) -> MissionJournal {
        MissionJournal { failure: Some((error, Instant::now())), ..MissionJournal::closed(path, durable) }
    }

    fn closed(path: PathBuf, durable: u64) -> MissionJournal {
        MissionJournal {
            path,
            journal: None,
            durable,
            pending: Vec::new(),
            pending_bytes: 0,
            next_seq: 0,
            last: false,
            checkpoint_at: 0,
            failure: None,
        }
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Why it cannot be written, if it cannot.
    pub fn failure(&self) -> Option<&JournalError> {
        self.failure.as_ref().map(|(error, _)| error)
    }

    /// When writing is tried again; never if nothing is pending.
    pub fn retry_at(&self) -> Option<Instant> {
        self.failure.as_ref().filter(|_| !self.is_written()).map(|(_, at)| *at)
    }

    /// All events below are durable once nothing is pending.
    pub fn next_seq(&self) -> u64 {
        self.next_seq
    }

    /// Whether nothing is pending.
    pub fn is_written(&self) -> bool {
        self.pending.is_empty()
    }

    /// Whether more may be pending.
    pub fn has_room(&self) -> bool {
        self.pending_bytes < MAX_PENDING_BYTES
    }

    /// Adds what has happened.
    pub fn push(&mut self, unwritten: Unwritten) {
        self.pending_bytes += unwritten.records.iter().map(|record| record.payload.len()).sum::<usize>();
        self.pending.extend(unwritten.records);
        (self.next_seq, self.last) = (unwritten.next_seq, unwritten.last);
    }

    /// Writes all that is pending; a failure is remembered.
    pub fn write(&mut self, now: Instant) {
        self.failure = self.try_to_write().err().map(|error| (error, now + RETRY));
        if self.failure.is_some() {
            self.journal = None;
        }
    }

    fn try_to_write(&mut self) -> Result<(), JournalError> {
        if self.journal.is_none() {
            let journal = files::open(&self.path)?;
            // What the failed writing has brought to the disk all the same is not written twice. Anything
            // else is not the file that this mission was written to.
            let written = journal.len().checked_sub(self.durable).map(|written| written as usize);
            let written = written.filter(|&written| written <= self.pending.len()).ok_or_else(|| {
                let what = format!("it has {} records where {} were written", journal.len(), self.durable);
                JournalError::Damaged { record: Some(journal.len()), what }
            })?;
            self.pending.drain(..written);
            self.durable = journal.len();
            self.journal = Some(journal);
        }
        let Some(journal) = &mut self.journal else { return Ok(()) };
        while !self.pending.is_empty() {
            let group = group(&self.pending);
            journal.append(&self.pending[..group])?;
            self.pending.drain(..group);
            self.durable = journal.len();
        }
        self.pending_bytes = 0;
        Ok(())
    }

    /// Writes a checkpoint every so many records, and at the mission's end, when it also closes the journal.
    pub fn write_checkpoint_if_due(&mut self, mission: &Mission) {
        if self.failure.is_some() {
            return;
        }
        let every = CHECKPOINT_EVERY.max(self.durable / CHECKPOINT_SHARE);
        if self.last || self.durable - self.checkpoint_at >= every {
            self.write_checkpoint(mission);
        }
        if self.last {
            self.journal = None;
        }
    }

    /// Writes a checkpoint beside the journal. It only spares time: without it recovery comes to the same.
    pub fn write_checkpoint(&mut self, mission: &Mission) {
        let Some(journal) = self.journal.as_ref().filter(|_| self.durable > self.checkpoint_at) else {
            return;
        };
        let Some(checkpoint) = mission.checkpoint() else { return };
        self.checkpoint_at = self.durable;
        let bytes = checkpoint.to_bytes(journal);
        if let Err(error) = bytes.and_then(|bytes| files::keep_checkpoint(&self.path, &bytes)) {
            let (mission, journal) = (mission.id(), self.path.display());
            tracing::warn!(mission, %journal, %error, "no checkpoint could be written");
        }
    }
}

/// How many of these records make one commit.
fn group(records: &[Record]) -> usize {
    let mut bytes = 0;
    let fits = |record: &&Record| {
        bytes += record.payload.len();
        bytes <= MAX_GROUP_BYTES
    };
    records.iter().take(MAX_GROUP_RECORDS).take_while(fits).count().max(1)
}
