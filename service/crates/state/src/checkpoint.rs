//! What a mission has come to at one moment, so that its journal need not be solved again from the beginning.
//!
//! A journal is the truth, and a checkpoint only spares time: what events give at once is taken from the
//! journal all the same, and only what was solved for is kept here (linearisation points, steps, the shape of
//! the tree, where each photograph lies). It stands for the moment before the event that begins the last
//! group (see `fold`), names that event's record and the CRC of the one before it, and so belongs to one
//! journal. One that is damaged, of another journal or of another version of the software is passed over:
//! recovery then takes longer, and comes to the same bits.

mod content;

use crate::fold::SolvedState;
use crate::history::SOFTWARE;
use crate::journal::{Journal, JournalError, layouts};

/// What the bytes of a checkpoint begin with, of which the last character is the format.
const MAGIC: [u8; 4] = *b"PDC1";

/// A mission before one of its events.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    /// Number of that event's record in the journal.
    pub record: u64,
    /// Events refused up to and with that one.
    pub(crate) rejected: u64,
    pub(crate) solved: SolvedState,
}

/// What a checkpoint must have been written by to be relied on: this version, and by its layouts.
fn written_by() -> String {
    format!("{SOFTWARE} with layouts {:08x}", layouts())
}

/// Why a checkpoint is of no use.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unusable {
    /// The bytes are not those that were written.
    #[error("it is damaged")]
    Damaged,
    /// It was written by another version.
    #[error("it was written by {0}")]
    Software(String),
    /// It is not of this journal.
    #[error("it belongs to another journal")]
    OtherJournal,
    /// What it keeps does not fit what the journal says.
    #[error("it does not fit the journal: {0}")]
    Unfit(String),
}

impl Checkpoint {
    /// The checkpoint as bytes that belong to this journal. The journal must hold the record that it names.
    ///
    /// # Errors
    /// Those of reading the journal.
    pub fn to_bytes(&self, journal: &Journal) -> Result<Vec<u8>, JournalError> {
        let crc_before = journal.crc_before(self.record)?;
        let mut bytes = MAGIC.to_vec();
        bytes.extend(content::encode(self, &written_by(), journal.header().identity, crc_before));
        bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
        Ok(bytes)
    }

    /// The checkpoint of these bytes, if it belongs to this journal.
    ///
    /// # Errors
    /// Why it is of no use.
    pub fn from_bytes(bytes: &[u8], journal: &Journal) -> Result<Checkpoint, Unusable> {
        let (body, crc) = bytes.split_last_chunk::<4>().ok_or(Unusable::Damaged)?;
        if crc32fast::hash(body) != u32::from_le_bytes(*crc) {
            return Err(Unusable::Damaged);
        }
        let body = body.strip_prefix(&MAGIC).ok_or(Unusable::Damaged)?;
        let (checkpoint, software, identity, crc_before) = content::decode(body)?;
        if software != written_by() {
            return Err(Unusable::Software(software));
        }
        // A record that the journal has not, or not whole, is none that the checkpoint follows on.
        let found = journal.crc_before(checkpoint.record).ok();
        if identity != journal.header().identity || found != Some(crc_before) {
            return Err(Unusable::OtherJournal);
        }
        Ok(checkpoint)
    }
}
