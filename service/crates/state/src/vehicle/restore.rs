//! The missions of earlier runs, taken up from their journals.

use super::Vehicle;
use crate::error::{Absence, StateError};
use crate::lifecycle::{self, Operation};
use crate::mission::Mission;

impl Vehicle {
    /// Notes a mission of an earlier run and why it is not served; the one with the greatest ordinal is the
    /// current one. Its id is spent.
    pub fn set_absent(&mut self, mission: &str, ordinal: u64, why: Absence) {
        self.used_ids.insert(mission.to_owned());
        if ordinal >= self.next_ordinal {
            self.next_ordinal = ordinal + 1;
            self.current = Some(mission.to_owned());
        }
        self.absent.insert(mission.to_owned(), why);
    }

    /// Notes that a mission of an earlier run is not kept; only its id is spent.
    pub fn set_forgotten(&mut self, mission: &str, ordinal: u64) {
        self.used_ids.insert(mission.to_owned());
        self.next_ordinal = self.next_ordinal.max(ordinal + 1);
    }

    /// Takes up a mission that was absent. If it is the current one and under way, it is held until someone
    /// resumes; one that had not ended before its successor was configured is aborted.
    ///
    /// # Errors
    /// [`StateError::Internal`] if its history cannot be noted.
    pub fn take_up(&mut self, mut mission: Mission, now_ns: u64) -> Result<&mut Mission, StateError> {
        let id = mission.id().to_owned();
        self.absent.remove(&id);
        if self.kept_as.is_some() {
            mission.go_on();
        }
        let is_current = self.current.as_ref() == Some(&id);
        if !lifecycle::has_ended(mission.phase()) {
            if is_current {
                mission.reopen(now_ns)?;
            } else {
                mission.command(Operation::Abort, "gave way to its successor before it ended", now_ns)?;
            }
        }
        if lifecycle::has_ended(mission.phase()) {
            let earlier = |ended: &&String| {
                self.missions.get(*ended).is_some_and(|other| other.ordinal() < mission.ordinal())
            };
            let place = self.ended.iter().filter(earlier).count();
            self.ended.insert(place, id.clone());
        }
        self.missions.insert(id.clone(), mission);
        self.mission(Some(&id))
    }
}
