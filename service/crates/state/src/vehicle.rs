//! The missions of one vehicle, owned by one task.

use crate::convert;
use crate::error::StateError;
use crate::event::{Event, Undecodable};
use crate::lifecycle::{self, Operation};
use crate::limits::Limits;
use crate::mission::Mission;
use crate::offered::Offered;
use pdn_schemas::config::MissionConfig;
use pdn_schemas::problem::Code;
use std::collections::{BTreeMap, BTreeSet};

/// The missions of one vehicle: the current one, which is the last that was configured, and those that ended.
#[derive(Clone, Debug)]
pub struct Vehicle {
    limits: Limits,
    missions: BTreeMap<String, Mission>,
    ended: Vec<String>,
    used_ids: BTreeSet<String>,
    current: Option<String>,
}

impl Vehicle {
    /// A vehicle without missions.
    pub fn new(limits: Limits) -> Vehicle {
        Vehicle {
            limits,
            missions: BTreeMap::new(),
            ended: Vec::new(),
            used_ids: BTreeSet::new(),
            current: None,
        }
    }

    /// Makes a new mission the current one. A mission that was configured but never started gives way: it is
    /// replaced if it has the same id and no event yet, else it is aborted.
    ///
    /// # Errors
    /// [`StateError::MissionActive`], [`StateError::MissionUsed`], [`StateError::Limit`], or what is wrong with the
    /// configuration, with the path of its field. Nothing has changed then.
    pub fn configure(&mut self, config: MissionConfig, now_ns: u64) -> Result<&mut Mission, StateError> {
        let mission = config.mission.clone();
        let mut replaces = false;
        if let Some(current) = self.current.as_ref().and_then(|current| self.missions.get(current)) {
            if lifecycle::is_active(current.phase()) {
                let mission = current.id().to_string();
                return Err(StateError::MissionActive { mission, phase: current.phase() });
            }
            replaces = current.id() == mission && current.is_untouched();
        }
        if self.used_ids.contains(&mission) && !replaces {
            return Err(StateError::MissionUsed { mission });
        }
        if !replaces && self.used_ids.len() >= self.limits.max_mission_ids {
            return Err(StateError::Limit {
                what: "mission ids of the vehicle",
                bound: "max_mission_ids",
                limit: self.limits.max_mission_ids as u64,
                advice: "use another vehicle id",
            });
        }
        let settings = convert::config::settings(&config, &self.limits)?;
        if !replaces {
            self.abandon(&mission, now_ns);
        }
        self.used_ids.insert(mission.clone());
        self.current = Some(mission.clone());
        self.missions.insert(mission.clone(), Mission::new(config, settings, self.limits, now_ns));
        self.forget();
        self.mission(None)
    }

    /// Takes an event of any of the vehicle's missions: applies it and those that waited for it, lets it wait,
    /// ignores it as a repeat or refuses it. See [`Offered`].
    pub fn offer(&mut self, event: Event) -> Offered {
        let (id, seq) = (event.mission().to_string(), event.seq());
        match self.mission(Some(&id)) {
            Ok(mission) => mission.offer(event),
            Err(error) => Offered::refused(&id, seq, 0, error),
        }
    }

    /// Takes the place of an event whose body could not be decoded but whose head could: its number is consumed
    /// in its turn, and it is refused with `code` and `message`.
    pub fn refuse_undecodable(&mut self, mission: &str, seq: u64, code: Code, message: String) -> Offered {
        self.offer(Event::Undecodable(Undecodable { mission: mission.to_string(), seq, code, message }))
    }

    /// Changes the phase of the mission of that id, or of the current one. An empty `reason` is filled in.
    ///
    /// # Errors
    /// [`StateError::NoMission`], [`StateError::UnknownMission`], [`StateError::IllegalTransition`],
    /// [`StateError::TooLong`] for the reason.
    pub fn command(
        &mut self,
        id: Option<&str>,
        operation: Operation,
        reason: &str,
        now_ns: u64,
    ) -> Result<&mut Mission, StateError> {
        let mission = self.mission(id)?;
        mission.command(operation, reason, now_ns)?;
        let (id, phase) = (mission.id().to_string(), mission.phase());
        if lifecycle::has_ended(phase) {
            self.ended.push(id.clone());
        }
        self.mission(Some(&id))
    }

    /// The mission of that id, or the current one.
    ///
    /// # Errors
    /// [`StateError::NoMission`], [`StateError::UnknownMission`] with the ids that are kept.
    pub fn mission(&mut self, id: Option<&str>) -> Result<&mut Mission, StateError> {
        let id = id.or(self.current.as_deref()).ok_or(StateError::NoMission)?.to_string();
        let kept: Vec<String> = self.missions.keys().cloned().collect();
        self.missions.get_mut(&id).ok_or(StateError::UnknownMission { mission: id, kept })
    }

    /// Ids of the missions that are kept, in their order.
    pub fn mission_ids(&self) -> impl Iterator<Item = &str> {
        self.missions.keys().map(String::as_str)
    }

    fn abandon(&mut self, successor: &str, now_ns: u64) {
        let current = self.current.as_ref().and_then(|current| self.missions.get_mut(current));
        let Some(mission) = current.filter(|mission| !lifecycle::has_ended(mission.phase())) else { return };
        let reason = format!("gave way to mission \"{successor}\" before it was started");
        if mission.command(Operation::Abort, &reason, now_ns).is_ok() {
            self.ended.push(mission.id().to_string());
        }
    }

    fn forget(&mut self) {
        while self.missions.len() > self.limits.max_missions.max(1) && !self.ended.is_empty() {
            self.missions.remove(&self.ended.remove(0));
        }
    }
}
