//! The vehicles of earlier runs, as their journals leave them.

use crate::keeper::Keeper;
use crate::settings::Settings;
use crate::vehicle::now_ns;
use pdn_schemas::ids::VehicleId;
use pdn_state::journal::files::{self, JournalFile};
use pdn_state::journal::{Journal, JournalError};
use pdn_state::recovery::{Recovered, recover_from};
use pdn_state::{Absence, StateError, Vehicle, lifecycle};
use std::time::Instant;

/// A vehicle that has come back.
pub struct Returned {
    /// Its id.
    pub id: VehicleId,
    /// Its missions.
    pub vehicle: Vehicle,
    /// Their journals.
    pub keeper: Keeper,
}

/// Recovers every vehicle below `state_dir`, in the order of their ids. Of each the latest `max_missions` missions come
/// back; one whose journal cannot be read is told, and the others go on.
///
/// # Errors
/// What the disk says of the directories.
pub fn recover_all(settings: &Settings) -> Result<Vec<Returned>, JournalError> {
    let Some(journals) = settings.journals() else { return Ok(Vec::new()) };
    let mut all = Vec::new();
    for id in journals.vehicles()? {
        if let Err(error) = journals.remove_unfinished(id.as_str()) {
            tracing::warn!(vehicle = %id, %error, "what an earlier run left unfinished cannot be removed");
        }
        let kept = journals.missions(id.as_str())?;
        if !kept.is_empty() {
            all.push(recover_vehicle(id, &kept, settings));
        }
    }
    Ok(all)
}

fn recover_vehicle(id: VehicleId, kept: &[JournalFile], settings: &Settings) -> Returned {
    let limits = settings.limits();
    let mut vehicle = Vehicle::kept(id.as_str(), limits);
    let mut keeper = Keeper::new(id.clone(), settings);
    let (forgotten, kept) = kept.split_at(kept.len().saturating_sub(limits.max_missions.max(1)));
    forgotten.iter().for_each(|kept| vehicle.set_forgotten(&kept.mission, kept.ordinal));
    kept.iter().for_each(|kept| vehicle.set_absent(&kept.mission, kept.ordinal, Absence::Reading));
    for kept in kept {
        let start = Instant::now();
        let file = kept.path.display().to_string();
        let taken = read(kept, id.as_str(), settings).and_then(|Read { recovered, journal, unwritable }| {
            let Recovered { mission, passed_over, differs, .. } = recovered;
            let has_ended = lifecycle::has_ended(mission.phase());
            let error = |error: StateError| JournalError::Disk { cause: error.to_string() };
            let state = vehicle.take_up(mission, now_ns()).map_err(error)?.state();
            Ok((state, journal, unwritable, has_ended, (passed_over, differs)))
        });
        match taken {
            Ok((state, journal, unwritable, has_ended, (passed_over, differs))) => {
                if let Some(reason) = passed_over {
                    tracing::warn!(vehicle = %id, journal = file, %reason, "a checkpoint was passed over");
                }
                if let Some(differs) = differs {
                    tracing::warn!(vehicle = %id, journal = file, differs, "what is refused differs from what was");
                }
                let seconds = start.elapsed().as_secs_f64();
                tracing::info!(
                    vehicle = %id, mission = kept.mission, phase = ?state.phase, records = journal.len(),
                    keyframes = state.keyframes, decisions = state.decisions, taken_over = journal.taken_over(),
                    seconds, "recovered"
                );
                let (mission, path, records) = (&kept.mission, kept.path.clone(), journal.len());
                match unwritable {
                    _ if has_ended => {} // nothing is ever added to it
                    None => keeper.go_on(mission, path, journal),
                    Some(error) => {
                        tracing::error!(vehicle = %id, journal = file, %error, "the journal cannot be written");
                        drop(journal); // or it could not be opened for writing later
                        keeper.go_on_later(mission, path, records, error);
                    }
                }
            }
            Err(error) => {
                let why = Absence::Unreadable { file: file.clone(), error };
                let error = StateError::Absent { mission: kept.mission.clone(), why: why.clone() };
                tracing::error!(vehicle = %id, journal = file, %error, "a journal cannot be read");
                vehicle.set_absent(&kept.mission, kept.ordinal, why);
            }
        }
    }
    // That what was under way is held by now is part of the history.
    keeper.sync(&mut vehicle);
    Returned { id, vehicle, keeper }
}

/// A mission and its journal.
struct Read {
    recovered: Recovered,
    journal: Journal,
    /// Why it is open for reading only, if it is.
    unwritable: Option<JournalError>,
}

fn read(kept: &JournalFile, vehicle: &str, settings: &Settings) -> Result<Read, JournalError> {
    let (journal, unwritable) = match files::open(&kept.path) {
        Ok(journal) => (journal, None),
        // A disk that cannot be written takes no mission away.
        Err(
            error @ (JournalError::Full { .. } | JournalError::ReadOnly { .. } | JournalError::Denied { .. }),
        ) => (files::view(&kept.path)?, Some(error)),
        Err(error) => return Err(error),
    };
    let checkpoint = files::checkpoint(&kept.path);
    let recovered = recover_from(&journal, checkpoint.as_deref(), settings.limits())?;
    if recovered.vehicle != vehicle || recovered.mission.id() != kept.mission {
        let what =
            format!("it is of mission \"{}\" of vehicle \"{}\"", recovered.mission.id(), recovered.vehicle);
        return Err(JournalError::Foreign { what });
    }
    Ok(Read { recovered, journal, unwritable })
}
