//! Moves linearisation points to where the steps point, carefully when the steps are large.

use nalgebra::Vector6;
use std::sync::Arc;

use super::Smoother;
use crate::factors::Factor;
use crate::loss::Loss;
use crate::{KernelError, Node, se3};

/// A step with no entry larger than this (m, rad) is taken without asking for the cost, which would take a
/// visit to every factor; the linearisation errors of such steps are small, and the next iteration corrects
/// them.
const LARGE_STEP: f64 = 0.1;

/// How often a step is halved at most.
const MOST_HALVINGS: usize = 12;

impl Smoother {
    /// Moves the linearisation points of these keyframes (ascending) by their steps. If a step is large and
    /// the cost would grow, all of them are halved until it does not. Returns the number of halvings.
    pub(super) fn retract(&mut self, moving: &[u32]) -> Result<usize, KernelError> {
        let largest = moving.iter().map(|&node| self.steps.value(node).amax()).fold(0.0, f64::max);
        let mut halvings = 0;
        if largest > LARGE_STEP {
            let before = self.cost(moving, 0.0)?;
            // A pose that a factor cannot be evaluated at costs too much.
            while halvings < MOST_HALVINGS
                && !self.cost(moving, scale(halvings)).is_ok_and(|cost| cost <= before * (1.0 + 1e-12))
            {
                halvings += 1;
            }
        }
        let (linearizations, steps) =
            (Arc::make_mut(&mut self.linearizations), Arc::make_mut(&mut self.steps));
        for &node in moving {
            let step: Vector6<f64> = steps.value(node) * scale(halvings);
            let pose = &mut linearizations[node as usize];
            *pose *= se3::exp(&step);
            pose.rotation.renormalize();
            steps.reset(node);
        }
        Ok(halvings)
    }

    /// The cost over all factors with these keyframes moved by a share of their steps, the others at the
    /// estimate.
    fn cost(&self, moving: &[u32], share: f64) -> Result<f64, KernelError> {
        let pose = |node: Node| {
            let share = if moving.binary_search(&node.0).is_ok() { share } else { 1.0 };
            self.linearizations[node.index()] * se3::exp(&(self.steps.value(node.0) * share))
        };
        self.factors.iter().map(|factor| Ok(robust_cost(factor, self.chi2_of(factor, pose)?))).sum()
    }
}

fn scale(halvings: usize) -> f64 {
    0.5_f64.powi(halvings as i32)
}

/// What re-weighted least squares minimises: the loss whose weight w gave chi2 = w r^2.
fn robust_cost(factor: &Factor, chi2: f64) -> f64 {
    match factor.loss() {
        Loss::None => chi2,
        // Below c the loss is r^2; above, chi2 = c r and the loss is 2 c r - c^2.
        Loss::Huber(c) => {
            if chi2 <= c * c {
                chi2
            } else {
                2.0 * chi2 - c * c
            }
        }
        // chi2 = r^2 / (1 + r^2 / c^2), the loss c^2 ln(1 + r^2 / c^2).
        Loss::Cauchy(c) => -c * c * (-(chi2 / (c * c)).min(1.0 - f64::EPSILON)).ln_1p(),
    }
}
