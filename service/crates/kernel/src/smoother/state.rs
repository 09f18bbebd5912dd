//! What of a smoother does not follow from its factors, to be saved and to go on from.

use nalgebra::Vector6;
use std::sync::Arc;

use super::{Smoother, SmootherSettings};
use crate::KernelError;
use crate::elimination::{Solution, TreeState};
use crate::factors::Factor;
use crate::se3::Pose;

/// The linearisation points, the steps, and the tree on which they were found. With the factors in their
/// order this is the whole smoother: every other number is a function of them, bit for bit.
#[derive(Clone, Debug, PartialEq)]
pub struct SmootherState {
    /// Linearisation point of each keyframe, `world_from_body`, m.
    pub linearizations: Vec<Pose>,
    /// Step of each keyframe from there, `[rho (m); phi (rad)]`.
    pub steps: Vec<Vector6<f64>>,
    /// For each front, at least how far the steps above it have moved since it was last solved, m and rad.
    pub unpropagated: Vec<f64>,
    /// Keyframes whose step is beyond the tolerance.
    pub to_relinearize: Vec<u32>,
    /// Number of factors.
    pub factors: u64,
    /// The tree.
    pub tree: TreeState,
}

impl Smoother {
    /// What must be saved of it; none while factors wait for the next `advance`. Cost: a copy.
    pub fn state(&self) -> Option<SmootherState> {
        if self.linearized_factors < self.factors.len() || self.elimination.has_new_nodes() {
            return None;
        }
        let (steps, unpropagated) = self.steps.parts();
        Some(SmootherState {
            linearizations: self.linearizations.to_vec(),
            steps: steps.to_vec(),
            unpropagated: unpropagated.to_vec(),
            to_relinearize: self.to_relinearize.clone(),
            factors: self.factors.len() as u64,
            tree: self.elimination.state(),
        })
    }

    /// The smoother that had this state, from its settings and its factors in the order of addition. From
    /// here on it goes the same way, bit for bit.
    ///
    /// Cost: linearising each factor once and one elimination, without ordering. Errors:
    /// [`KernelError::OtherGraph`] for a state of other factors, and those of [`Smoother::advance`].
    pub fn restore(
        settings: SmootherSettings,
        state: SmootherState,
        factors: impl IntoIterator<Item = Factor>,
    ) -> Result<Smoother, KernelError> {
        let other = |problem| Err(KernelError::OtherGraph { problem });
        let SmootherState { linearizations, steps, unpropagated, to_relinearize, factors: count, tree } =
            state;
        let nodes = linearizations.len();
        if steps.len() != nodes || to_relinearize.iter().any(|&node| node as usize >= nodes) {
            return other("the steps are those of other keyframes");
        }
        if unpropagated.len() > tree.fronts.len() {
            return other("the steps are those of another tree");
        }
        let mut smoother = Smoother::new(settings);
        for world_from_body in linearizations {
            smoother.add_keyframe(world_from_body);
        }
        for factor in factors {
            smoother.add_factor(factor)?;
        }
        if smoother.factors.len() as u64 != count {
            return other("the number of factors is another");
        }
        smoother.linearize_new_factors()?;
        smoother.elimination.restore(&tree)?;
        smoother.steps = Arc::new(Solution::of(steps, unpropagated));
        smoother.to_relinearize = to_relinearize;
        Ok(smoother)
    }
}
