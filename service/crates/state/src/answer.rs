//! Questions that take long: jobs that own an immutable view of the mission and run on any thread, any number at
//! once, while events go on.
//!
//! ```text
//! owner:  job = mission.begin_decision(request)?      pool: outcome = job.run(pool, stop)?
//! owner:  decision = mission.record(outcome)
//! ```

use crate::convert::{self, reply::Source};
use crate::error::StateError;
use pdn_schemas::reply::{Action, Decision, EvaluateReply, GraphReply, LinkModelReply, WaypointsReply};
use rayon::ThreadPool;

/// What a decision, or the evaluation of paths, is asked with.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DecisionRequest {
    /// What to assume instead of the mission's settings; the default asks for the mission's own decision.
    pub what_if: WhatIf,
    /// Whether poses, links and the table of P_L come with it (`detail=full`).
    pub full: bool,
    /// Whether only the best candidate is told, and none where exploring is certain (`detail=choice`).
    pub choice_only: bool,
}

/// Assumptions of a question that changes nothing and is not counted: the weight and standard deviations of the
/// allowance. What is not set stays as the mission has it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WhatIf {
    /// Weight of the uncertainty, in [0, 1].
    pub alpha: Option<f64>,
    /// North and east, m.
    pub sigma_xy_m: Option<f64>,
    /// Down, m.
    pub sigma_depth_m: Option<f64>,
    /// Roll and pitch, deg.
    pub sigma_tilt_deg: Option<f64>,
    /// Heading, deg.
    pub sigma_heading_deg: Option<f64>,
}

impl WhatIf {
    /// Whether anything is assumed.
    pub fn is_any(&self) -> bool {
        *self != WhatIf::default()
    }
}

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
    /// The decision will rest on all events below.
    pub fn graph_seq(&self) -> u64 {
        self.source.graph_seq
    }

    /// Decides. Once `stop` says so no further candidate is begun, and the choice is the best of those that were
    /// evaluated. The result has the same bits at any number of threads, unless it was stopped.
    ///
    /// # Errors
    /// [`StateError::Singular`] or [`StateError::Internal`] if a covariance cannot be computed.
    pub fn run(
        &self,
        pool: &ThreadPool,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<DecisionOutcome, StateError> {
        let decision = convert::reply::decide(&self.source, &self.request, pool, stop)?;
        let link_model = convert::reply::link_model_of(&self.source);
        Ok(DecisionOutcome { decision, request: self.request, basis: self.basis, link_model })
    }
}

impl DecisionOutcome {
    /// The decision, still without a number.
    pub fn decision(&self) -> &Decision {
        &self.decision
    }

    /// Whether the choice is a revisit.
    pub fn is_revisit(&self) -> bool {
        matches!(self.decision.action, Action::Revisit { .. })
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
    /// [`StateError::Stopped`] if `stop` said so before all were evaluated; [`StateError::Invalid`] and its like for a
    /// path that is none; else as [`DecisionJob::run`].
    pub fn run(
        &self,
        pool: &ThreadPool,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<EvaluateReply, StateError> {
        convert::reply::evaluate(&self.source, &self.request, &self.paths, pool, stop)
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
    /// [`StateError::Singular`] or [`StateError::Internal`] if a marginal cannot be computed.
    pub fn run(&self) -> Result<GraphReply, StateError> {
        convert::reply::graph(&self.source, self.from, self.marginals)
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
    /// [`StateError::Singular`] or [`StateError::Internal`] if a marginal cannot be computed.
    pub fn run(&self) -> Result<WaypointsReply, StateError> {
        convert::reply::waypoints(&self.source)
    }
}
