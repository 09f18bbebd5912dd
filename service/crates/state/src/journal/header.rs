//! What a journal says of itself, before any record is read.

use crate::history::SOFTWARE;
use crate::journal::error::JournalError;
use pdn_schemas::codec::history::Generation;
use pdn_schemas::record::{JOURNAL_FORMAT, Kind};
use pdn_schemas::registry::kind_layout_hash;
use redb::{Database, ReadableDatabase, ReadableTable, TableDefinition, WriteTransaction};
use std::collections::BTreeMap;

const HEADER: TableDefinition<&str, &str> = TableDefinition::new("header");
const LAYOUTS: TableDefinition<&str, u64> = TableDefinition::new("layouts");

/// What a journal says of itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Header {
    /// A number drawn when the journal was made, by which its records are told from all others.
    pub identity: u64,
    /// Id of the vehicle.
    pub vehicle: String,
    /// Id of the mission.
    pub mission: String,
    /// What made it.
    pub software: String,
}

impl Header {
    /// The header of a new journal.
    pub fn new(identity: u64, vehicle: &str, mission: &str) -> Header {
        let (vehicle, mission) = (vehicle.to_owned(), mission.to_owned());
        Header { identity, vehicle, mission, software: SOFTWARE.to_owned() }
    }

    pub(super) fn write(&self, group: &WriteTransaction) -> Result<(), JournalError> {
        let mut header = group.open_table(HEADER)?;
        header.insert("format", JOURNAL_FORMAT.to_string().as_str())?;
        header.insert("identity", format!("{:016x}", self.identity).as_str())?;
        header.insert("vehicle", self.vehicle.as_str())?;
        header.insert("mission", self.mission.as_str())?;
        header.insert("software", self.software.as_str())?;
        let mut layouts = group.open_table(LAYOUTS)?;
        for kind in Kind::ALL {
            layouts.insert(kind.schema(), kind_layout_hash(*kind))?;
        }
        Ok(())
    }

    /// Reads and judges it: this version must know the format, and the layouts of every message and record as
    /// those of one generation.
    pub(super) fn read(tables: &Database) -> Result<Header, JournalError> {
        let read = tables.begin_read()?;
        let table = read.open_table(HEADER)?;
        let text = |name: &str| -> Result<String, JournalError> {
            let missing = || JournalError::Foreign { what: format!("its header has no \"{name}\"") };
            Ok(ReadableTable::get(&table, name)?.ok_or_else(missing)?.value().to_owned())
        };
        let software = text("software")?;
        let found = text("format")?;
        if found != JOURNAL_FORMAT.to_string() {
            return Err(JournalError::Format { found, expected: JOURNAL_FORMAT, software });
        }
        let mut layouts = BTreeMap::new();
        for entry in read.open_table(LAYOUTS)?.iter()? {
            let (schema, hash) = entry?;
            layouts.insert(schema.value().to_owned(), hash.value());
        }
        judge(&layouts, &software)?;
        let identity = u64::from_str_radix(&text("identity")?, 16)
            .map_err(|error| JournalError::Foreign { what: format!("its identity: {error}") })?;
        Ok(Header { identity, vehicle: text("vehicle")?, mission: text("mission")?, software })
    }
}

/// Whether some generation had these layouts. Each frame says by which it was written; these are what the
/// journal began with.
fn judge(layouts: &BTreeMap<String, u64>, software: &str) -> Result<(), JournalError> {
    let has = |schema: &str, hash: Option<u64>| layouts.get(schema).copied() == hash;
    let is_of =
        |generation: &Generation| generation.kinds().iter().all(|name| has(name, generation.hash(name)));
    if Generation::all().iter().any(is_of) {
        return Ok(());
    }
    let other = Kind::ALL.iter().find(|kind| !has(kind.schema(), Some(kind_layout_hash(**kind))));
    other.map_or(Ok(()), |kind| {
        Err(JournalError::Layout {
            schema: kind.schema().to_owned(),
            found: layouts.get(kind.schema()).copied().unwrap_or(0),
            expected: kind_layout_hash(*kind),
            software: software.to_owned(),
        })
    })
}
