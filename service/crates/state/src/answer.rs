//! Questions that take long: jobs that own an immutable view of the mission and run on any thread, any number
//! at once, while events go on.
//!
//! ```text
//! owner:  job = mission.begin_decision(request)?      pool: outcome = job.run(pool, stop)?
//! owner:  decision = mission.record(outcome)
//! ```

use crate::convert::{question, reply};
use crate::error::StateError;
use crate::request::{DecisionRequest, Source};
use pdn_schemas::reply::{Decision, EvaluateReply, GraphReply, LinkModelReply, WaypointsReply};
use rayon::ThreadPool;

/// A decision to be made.
#[derive(Clone, Debug)]
pub struct DecisionJob {
    pub(crate) source: Source,
    pub(crate) request: DecisionRequest,
    /// Records of the mission's history when it was asked.
    pub(crate) basis: u64,
}

/// A decision that was made, not yet numbered and counted.
#[derive(Clone, Debug, PartialEq)]
pub struct DecisionOutcome {
    pub(crate) decision: Decision,
    pub(crate) request: DecisionRequest,
    pub(crate) basis: u64,
    /// The table that it rests on.
    pub(crate) link_model: LinkModelReply,
}

impl DecisionJob {
    /// Decides. Once `stop` says so no further candidate is begun, and the choice is the best of those that
    /// were evaluated. The result has the same bits at any number of threads, unless it was stopped.
    ///
    /// # Errors
    /// [`StateError::SingularAnswer`] or [`StateError::Internal`] if a covariance cannot be computed.
    pub fn run(
        &self,
        pool: &ThreadPool,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<DecisionOutcome, StateError> {
        let DecisionJob { source, request, basis } = self;
        let decided = source.view.decide(&question::question(request, source.view.settings()), pool, stop)?;
        let link_model =
            reply::link_model(source.mission.clone(), source.graph_seq, source.view.link_model());
        let table = request.full.then(|| link_model.clone());
        let decision = reply::decision(source, request, decided, table);
        Ok(DecisionOutcome { decision, request: *request, basis: *basis, link_model })
    }
}

impl DecisionOutcome {
    /// The decision, still without a number.
    pub fn decision(&self) -> &Decision {
        &self.decision
    }
}

/// Paths that a person drew, to be evaluated like candidates.
#[derive(Clone, Debug)]
pub struct EvaluateJob {
    pub(crate) source: Source,
    pub(crate) request: DecisionRequest,
    pub(crate) paths: Vec<Vec<[f64; 3]>>,
}

impl EvaluateJob {
    /// Evaluates each path.
    ///
    /// # Errors
    /// [`StateError::Stopped`] if `stop` said so before all were evaluated; [`StateError::Invalid`] and its
    /// like for a path that is none; else as [`DecisionJob::run`].
    pub fn run(
        &self,
        pool: &ThreadPool,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<EvaluateReply, StateError> {
        let EvaluateJob { source, request, paths } = self;
        let assumed = question::question(request, source.view.settings());
        let evaluated = source.view.evaluate(&assumed, &question::paths(paths), pool, stop)?;
        if !evaluated.not_evaluated.is_empty() {
            return Err(StateError::Stopped);
        }
        Ok(reply::evaluation(source, request, &evaluated))
    }
}

/// The pose graph to be told.
#[derive(Clone, Debug)]
pub struct GraphJob {
    pub(crate) source: Source,
    pub(crate) from: u64,
    pub(crate) marginals: bool,
}

impl GraphJob {
    /// Tells it; with marginals at the cost of one recursion over the whole elimination tree.
    ///
    /// # Errors
    /// [`StateError::SingularAnswer`] or [`StateError::Internal`] if a marginal cannot be computed.
    pub fn run(&self) -> Result<GraphReply, StateError> {
        Ok(reply::graph(&self.source, self.source.view.graph(self.from, self.marginals)?))
    }
}

/// The clusters of salient keyframes to be told.
#[derive(Clone, Debug)]
pub struct WaypointsJob {
    pub(crate) source: Source,
}

impl WaypointsJob {
    /// Tells them.
    ///
    /// # Errors
    /// [`StateError::SingularAnswer`] or [`StateError::Internal`] if a marginal cannot be computed.
    pub fn run(&self) -> Result<WaypointsReply, StateError> {
        Ok(reply::waypoints(&self.source, self.source.view.waypoints()?))
    }
}
