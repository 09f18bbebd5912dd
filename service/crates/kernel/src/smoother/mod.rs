//! The incremental maximum-a-posteriori estimate over all factors.
//!
//! Every keyframe has a linearisation point theta and a step delta; the estimate is theta * Exp(delta). The
//! information matrix J^T W J is always that at the linearisation points. New factors are linearised there
//! and eliminated; where the step exceeds a tolerance the linearisation point follows the estimate, and all
//! of the keyframe's factors are linearised anew: Gauss-Newton on the part of the graph that moves \[Kaess
//! 2012\]. Robust losses are weighed at the linearisation point, which makes it iteratively re-weighted least
//! squares.

mod blocks;
mod factor_list;
mod state;
mod step;

use nalgebra::Matrix6;
use std::sync::Arc;

use crate::elimination::{Elimination, Solution};
use crate::factors::Factor;
use crate::se3::{self, Pose};
use crate::{KernelError, Node};
use factor_list::FactorList;
pub use state::SmootherState;

/// Steps are carried down the tree until they change by less than this share of `relinearize_above`. It
/// leaves room for the lever arms by which a small turn of one keyframe shifts another.
const PRUNE_SHARE: f64 = 1e-2;

/// Where the whole graph is linearised anew, steps are carried down until they change by no more than this, m
/// and rad, whatever the tolerance.
const RELINEARIZE_PRUNE: f64 = 1e-7;

/// When a smoother re-linearises and when it stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmootherSettings {
    /// A keyframe is linearised anew once an entry of its step exceeds this, in m and rad.
    ///
    /// Default 5e-3: half a centimetre and 0.3 degrees. What the linearisation neglects is of second order in
    /// the step, here 2.5e-5. The noise of each keyframe moves much of the graph by a little, so a tolerance
    /// near that movement linearises much of the graph anew for every keyframe.
    pub relinearize_above: f64,
    /// Gauss-Newton steps of one `advance` at most.
    pub max_iterations: usize,
}

impl Default for SmootherSettings {
    fn default() -> Self {
        SmootherSettings { relinearize_above: 5e-3, max_iterations: 10 }
    }
}

/// What one `advance` did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AdvanceReport {
    /// Gauss-Newton steps taken.
    pub iterations: usize,
    /// Whether every step is within `relinearize_above` of its linearisation point. If not, the next
    /// `advance` goes on.
    pub converged: bool,
    /// Keyframe linearisations that were made anew.
    pub relinearized: usize,
    /// Fronts eliminated.
    pub eliminated_fronts: usize,
    /// Keyframes in these fronts.
    pub eliminated_nodes: usize,
    /// Times a step was halved because the cost grew.
    pub halvings: usize,
}

/// Incremental smoother; cloning is cheap, and a copy goes its own way. What is flat is shared as a whole
/// until one of the copies changes it, the rest by parts.
#[derive(Clone, Debug)]
pub struct Smoother {
    settings: SmootherSettings,
    factors: FactorList,
    /// Factors up to this one are in the elimination.
    linearized_factors: usize,
    linearizations: Arc<Vec<Pose>>,
    steps: Arc<Solution>,
    elimination: Elimination,
    /// Keyframes whose step is beyond the tolerance, ascending.
    to_relinearize: Vec<u32>,
    /// Keyframes linearised anew since the last `take_moved`.
    moved: Vec<Node>,
}

impl Smoother {
    /// An empty smoother.
    pub fn new(settings: SmootherSettings) -> Smoother {
        Smoother {
            settings,
            factors: FactorList::default(),
            linearized_factors: 0,
            linearizations: Arc::default(),
            steps: Arc::default(),
            elimination: Elimination::default(),
            to_relinearize: Vec::new(),
            moved: Vec::new(),
        }
    }

    /// Adds a keyframe with its first estimate; factors must tie it before the next `advance`.
    pub fn add_keyframe(&mut self, world_from_body: Pose) -> Node {
        Arc::make_mut(&mut self.linearizations).push(world_from_body);
        Arc::make_mut(&mut self.steps).add_node();
        self.factors.add_node();
        self.elimination.system_mut().add_node()
    }

    /// Adds a factor, which the next `advance` takes in. Errors: [`KernelError::UnknownNode`].
    pub fn add_factor(&mut self, factor: Factor) -> Result<(), KernelError> {
        let (first, second) = factor.nodes();
        for node in std::iter::once(first).chain(second) {
            if node.index() >= self.len() {
                return Err(KernelError::UnknownNode { node, nodes: self.len() });
            }
        }
        self.factors.push(factor);
        Ok(())
    }

    /// Takes in what was added and steps until the estimate is at the optimum, or `max_iterations` is
    /// reached.
    ///
    /// Cost: the fronts that new factors and moving keyframes touch, and those above them. A step that is
    /// large and makes the cost grow is halved until it does not. Errors:
    /// [`KernelError::NotPositiveDefinite`] where the factors leave a keyframe free, and those of
    /// [`Factor::linearize`]. After an error only a copy made before can be used.
    pub fn advance(&mut self) -> Result<AdvanceReport, KernelError> {
        let relinearize_above = self.settings.relinearize_above;
        self.advance_to(relinearize_above, PRUNE_SHARE * relinearize_above)
    }

    /// As [`Smoother::advance`], for once with this tolerance instead of `relinearize_above`: every keyframe
    /// whose step exceeds it is linearised anew. Bounded by `max_iterations` as well; robust losses converge
    /// linearly, so a small tolerance may take several calls.
    pub fn relinearize(&mut self, relinearize_above: f64) -> Result<AdvanceReport, KernelError> {
        self.elimination.back_substitute(Arc::make_mut(&mut self.steps), RELINEARIZE_PRUNE);
        let beyond = |&node: &u32| self.steps.value(node).amax() > relinearize_above;
        self.to_relinearize = (0..self.len() as u32).filter(beyond).collect();
        self.advance_to(relinearize_above, RELINEARIZE_PRUNE.min(PRUNE_SHARE * relinearize_above))
    }

    fn advance_to(&mut self, relinearize_above: f64, prune: f64) -> Result<AdvanceReport, KernelError> {
        let mut report = AdvanceReport::default();
        let (mut touched, mut new_pairs) = self.linearize_new_factors()?;
        let mut moving = std::mem::take(&mut self.to_relinearize);
        while !(touched.is_empty() && moving.is_empty()) {
            if report.iterations >= self.settings.max_iterations {
                self.to_relinearize = moving;
                return Ok(report);
            }
            if !moving.is_empty() {
                report.halvings += self.retract(&moving)?;
                report.relinearized += moving.len();
                self.moved.extend(moving.iter().copied().map(Node));
                touched.extend(self.linearize_around(&moving)?);
                touched.sort_unstable();
                touched.dedup();
            }
            let steps = Arc::make_mut(&mut self.steps);
            let update = if new_pairs {
                self.elimination.restructure(&touched, steps, prune)?
            } else {
                self.elimination.refresh(&touched, steps, prune)?
            };
            report.iterations += 1;
            report.eliminated_fronts += update.eliminated_fronts;
            report.eliminated_nodes += update.eliminated_nodes;
            (touched, new_pairs) = (Vec::new(), false);
            moving = update.visited;
            moving.retain(|&node| self.steps.value(node).amax() > relinearize_above);
            moving.sort_unstable();
        }
        report.converged = true;
        Ok(report)
    }

    /// Number of keyframes.
    pub fn len(&self) -> usize {
        self.linearizations.len()
    }

    /// True if there is no keyframe yet.
    pub fn is_empty(&self) -> bool {
        self.linearizations.is_empty()
    }

    /// When this smoother re-linearises and when it stops.
    pub fn settings(&self) -> SmootherSettings {
        self.settings
    }

    /// The estimate `world_from_body`: linearisation point times the exponential of its remaining step. The
    /// node must exist.
    pub fn estimate(&self, node: Node) -> Pose {
        self.linearizations[node.index()] * se3::exp(self.steps.value(node.0))
    }

    /// The linearisation point of one keyframe, which must exist.
    pub fn linearization(&self, node: Node) -> &Pose {
        &self.linearizations[node.index()]
    }

    /// The linearisation points of all keyframes, in their order.
    pub fn linearizations(&self) -> &[Pose] {
        &self.linearizations
    }

    /// Keyframes whose linearisation points have moved since the last call, in no order, some of them
    /// repeatedly.
    pub fn take_moved(&mut self) -> Vec<Node> {
        std::mem::take(&mut self.moved)
    }

    /// All factors, in the order of addition.
    pub fn factors(&self) -> impl Iterator<Item = &Factor> {
        self.factors.iter()
    }

    /// Sum of w r^T Sigma^-1 r over all factors at the estimate, without 1/2. Cost: all factors.
    pub fn chi2(&self) -> Result<f64, KernelError> {
        self.factors.iter().map(|factor| self.chi2_of(factor, |node| self.estimate(node))).sum()
    }

    /// The information matrix at the linearisation points and its elimination, as of the last `advance`.
    pub fn elimination(&self) -> &Elimination {
        &self.elimination
    }

    /// Marginal covariance of one keyframe, `[rho; phi]`, at the linearisation points.
    pub fn marginal(&self, node: Node) -> Result<Matrix6<f64>, KernelError> {
        self.elimination.marginal(node)
    }

    fn chi2_of(&self, factor: &Factor, pose: impl Fn(Node) -> Pose) -> Result<f64, KernelError> {
        let (first, second) = factor.nodes();
        factor.chi2(&pose(first), second.map(pose).as_ref())
    }
}
