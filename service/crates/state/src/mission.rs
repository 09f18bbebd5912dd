//! One mission: its phase, the order of its events, and the fold of what they say.

use crate::checkpoint::Checkpoint;
use crate::convert;
use crate::error::StateError;
use crate::event::{EncodedEvent, Event};
use crate::findings::RecentEvents;
use crate::fold::{FastForward, Fold};
use crate::history::Record;
use crate::ingest::{Arrival, Ingest, Room};
use crate::lifecycle;
use crate::limits::Limits;
use crate::outcome::{OfferOutcome, Refusal};
use crate::record_log::RecordLog;
use pdn_schemas::config::MissionConfig;
use pdn_schemas::record::Configured;
use pdn_schemas::reply::Phase;
use std::collections::BTreeMap;

mod history;
mod questions;

/// One mission of a vehicle.
#[derive(Clone, Debug)]
pub struct Mission {
    config: MissionConfig,
    limits: Limits,
    ordinal: u64,
    phase: Phase,
    reason: String,
    since_ns: u64,
    ingest: Ingest,
    fold: Fold,
    rejected: u64,
    decisions: u64,
    revisits: u64,
    log: RecordLog,
    /// Where the present group begins.
    group: Option<GroupStart>,
    /// What has been read on the way to a checkpoint.
    forward: Option<Box<FastForward>>,
    /// What health looks at.
    recent: RecentEvents,
    /// What is wrong around the mission, by what it concerns.
    concerns: BTreeMap<&'static str, String>,
}

/// The first event of a group.
#[derive(Clone, Copy, Debug)]
struct GroupStart {
    seq: u64,
    /// Number of its record.
    record: u64,
    /// Events refused up to and with it.
    rejected: u64,
}

impl Mission {
    /// A mission that begins with this record, in the bounds that it names, and before which its journal has
    /// so many others.
    ///
    /// # Errors
    /// The first field of the configuration that has no meaning.
    pub(crate) fn configured(
        configured: Configured,
        limits: Limits,
        records: u64,
    ) -> Result<Mission, StateError> {
        let limits = limits.within(&configured.bounds);
        let settings = convert::config::settings(&configured.config, &limits)?;
        Ok(Mission {
            config: configured.config,
            limits,
            ordinal: configured.ordinal,
            phase: Phase::Configured,
            reason: "configured".to_string(),
            since_ns: configured.at_ns,
            ingest: Ingest::default(),
            fold: Fold::new(settings, limits),
            rejected: 0,
            decisions: 0,
            revisits: 0,
            log: RecordLog::after(records + 1),
            group: None,
            forward: None,
            recent: RecentEvents::default(),
            concerns: BTreeMap::new(),
        })
    }

    /// Whether a mission may begin with this configuration.
    ///
    /// # Errors
    /// What does not fit.
    pub(crate) fn check_new(&self) -> Result<(), StateError> {
        convert::config::check_new(self.fold.settings())
    }

    /// Its id.
    pub fn id(&self) -> &str {
        &self.config.mission
    }

    /// Its phase.
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// Its number among the missions of the vehicle.
    pub fn ordinal(&self) -> u64 {
        self.ordinal
    }

    /// All events below are consumed; what `after=` waits for.
    pub fn next_seq(&self) -> u64 {
        self.ingest.next_seq()
    }

    /// Whether no event has come yet.
    pub fn is_untouched(&self) -> bool {
        self.phase == Phase::Configured && self.ingest.next_seq() == 0 && self.ingest.buffered() == 0
    }

    /// Tells in the mission's health what is wrong around it, or no longer is.
    pub fn set_concern(&mut self, about: &'static str, finding: Option<String>) {
        match finding {
            Some(finding) => self.concerns.insert(about, finding),
            None => self.concerns.remove(about),
        };
    }

    /// Bytes, as sent, of the events that wait for a missing one.
    pub(crate) fn buffered_bytes(&self) -> usize {
        self.ingest.buffered_bytes()
    }

    /// Takes an event of so many bytes as sent, of which `buffered_bytes` are left for all that wait.
    pub(crate) fn offer(&mut self, event: Event, sent_bytes: usize, buffered_bytes: usize) -> OfferOutcome {
        let seq = event.seq();
        let encoded = encode(event);
        let is_repeat = || encoded.as_ref().is_ok_and(|event| self.ingest.is_repeat(event));
        if lifecycle::has_ended(self.phase) && !is_repeat() {
            let error = StateError::MissionEnded { mission: self.id().to_string(), phase: self.phase };
            return OfferOutcome::refused(self.id(), seq, self.next_seq(), error);
        }
        let mut outcome = OfferOutcome::of(self.id(), self.next_seq());
        let room = Room { buffered_bytes, ..self.room() };
        match encoded.and_then(|event| self.ingest.take(event, sent_bytes, room)) {
            Ok(Arrival::Due(due)) => due.into_iter().for_each(|event| self.apply(event, &mut outcome)),
            Ok(Arrival::Buffered) => {}
            Ok(Arrival::Repeat) => outcome.repeat = true,
            Err(error) => {
                let refusal = Refusal { seq, error };
                self.note_turned_away(&refusal);
                outcome.refused.push(refusal);
            }
        }
        outcome.next_seq = self.next_seq();
        outcome
    }

    fn room(&self) -> Room {
        Room {
            events: self.limits.max_events,
            buffered: self.limits.max_buffered_events,
            buffered_bytes: self.limits.max_buffered_bytes,
        }
    }

    /// What is to be kept so that the history need not be solved for again up to the last group; none if
    /// there is no such moment. Cost: a copy of the state.
    pub fn checkpoint(&self) -> Option<Checkpoint> {
        let GroupStart { seq, record, rejected } = self.group?;
        let solved = (self.fold.group_seq() == Some(seq)).then(|| self.fold.solved_state()).flatten()?;
        Some(Checkpoint { record, rejected, solved })
    }

    fn apply(&mut self, event: EncodedEvent, outcome: &mut OfferOutcome) {
        let EncodedEvent { event, bytes, .. } = event;
        let (seq, record) = (event.seq(), self.records());
        self.log.push_record(Record { kind: event.kind(), payload: bytes });
        let refused = self.consume(event, record);
        self.note_refused(&refused);
        outcome.applied += u64::from(refused.iter().all(|refusal| refusal.seq != seq));
        outcome.refused.extend(refused);
    }

    /// Folds an event whose turn it is and whose record has this number.
    fn consume(&mut self, event: Event, record: u64) -> Vec<Refusal> {
        let seq = event.seq();
        self.recent.push(&event);
        if let Some(forward) = &mut self.forward {
            if let Ok(change) = convert::event::change(event) {
                self.fold.fast_forward(forward, seq, change);
            }
            return Vec::new(); // the history tells what was refused
        }
        let refused = match convert::event::change(event) {
            Ok(change) => self.fold.apply(seq, change),
            Err(error) => vec![Refusal { seq, error }],
        };
        self.rejected += refused.len() as u64;
        for refusal in &refused {
            self.recent.refuse(refusal.seq, refusal.error.code());
        }
        if self.fold.group_seq() == Some(seq) {
            self.group = Some(GroupStart { seq, record, rejected: self.rejected });
        }
        refused
    }
}

fn encode(event: Event) -> Result<EncodedEvent, StateError> {
    let describe = |error| StateError::Internal { evidence: format!("encoding an event: {error}") };
    EncodedEvent::new(event).map_err(describe)
}
