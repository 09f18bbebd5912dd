//! The missions of one vehicle, owned by one thread.

use crate::error::{Absence, StateError};
use crate::event::Event;
use crate::history::{Record, SOFTWARE};
use crate::lifecycle::{self, Operation};
use crate::limits::Limits;
use crate::mission::Mission;
use crate::outcome::OfferOutcome;
use pdn_schemas::config::MissionConfig;
use pdn_schemas::record::Configured;
use std::collections::{BTreeMap, BTreeSet};

mod restore;

/// The missions of one vehicle: the current one, which is the last that was configured, and those that ended.
#[derive(Clone, Debug)]
pub struct Vehicle {
    limits: Limits,
    /// Id under which histories are kept; none if nobody keeps them.
    kept_as: Option<String>,
    missions: BTreeMap<String, Mission>,
    ended: Vec<String>,
    used_ids: BTreeSet<String>,
    next_ordinal: u64,
    current: Option<String>,
    /// Missions of earlier runs that are not here, and why.
    absent: BTreeMap<String, Absence>,
}

/// A configuration that has been checked, and that nothing depends on yet.
#[derive(Debug)]
pub struct PreparedMission {
    mission: Mission,
    replaces: bool,
}

/// What of a mission's history is to be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unwritten {
    /// Id of the mission.
    pub mission: String,
    /// In order.
    pub records: Vec<Record>,
    /// Once they are durable, so are all events below.
    pub next_seq: u64,
    /// Whether the mission has ended, and these are the last.
    pub last: bool,
}

impl Vehicle {
    /// A vehicle without missions, whose histories nobody keeps.
    pub fn new(limits: Limits) -> Vehicle {
        Vehicle {
            limits,
            kept_as: None,
            missions: BTreeMap::new(),
            ended: Vec::new(),
            used_ids: BTreeSet::new(),
            next_ordinal: 0,
            current: None,
            absent: BTreeMap::new(),
        }
    }

    /// A vehicle without missions, whose histories wait to be written: see [`Vehicle::take_unwritten`].
    pub fn kept(id: &str, limits: Limits) -> Vehicle {
        Vehicle { kept_as: Some(id.to_owned()), ..Vehicle::new(limits) }
    }

    /// Makes a new mission the current one. A mission that was configured but never started gives way: it is
    /// replaced if it has the same id and no event yet, else it is aborted.
    ///
    /// # Errors
    /// [`StateError::MissionActive`], [`StateError::MissionUsed`], [`StateError::Limit`], or what is wrong
    /// with the configuration, with the path of its field. Nothing has changed then.
    pub fn configure(&mut self, config: MissionConfig, now_ns: u64) -> Result<&mut Mission, StateError> {
        let prepared = self.prepare(config, now_ns)?;
        self.adopt(prepared, now_ns)
    }

    /// [`Vehicle::configure`] up to the point of no return.
    ///
    /// # Errors
    /// As [`Vehicle::configure`].
    pub fn prepare(&self, config: MissionConfig, now_ns: u64) -> Result<PreparedMission, StateError> {
        let id = config.mission.clone();
        let current = self.current.as_ref().and_then(|current| self.missions.get(current));
        if let Some(current) = current.filter(|current| lifecycle::is_active(current.phase())) {
            let mission = current.id().to_string();
            return Err(StateError::MissionActive { mission, phase: current.phase() });
        }
        if let Some(why) = self.absent.get(&id) {
            return Err(StateError::Absent { mission: id, why: why.clone() });
        }
        let replaced = current.filter(|current| current.id() == id && current.is_untouched());
        if self.used_ids.contains(&id) && replaced.is_none() {
            return Err(StateError::MissionUsed { mission: id });
        }
        if replaced.is_none() && self.used_ids.len() >= self.limits.max_mission_ids {
            return Err(StateError::Limit {
                what: "mission ids of the vehicle",
                bound: "max_mission_ids",
                limit: self.limits.max_mission_ids as u64,
                advice: "use another vehicle id",
            });
        }
        let configured = Configured {
            vehicle: self.kept_as.clone().unwrap_or_default(),
            ordinal: replaced.map_or(self.next_ordinal, Mission::ordinal),
            at_ns: now_ns,
            software: SOFTWARE.to_owned(),
            bounds: self.limits.bounds(),
            config,
        };
        let records = replaced.map_or(0, Mission::records);
        let mut mission = Mission::configured(configured.clone(), self.limits, records)?;
        mission.check_new()?;
        if self.kept_as.is_some() {
            mission.keep_history(configured)?;
        }
        Ok(PreparedMission { mission, replaces: replaced.is_some() })
    }

    /// The rest of [`Vehicle::configure`]; `prepared` is this vehicle's, and nothing has happened since.
    ///
    /// # Errors
    /// [`StateError::Internal`] if a history cannot be noted.
    pub fn adopt(&mut self, prepared: PreparedMission, now_ns: u64) -> Result<&mut Mission, StateError> {
        let PreparedMission { mission, replaces } = prepared;
        let id = mission.id().to_string();
        if !replaces {
            self.abandon(&id, now_ns)?;
        }
        self.used_ids.insert(id.clone());
        self.next_ordinal = self.next_ordinal.max(mission.ordinal() + 1);
        self.current = Some(id.clone());
        self.missions.insert(id, mission);
        self.forget();
        self.mission(None)
    }

    /// Takes an event of any of the vehicle's missions, of so many bytes as sent: applies it and those that
    /// waited for it, lets it wait, ignores it as a repeat or refuses it. See [`OfferOutcome`].
    pub fn offer(&mut self, event: Event, sent_bytes: usize) -> OfferOutcome {
        let buffered_bytes: usize = self.missions.values().map(Mission::buffered_bytes).sum();
        let left_bytes = self.limits.max_buffered_bytes.saturating_sub(buffered_bytes);
        match self.mission(Some(event.mission())) {
            Ok(mission) => mission.offer(event, sent_bytes, mission.buffered_bytes() + left_bytes),
            Err(error) => OfferOutcome::refused(event.mission(), event.seq(), 0, error),
        }
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
    /// [`StateError::NoMission`], [`StateError::UnknownMission`] with the ids that are kept,
    /// [`StateError::Absent`] for one whose journal is not read yet or cannot be read.
    pub fn mission(&mut self, id: Option<&str>) -> Result<&mut Mission, StateError> {
        let id = id.or(self.current.as_deref()).ok_or(StateError::NoMission)?;
        if let Some(why) = self.absent.get(id) {
            return Err(StateError::Absent { mission: id.to_string(), why: why.clone() });
        }
        if !self.missions.contains_key(id) {
            let kept = self.missions.keys().cloned().collect();
            return Err(StateError::UnknownMission { mission: id.to_string(), kept });
        }
        self.missions.get_mut(id).ok_or(StateError::NoMission)
    }

    /// Ids of the missions that are kept, in their order.
    pub fn mission_ids(&self) -> impl Iterator<Item = &str> {
        self.missions.keys().map(String::as_str)
    }

    /// What of the histories is to be written; from now on it is the caller's.
    pub fn take_unwritten(&mut self) -> Vec<Unwritten> {
        let unwritten = self.missions.values_mut().map(|mission| Unwritten {
            mission: mission.id().to_string(),
            records: mission.take_unwritten(),
            next_seq: mission.next_seq(),
            last: lifecycle::has_ended(mission.phase()),
        });
        unwritten.filter(|unwritten| !unwritten.records.is_empty()).collect()
    }

    fn abandon(&mut self, successor: &str, now_ns: u64) -> Result<(), StateError> {
        let current = self.current.as_ref().and_then(|current| self.missions.get_mut(current));
        let Some(mission) = current.filter(|mission| !lifecycle::has_ended(mission.phase())) else {
            return Ok(());
        };
        let reason = format!("gave way to mission \"{successor}\" before it was started");
        mission.command(Operation::Abort, &reason, now_ns)?;
        self.ended.push(mission.id().to_string());
        Ok(())
    }

    fn forget(&mut self) {
        while self.missions.len() > self.limits.max_missions.max(1) && !self.ended.is_empty() {
            self.missions.remove(&self.ended.remove(0));
        }
    }
}

impl PreparedMission {
    /// The records with which a new journal begins; empty if the mission goes on in the journal of the one
    /// that it replaces, or nobody keeps it.
    pub fn take_first_records(&mut self) -> Vec<Record> {
        if self.replaces { Vec::new() } else { self.mission.take_unwritten() }
    }

    /// Id of the mission.
    pub fn mission(&self) -> &str {
        self.mission.id()
    }

    /// Its number among the missions of the vehicle.
    pub fn ordinal(&self) -> u64 {
        self.mission.ordinal()
    }
}
