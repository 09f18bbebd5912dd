//! One mission: its phase, the order of its events, and the fold of what they say.

use crate::answer::{DecisionJob, EvaluateJob, GraphJob, WaypointsJob};
use crate::checkpoint::Checkpoint;
use crate::convert;
use crate::error::StateError;
use crate::event::{EncodedEvent, Event};
use crate::fold::{FastForward, Fold};
use crate::history::Record;
use crate::ingest::{Arrival, Ingest, Room};
use crate::lifecycle;
use crate::limits::Limits;
use crate::outcome::{OfferOutcome, Refusal};
use crate::record_log::RecordLog;
use crate::request::{DecisionRequest, Source};
use pdn_schemas::config::MissionConfig;
use pdn_schemas::limits::MAX_MISSING_RANGES;
use pdn_schemas::problem::Code;
use pdn_schemas::record::Configured;
use pdn_schemas::reply::{Ack, CoverageReply, Health, IngestStatus, LinkModelReply, MissionState, Phase};
use std::collections::{BTreeMap, BTreeSet};

mod history;

/// The mission's health tells of contradictions once there are so many among so many last events: single
/// outliers are what they are, but after a false step every true measurement is one.
const LATE_EVENTS: u64 = 256;
const MANY_CONTRADICTIONS: usize = 16;

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
    /// Numbers of late events that contradict the graph.
    contradictions: BTreeSet<u64>,
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
            contradictions: BTreeSet::new(),
            concerns: BTreeMap::new(),
        })
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
            self.note_contradiction(refusal.seq, refusal.error.code());
        }
        if self.fold.group_seq() == Some(seq) {
            self.group = Some(GroupStart { seq, record, rejected: self.rejected });
        }
        refused
    }

    fn note_contradiction(&mut self, seq: u64, code: Code) {
        if code == Code::Contradiction {
            self.contradictions.insert(seq);
            self.contradictions = self.contradictions.split_off(&self.next_seq().saturating_sub(LATE_EVENTS));
        }
    }

    /// Whether so much contradicts the graph that the graph may be wrong.
    fn contradicted(&self) -> Option<String> {
        let late = self.next_seq().saturating_sub(LATE_EVENTS);
        let count = self.contradictions.range(late..).count();
        (count >= MANY_CONTRADICTIONS).then(|| {
            format!(
                "{count} of the last {LATE_EVENTS} events contradict the graph and were left out: a step or \
                 prior before them may be false; if so, tie the next keyframe by a prior, or complete this \
                 mission and configure another"
            )
        })
    }

    /// Prepares a decision: the mission's own, or a what-if.
    ///
    /// # Errors
    /// [`StateError::NotRunning`] unless it is a what-if; [`StateError::NotReady`] without a keyframe in the
    /// graph; [`StateError::OutOfRange`] and its like for an assumption that has no meaning.
    pub fn begin_decision(&mut self, request: DecisionRequest) -> Result<DecisionJob, StateError> {
        if !request.what_if.is_any() && self.phase != Phase::Running {
            return Err(StateError::NotRunning { phase: self.phase });
        }
        convert::question::check_what_if(&request.what_if)?;
        Ok(DecisionJob { source: self.source()?, request, basis: self.records() })
    }

    /// Prepares the evaluation of paths that a person drew: world points, m, from the robot's position on.
    ///
    /// # Errors
    /// [`StateError::NotReady`], [`StateError::TooLong`], [`StateError::NotFinite`],
    /// [`StateError::OutOfRange`].
    pub fn begin_evaluate(
        &mut self,
        paths: Vec<Vec<[f64; 3]>>,
        request: DecisionRequest,
    ) -> Result<EvaluateJob, StateError> {
        convert::question::check_what_if(&request.what_if)?;
        convert::question::check_paths(&paths, &self.limits)?;
        Ok(EvaluateJob { source: self.source()?, request, paths })
    }

    /// Prepares `rpc/graph`: keyframes from id `from` on, with their marginals if asked. An empty graph is an
    /// answer.
    pub fn begin_graph(&mut self, from: Option<u64>, marginals: bool) -> GraphJob {
        GraphJob { source: self.any_source(), from: from.unwrap_or(0), marginals }
    }

    /// Prepares `rpc/waypoints`.
    ///
    /// # Errors
    /// [`StateError::NotReady`] without a keyframe in the graph.
    pub fn begin_waypoints(&mut self) -> Result<WaypointsJob, StateError> {
        Ok(WaypointsJob { source: self.source()? })
    }

    /// `rpc/coverage`. Cost: linear in the cells of the rasters.
    pub fn coverage(&mut self) -> CoverageReply {
        let (mission, graph_seq, target_m2) = (self.id().to_string(), self.next_seq(), self.fold.target_m2());
        convert::reply::coverage(mission, graph_seq, target_m2, self.fold.coverage())
    }

    /// `rpc/link_model`.
    pub fn link_model(&self) -> LinkModelReply {
        convert::reply::link_model(self.id().to_string(), self.next_seq(), self.fold.link_model())
    }

    /// `rpc/ingest`; `rejected` counts the events whose number was consumed but whose content was not.
    /// Without a journal nothing survives the process: `durable_seq` is `next_seq`, which then means applied
    /// and no more.
    pub fn ingest_status(&self) -> IngestStatus {
        IngestStatus {
            mission: self.id().to_string(),
            next_seq: self.next_seq(),
            durable_seq: self.log.durable_seq(self.next_seq()),
            buffered: self.ingest.buffered() as u64,
            missing: self.ingest.missing(MAX_MISSING_RANGES),
            rejected: self.rejected,
        }
    }

    /// `out/ack`; `durable_seq` as in [`Mission::ingest_status`].
    pub fn ack(&self) -> Ack {
        Ack {
            mission: self.id().to_string(),
            next_seq: self.next_seq(),
            durable_seq: self.log.durable_seq(self.next_seq()),
        }
    }

    /// `rpc/mission`, `out/state`. Cost beyond solving for the events not yet solved for: one marginal.
    pub fn state(&mut self) -> MissionState {
        let mut findings: Vec<String> = self.concerns.values().cloned().collect();
        findings.extend(self.fold.findings());
        findings.extend(self.contradicted());
        let robot = self.fold.robot().unwrap_or_else(|error| {
            findings.push(error.to_string());
            None
        });
        if let Some((first, last)) = self.ingest.missing(1).first() {
            let waiting = self.ingest.buffered();
            findings.push(format!(
                "events {first} to {last} are missing, {waiting} later ones wait: send them again"
            ));
        }
        MissionState {
            mission: self.id().to_string(),
            phase: self.phase,
            robot: robot
                .as_ref()
                .map(|robot| convert::reply::robot(robot.keyframe, &robot.pose, &robot.covariance)),
            reason: self.reason.clone(),
            since_ns: self.since_ns,
            config: self.config.clone(),
            next_seq: self.next_seq(),
            keyframes: self.fold.keyframes_in_graph() as u64,
            factors: self.fold.factors_in_graph(),
            covered_m2: self.fold.coverage().covered_m2(),
            target_m2: self.fold.target_m2(),
            uncertainty: robot.map(|robot| robot.uncertainty),
            decisions: self.decisions,
            revisits: self.revisits,
            estimated_remaining_m: self.fold.survey_remaining_m(),
            health: Health { ok: findings.is_empty(), findings },
        }
    }

    fn source(&mut self) -> Result<Source, StateError> {
        if self.fold.keyframes_in_graph() == 0 {
            return Err(StateError::NotReady);
        }
        Ok(self.any_source())
    }

    fn any_source(&mut self) -> Source {
        Source {
            mission: self.id().to_string(),
            graph_seq: self.next_seq(),
            phase: self.phase,
            allowable: self.config.allowable,
            view: self.fold.view(),
        }
    }
}

fn encode(event: Event) -> Result<EncodedEvent, StateError> {
    let describe = |error| StateError::Internal { evidence: format!("encoding an event: {error}") };
    EncodedEvent::new(event).map_err(describe)
}
