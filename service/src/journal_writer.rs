//! Writes the history of a vehicle's missions, each to its journal: nothing is answered before it is on the
//! disk.
//!
//! Commands and decisions are synced at once, events in groups: `durable_seq` follows the last sync. What
//! cannot be written is pending here, and writing is tried again each second. What is pending is bounded:
//! what must be recorded before it is answered is refused, and so are events beyond
//! [`mission_journal::MAX_PENDING_BYTES`], which a sender that keeps to its 512 under way never reaches.

mod mission_journal;

use crate::clock;
use crate::settings::{Settings, count};
use mission_journal::MissionJournal;
use pdn_schemas::ids::VehicleId;
use pdn_schemas::problem::{Code, Problem};
use pdn_state::journal::files::Journals;
use pdn_state::journal::{Header, Journal, JournalError};
use pdn_state::vehicle::PreparedMission;
use pdn_state::{Mission, Vehicle};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// A vehicle's missions, with the writer of their journals.
pub struct JournaledVehicle {
    /// Id of the vehicle.
    pub id: VehicleId,
    /// Its missions.
    pub vehicle: Vehicle,
    /// The writer of their journals.
    pub journal_writer: JournalWriter,
}

/// The writer of the journals of a vehicle's missions.
pub struct JournalWriter {
    /// None: no history is written.
    journals: Option<Journals>,
    vehicle: VehicleId,
    missions: BTreeMap<String, MissionJournal>,
    sync_events: usize,
    sync: Duration,
    /// Events since the last sync, and when the first of them must be durable.
    unsynced: Option<(usize, Instant)>,
}

impl JournalWriter {
    /// A writer that has no journal yet, for a vehicle below the settings' `state_dir`.
    pub fn new(vehicle: VehicleId, settings: &Settings) -> JournalWriter {
        JournalWriter {
            journals: settings.journals(),
            vehicle,
            missions: BTreeMap::new(),
            sync_events: count(settings.sync_events),
            sync: Duration::from_millis(settings.sync_ms),
            unsynced: None,
        }
    }

    /// Resumes the journal of a mission that has been recovered.
    pub fn resume(&mut self, mission: &str, path: PathBuf, journal: Journal) {
        self.missions.insert(mission.to_owned(), MissionJournal::new(path, journal));
    }

    /// Resumes a journal of so many records that could be read but not be opened for writing.
    pub fn resume_unwritable(&mut self, mission: &str, path: PathBuf, records: u64, error: JournalError) {
        self.missions.insert(mission.to_owned(), MissionJournal::unwritable(path, records, error));
    }

    /// Creates the journal of a mission that is about to be adopted.
    ///
    /// # Errors
    /// `not_durable`; nothing may then depend on the mission.
    pub fn create(&mut self, prepared: &mut PreparedMission) -> Result<(), Problem> {
        let Some(journals) = &self.journals else { return Ok(()) };
        let (mission, ordinal) = (prepared.mission().to_owned(), prepared.ordinal());
        let records = prepared.take_first_records();
        if records.is_empty() {
            return Ok(()); // it goes on in the journal of the one that it replaces
        }
        let path = journals.path(self.vehicle.as_str(), ordinal, &mission);
        let header = Header::new(identity(), self.vehicle.as_str(), &mission);
        match journals.create(header, ordinal, &records) {
            Ok(journal) => {
                self.missions.insert(mission, MissionJournal::new(path, journal));
                Ok(())
            }
            Err(error) => {
                let message = format!(
                    "the journal {} cannot be made: {error}; the mission was not configured",
                    path.display()
                );
                Err(Problem::new(Code::NotDurable, message, None))
            }
        }
    }

    /// Tries once more to write what could not be written of a mission.
    ///
    /// # Errors
    /// `not_durable` if it still cannot be: what was asked must not be done.
    pub fn ensure_writable(&mut self, vehicle: &mut Vehicle, mission: Option<&str>) -> Result<(), Problem> {
        let Ok(mission) = vehicle.mission(mission).map(|mission| mission.id().to_owned()) else {
            return Ok(()); // which is told by whoever asks for it
        };
        if self.missions.get(&mission).is_none_or(|journal| journal.failure().is_none()) {
            return Ok(());
        }
        self.write(vehicle, Instant::now(), true);
        self.check(&mission, "it was not done")
    }

    /// Whether all that has happened to a mission is durable, as far as it was written.
    ///
    /// # Errors
    /// `not_durable`; `done` says what has become of what was asked.
    pub fn check(&self, mission: &str, done: &str) -> Result<(), Problem> {
        let Some(journal) = self.missions.get(mission) else { return Ok(()) };
        let Some(failure) = journal.failure() else { return Ok(()) };
        let message = format!(
            "the journal {} cannot be written: {failure}; {done}, and writing is tried again each second",
            journal.path().display()
        );
        Err(Problem::new(Code::NotDurable, message, None))
    }

    /// Whether an event of a mission may come: not if too much of it waits for the disk.
    pub fn has_room(&self, mission: &str) -> bool {
        self.missions.get(mission).is_none_or(MissionJournal::has_room)
    }

    /// Notes that an event has come.
    pub fn note_event(&mut self, now: Instant) {
        if self.journals.is_some() {
            let (events, due) = self.unsynced.unwrap_or((0, now + self.sync));
            self.unsynced = Some((events + 1, due));
        }
    }

    /// Whether events must be synced, or a failed writing be tried again.
    pub fn is_due(&self, now: Instant) -> bool {
        self.unsynced.is_some_and(|(events, due)| events >= self.sync_events || now >= due)
            || self.missions.values().any(|journal| journal.retry_at().is_some_and(|at| now >= at))
    }

    /// When that will be by the clock.
    pub fn next_due(&self) -> Option<Instant> {
        let retries = self.missions.values().filter_map(MissionJournal::retry_at);
        retries.chain(self.unsynced.map(|(_, due)| due)).min()
    }

    /// Writes and syncs all that has happened. Returns the missions of which more is durable now; what cannot
    /// be written is pending, and the mission's health tells why.
    pub fn sync(&mut self, vehicle: &mut Vehicle) -> Vec<String> {
        self.write(vehicle, Instant::now(), false)
    }

    /// Writes the last, and checkpoints.
    pub fn close(&mut self, vehicle: &mut Vehicle) {
        self.write(vehicle, Instant::now(), true);
        for (id, journal) in &mut self.missions {
            if let Ok(mission) = vehicle.mission(Some(id)) {
                journal.write_checkpoint(mission);
            }
        }
    }

    fn write(&mut self, vehicle: &mut Vehicle, now: Instant, at_once: bool) -> Vec<String> {
        self.unsynced = None;
        if self.journals.is_none() {
            return Vec::new();
        }
        for unwritten in vehicle.take_unwritten() {
            match self.missions.get_mut(&unwritten.mission) {
                Some(journal) => journal.push(unwritten),
                None => tracing::error!(mission = unwritten.mission, "a mission has no journal"),
            }
        }
        let mut durable = Vec::new();
        for (id, journal) in &mut self.missions {
            let had_failed = journal.failure().is_some();
            let waits = had_failed && !at_once && journal.retry_at().is_some_and(|at| now < at);
            if journal.is_written() || waits {
                continue;
            }
            journal.write(now);
            // A mission that the vehicle no longer holds has nobody to be told.
            if let Ok(mission) = vehicle.mission(Some(id)) {
                report(journal, mission, had_failed);
                journal.write_checkpoint_if_due(mission);
            }
            if journal.failure().is_none() {
                durable.push(id.clone());
            }
        }
        let is_held = |id: &String| vehicle.mission_ids().any(|held| held == id);
        self.missions.retain(|id, journal| !journal.is_written() || is_held(id));
        durable
    }
}

/// Reports to the mission how far it is durable, and in its health what is wrong.
fn report(journal: &MissionJournal, mission: &mut Mission, had_failed: bool) {
    let path = journal.path().display();
    match journal.failure() {
        None => {
            mission.set_durable(journal.next_seq());
            if had_failed {
                tracing::info!(mission = mission.id(), journal = %path, "the journal is written again");
                mission.set_concern("journal", None);
            }
        }
        Some(error) => {
            if !had_failed {
                let mission = mission.id();
                tracing::error!(mission, journal = %path, %error, "the journal cannot be written");
            }
            let finding = format!(
                "the journal {path} cannot be written: {error}; what has come since is lost if pdnd ends now"
            );
            mission.set_concern("journal", Some(finding));
        }
    }
}

/// A number that no other journal has. Without a source of chance the clock has to do: it need only differ
/// from that of the journals beside it.
pub fn identity() -> u64 {
    getrandom::u64().unwrap_or_else(|_| clock::now_ns())
}
