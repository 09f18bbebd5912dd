//! The incremental maximum-a-posteriori estimate over all factors.

use nalgebra::Matrix6;

use crate::elimination::Elimination;
use crate::factors::Factor;
use crate::se3::Pose;
use crate::{KernelError, Node};

/// When a smoother re-linearises and when it stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmootherSettings {
    /// A node is linearised anew once an entry of its step exceeds this, in m and rad.
    pub relinearize_above: f64,
    /// Gauss-Newton steps of one `advance` at most.
    pub max_iterations: usize,
}

/// What one `advance` did.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct AdvanceReport {
    /// Gauss-Newton steps taken.
    pub iterations: usize,
    /// Whether every step is within `relinearize_above` of its linearisation point. If not, the next `advance` goes on.
    pub converged: bool,
    /// Node linearisations that were made anew.
    pub relinearized: usize,
    /// Fronts eliminated.
    pub eliminated_fronts: usize,
    /// Keyframes in these fronts.
    pub eliminated_nodes: usize,
    /// Steps that had to be shortened because the cost grew.
    pub shortened_steps: usize,
}

/// Incremental smoother; cloning is cheap.
#[derive(Clone, Debug)]
pub struct Smoother {}

impl Smoother {
    /// An empty smoother.
    pub fn new(settings: SmootherSettings) -> Smoother {
        let _ = settings;
        unimplemented!()
    }

    /// Adds a node with its first estimate; factors must tie it before the next `advance`.
    pub fn add_keyframe(&mut self, world_from_body: Pose) -> Node {
        let _ = world_from_body;
        unimplemented!()
    }

    /// Adds a factor between nodes that exist.
    pub fn add_factor(&mut self, factor: Factor) -> Result<(), KernelError> {
        let _ = factor;
        unimplemented!()
    }

    /// Eliminates what was touched and steps until the estimate is at the optimum.
    pub fn advance(&mut self) -> Result<AdvanceReport, KernelError> {
        unimplemented!()
    }

    /// Number of keyframes.
    pub fn len(&self) -> usize {
        unimplemented!()
    }

    /// True if there is no keyframe yet.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The estimate: linearisation point times the exponential of its remaining step.
    pub fn estimate(&self, node: Node) -> Pose {
        let _ = node;
        unimplemented!()
    }

    /// The linearisation point of one node.
    pub fn linearization(&self, node: Node) -> &Pose {
        let _ = node;
        unimplemented!()
    }

    /// The linearisation points of all nodes, in their order.
    pub fn linearizations(&self) -> &[Pose] {
        unimplemented!()
    }

    /// All factors, in the order of addition.
    pub fn factors(&self) -> impl Iterator<Item = &Factor> {
        std::iter::empty()
    }

    /// Sum of the weighted squared residuals at the estimate, without 1/2.
    pub fn chi2(&self) -> Result<f64, KernelError> {
        unimplemented!()
    }

    /// The information matrix at the linearisation points and its elimination.
    pub fn elimination(&self) -> &Elimination {
        unimplemented!()
    }

    /// Marginal covariance of one keyframe, `[rho; phi]`, at the linearisation points.
    pub fn marginal(&self, node: Node) -> Result<Matrix6<f64>, KernelError> {
        let _ = node;
        unimplemented!()
    }
}
