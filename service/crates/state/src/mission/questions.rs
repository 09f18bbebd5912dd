//! What is asked of a mission: answered at once, or prepared as a job.

use super::Mission;
use crate::answer::{DecisionJob, EvaluateJob, GraphJob, WaypointsJob};
use crate::convert;
use crate::error::StateError;
use crate::findings;
use crate::request::{DecisionRequest, Source};
use pdn_schemas::limits::MAX_MISSING_RANGES;
use pdn_schemas::reply::{Ack, CoverageReply, Health, IngestStatus, LinkModelReply, MissionState, Phase};

impl Mission {
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
        findings.extend(self.misfits());
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

    /// What of the events does not fit together.
    fn misfits(&mut self) -> Vec<String> {
        let (fold, recent) = (&mut self.fold, &self.recent);
        let mut misfits = fold.misfits();
        misfits.extend(findings::attitudes(recent, |keyframe| fold.estimate(keyframe)));
        misfits.extend(findings::contradicted(recent));
        misfits.extend(findings::all_refused(recent));
        misfits.extend(findings::stamps(recent));
        misfits
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
