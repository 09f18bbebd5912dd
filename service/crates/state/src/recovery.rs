//! A mission from its journal: the same fold over the same entries.

use crate::checkpoint::{Checkpoint, Unusable};
use crate::error::StateError;
use crate::history::{Entry, SOFTWARE};
use crate::journal::{Journal, JournalError};
use crate::limits::Limits;
use crate::mission::Mission;
use pdn_schemas::problem::Problem;
use pdn_schemas::record::Configured;
use std::collections::VecDeque;

/// A mission as its journal leaves it.
#[derive(Clone, Debug)]
pub struct Recovered {
    /// The mission. Its history goes on with the journal's.
    pub mission: Mission,
    /// The vehicle whose it is.
    pub vehicle: String,
    /// Where refusals came out other than recorded, if anywhere: another version of the software wrote them.
    pub differs: Option<String>,
    /// Why a checkpoint was passed over, if one was.
    pub passed_over: Option<Unusable>,
}

/// As [`recover`], from a checkpoint on if there are bytes of one and it is of this journal: the same
/// mission, bit for bit, but nothing before the checkpoint is solved for again, and refusals before it are
/// taken as they stand.
///
/// # Errors
/// As [`recover`].
pub fn recover_from(
    journal: &Journal,
    checkpoint: Option<&[u8]>,
    limits: Limits,
) -> Result<Recovered, JournalError> {
    let Some(checkpoint) = checkpoint else { return recover(journal, limits) };
    let passed_over = match Checkpoint::from_bytes(checkpoint, journal) {
        Err(unusable) => unusable,
        Ok(checkpoint) => match fold(journal, Recovery::to(checkpoint, limits)) {
            Ok(recovered) => return Ok(recovered),
            // Should the journal itself be damaged, it is found again without the checkpoint.
            Err(error) => Unusable::Unfit(error.to_string()),
        },
    };
    Ok(Recovered { passed_over: Some(passed_over), ..recover(journal, limits)? })
}

/// Folds the whole journal.
///
/// # Errors
/// [`JournalError::Damaged`] from the first record on that is not whole or cannot be history: nothing is
/// passed over.
pub fn recover(journal: &Journal, limits: Limits) -> Result<Recovered, JournalError> {
    fold(journal, Recovery::new(limits))
}

fn fold(journal: &Journal, mut recovery: Recovery) -> Result<Recovered, JournalError> {
    for read in journal.records()? {
        let (number, record) = read?;
        let entry = Entry::read(&record).map_err(|error| JournalError::damaged(number, error.to_string()))?;
        recovery.take(entry).map_err(|what| JournalError::damaged(number, what))?;
    }
    recovery.finish_fast_forward().map_err(|what| JournalError::damaged(journal.len(), what))?;
    recovery.finish().ok_or_else(|| JournalError::damaged(0, "there is no record"))
}

/// A mission on its way from entry to entry. Refusals that follow from the entries are compared with those
/// recorded.
#[derive(Clone, Debug)]
pub struct Recovery {
    limits: Limits,
    mission: Option<Mission>,
    vehicle: String,
    expected: VecDeque<Problem>,
    differs: Option<String>,
    /// Where nothing is solved for yet: the checkpoint ahead.
    checkpoint: Option<Box<Checkpoint>>,
}

impl Recovery {
    /// Before the first entry. `limits` give what the mission's own bounds do not name.
    pub fn new(limits: Limits) -> Recovery {
        Recovery {
            limits,
            mission: None,
            vehicle: String::new(),
            expected: VecDeque::new(),
            differs: None,
            checkpoint: None,
        }
    }

    /// Before the first entry, with a checkpoint ahead.
    fn to(checkpoint: Checkpoint, limits: Limits) -> Recovery {
        Recovery { checkpoint: Some(Box::new(checkpoint)), ..Recovery::new(limits) }
    }

    /// The mission so far; none before the first entry.
    pub fn mission(&mut self) -> Option<&mut Mission> {
        self.mission.as_mut()
    }

    /// The next entry.
    ///
    /// # Errors
    /// Why no mission has ever had this history.
    pub fn take(&mut self, entry: Entry) -> Result<(), String> {
        // Refusals that follow on the checkpoint's event are of the group before it.
        if !matches!(entry, Entry::Refused(_)) {
            self.finish_fast_forward()?;
        }
        if let Entry::Configured(configured) = entry {
            return self.configure(*configured);
        }
        match &entry {
            Entry::Refused(found) if self.checkpoint.is_none() => self.compare(found),
            Entry::Refused(_) => {}
            Entry::Reopened(_) => self.expected.clear(), // a crash may have kept some from being recorded
            _ => self.miss_none(),                       // refusals are recorded right behind their event
        }
        let Some(mission) = &mut self.mission else {
            return Err("the mission was not configured before it".to_owned());
        };
        let refused = mission.replay(entry).map_err(|error| error.to_string())?;
        self.expected.extend(refused);
        Ok(())
    }

    /// The mission, unless there was no entry.
    pub fn finish(mut self) -> Option<Recovered> {
        let mission = self.mission.take()?;
        Some(Recovered { mission, vehicle: self.vehicle, differs: self.differs, passed_over: None })
    }

    /// Arrives at the checkpoint if its event was the last one taken.
    fn finish_fast_forward(&mut self) -> Result<(), String> {
        let Some(mission) = &mut self.mission else { return Ok(()) };
        let is_behind = |checkpoint: &mut Box<Checkpoint>| checkpoint.record < mission.records();
        self.checkpoint
            .take_if(is_behind)
            .map_or(Ok(()), |checkpoint| mission.finish_fast_forward(*checkpoint))
    }

    fn configure(&mut self, configured: Configured) -> Result<(), String> {
        let records = match &self.mission {
            Some(mission) if mission.is_untouched() && mission.id() == configured.config.mission => {
                mission.records()
            }
            Some(mission) => return Err(format!("mission \"{}\" had begun already", mission.id())),
            None => 0,
        };
        self.vehicle.clone_from(&configured.vehicle);
        let mut mission = Mission::configured(configured, self.limits, records)
            .map_err(|error: StateError| error.to_string())?;
        if self.checkpoint.is_some() {
            mission.begin_fast_forward();
        }
        self.mission = Some(mission);
        Ok(())
    }

    /// Whatever came out as refused must have been recorded by now.
    fn miss_none(&mut self) {
        if let Some(problem) = self.expected.pop_front() {
            self.note_difference(problem.seq, "not refused", &problem.message);
        }
        self.expected.clear();
    }

    /// A refusal as recorded against the one that came out, by event and code: messages are for people, and
    /// later versions may put them in other words; the last refusals of a crash may not have been
    /// recorded.
    fn compare(&mut self, found: &Problem) {
        let expected = self.expected.pop_front();
        let what = |problem: &Problem| (problem.seq, problem.code.clone());
        if expected.as_ref().map(what) != Some(what(found)) {
            let now = expected.map_or("not refused".to_owned(), |problem| problem.message);
            self.note_difference(found.seq, &found.message, &now);
        }
    }

    /// Keeps the first difference.
    fn note_difference(&mut self, seq: Option<u64>, recorded: &str, now: &str) {
        let difference = || format!("event {seq:?}: recorded \"{recorded}\", with {SOFTWARE} \"{now}\"");
        self.differs.get_or_insert_with(difference);
    }
}
