//! Recovers the vehicles of earlier runs from their journals.

use crate::clock::now_ns;
use crate::journal_writer::{JournalWriter, JournaledVehicle};
use crate::settings::Settings;
use pdn_schemas::ids::VehicleId;
use pdn_state::journal::files::{self, JournalFile};
use pdn_state::journal::{Journal, JournalError};
use pdn_state::recovery::{Recovered, recover_from};
use pdn_state::{Absence, Mission, StateError, Vehicle, lifecycle};
use std::time::Instant;

/// Recovers every vehicle below `state_dir`, in the order of their ids. Of each the latest `max_missions`
/// missions come back; one whose journal cannot be read is told, and the others go on.
///
/// # Errors
/// What the disk says of the directories.
pub fn recover_all(settings: &Settings) -> Result<Vec<JournaledVehicle>, JournalError> {
    let Some(journals) = settings.journals() else { return Ok(Vec::new()) };
    let mut all = Vec::new();
    for id in journals.vehicles()? {
        if let Err(error) = journals.remove_unfinished(id.as_str()) {
            tracing::warn!(vehicle = %id, %error, "what an earlier run left unfinished cannot be removed");
        }
        let missions = journals.missions(id.as_str())?;
        if !missions.is_empty() {
            all.push(recover_vehicle(id, &missions, settings));
        }
    }
    Ok(all)
}

/// Recovers the missions of one vehicle. One whose journal cannot be read is absent, and its health tells
/// why.
fn recover_vehicle(id: VehicleId, missions: &[JournalFile], settings: &Settings) -> JournaledVehicle {
    let limits = settings.limits();
    let vehicle = Vehicle::kept(id.as_str(), limits);
    let journal_writer = JournalWriter::new(id.clone(), settings);
    let mut recovered = JournaledVehicle { id, vehicle, journal_writer };
    let (forgotten, served) = missions.split_at(missions.len().saturating_sub(limits.max_missions.max(1)));
    for file in forgotten {
        recovered.vehicle.set_forgotten(&file.mission, file.ordinal);
    }
    for file in served {
        recovered.vehicle.set_absent(&file.mission, file.ordinal, Absence::Reading);
    }
    for file in served {
        if let Err(error) = recover_mission(&mut recovered, file, settings) {
            let path = file.path.display().to_string();
            let why = Absence::Unreadable { file: path.clone(), error };
            let error = StateError::Absent { mission: file.mission.clone(), why: why.clone() };
            tracing::error!(vehicle = %recovered.id, journal = path, %error, "a journal cannot be read");
            recovered.vehicle.set_absent(&file.mission, file.ordinal, why);
        }
    }
    // That what was under way is held by now is part of the history.
    recovered.journal_writer.sync(&mut recovered.vehicle);
    recovered
}

/// Reads a mission's journal, takes the mission up and resumes the journal.
fn recover_mission(
    JournaledVehicle { id, vehicle, journal_writer }: &mut JournaledVehicle,
    file: &JournalFile,
    settings: &Settings,
) -> Result<(), JournalError> {
    let start = Instant::now();
    let StoredMission { recovered, journal, unwritable } = read(file, id.as_str(), settings)?;
    let Recovered { mission, passed_over, differs, .. } = recovered;
    let has_ended = lifecycle::has_ended(mission.phase());
    let mission = vehicle
        .take_up(mission, now_ns())
        .map_err(|error| JournalError::Disk { cause: error.to_string() })?;
    let path = file.path.display().to_string();
    if let Some(reason) = passed_over {
        tracing::warn!(vehicle = %id, journal = path, %reason, "a checkpoint was passed over");
    }
    if let Some(differs) = differs {
        tracing::warn!(vehicle = %id, journal = path, differs, "what is refused differs from what was");
    }
    log_recovered(id, mission, &journal, start);
    match unwritable {
        _ if has_ended => {} // nothing is ever added to it
        None => journal_writer.resume(&file.mission, file.path.clone(), journal),
        Some(error) => {
            tracing::error!(vehicle = %id, journal = path, %error, "the journal cannot be written");
            let records = journal.len();
            drop(journal); // or it could not be opened for writing later
            journal_writer.resume_unwritable(&file.mission, file.path.clone(), records, error);
        }
    }
    Ok(())
}

fn log_recovered(id: &VehicleId, mission: &mut Mission, journal: &Journal, start: Instant) {
    let state = mission.state();
    tracing::info!(
        vehicle = %id, mission = state.mission, phase = ?state.phase, records = journal.len(),
        keyframes = state.keyframes, decisions = state.decisions, taken_over = journal.taken_over(),
        seconds = start.elapsed().as_secs_f64(), "recovered"
    );
}

/// A mission and its journal.
struct StoredMission {
    recovered: Recovered,
    journal: Journal,
    /// Why it is open for reading only, if it is.
    unwritable: Option<JournalError>,
}

fn read(file: &JournalFile, vehicle: &str, settings: &Settings) -> Result<StoredMission, JournalError> {
    let (journal, unwritable) = match files::open(&file.path) {
        Ok(journal) => (journal, None),
        // A disk that cannot be written takes no mission away.
        Err(
            error @ (JournalError::Full { .. } | JournalError::ReadOnly { .. } | JournalError::Denied { .. }),
        ) => (files::view(&file.path)?, Some(error)),
        Err(error) => return Err(error),
    };
    let checkpoint = files::checkpoint(&file.path);
    let recovered = recover_from(&journal, checkpoint.as_deref(), settings.limits())?;
    if recovered.vehicle != vehicle || recovered.mission.id() != file.mission {
        let what =
            format!("it is of mission \"{}\" of vehicle \"{}\"", recovered.mission.id(), recovered.vehicle);
        return Err(JournalError::Foreign { what });
    }
    Ok(StoredMission { recovered, journal, unwritable })
}
