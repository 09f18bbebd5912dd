//! Virtual nodes that register with nothing: eliminated along the path before anything else.

use nalgebra::Matrix6;

use super::positive_definite;
use super::virtual_path::VirtualPath;
use crate::KernelError;
use crate::information::PairInformation;

/// A path of which only the nodes with links, and the last, are left.
#[derive(Debug, Default)]
pub(super) struct Chain {
    /// Virtual nodes (1 to n) that are left, ascending; the last is n.
    pub kept: Vec<u32>,
    /// Information between each kept node and the one before it; before the first is the robot.
    pub joins: Vec<PairInformation>,
    /// The nodes taken out, ascending.
    pub gaps: Vec<Gap>,
}

/// A node that was taken out between node a before it (kept, or the robot) and node b right after it:
/// given those, its mean is -A x_a - B x_b and its covariance D^-1.
#[derive(Debug)]
pub(super) struct Gap {
    /// Virtual node, 1 to n - 1.
    pub node: u32,
    /// Place in `kept` of the next kept node.
    pub next_kept: u32,
    own: Matrix6<f64>,
    before: Matrix6<f64>,
    after: Matrix6<f64>,
}

/// Joint covariance of two nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct PairCovariance {
    pub first: Matrix6<f64>,
    /// Rows of the first, columns of the second.
    pub cross: Matrix6<f64>,
    pub second: Matrix6<f64>,
}

impl Chain {
    /// Takes out every node but the last that `is_linked` (by node - 1) does not name.
    pub(super) fn reduce(&mut self, path: &VirtualPath, is_linked: &[bool]) -> Result<(), KernelError> {
        self.kept.clear();
        self.joins.clear();
        self.gaps.clear();
        let count = path.unary.len();
        let mut join = path.steps[0];
        for (index, &is_linked) in is_linked.iter().enumerate() {
            let node = index as u32 + 1;
            if is_linked || index + 1 == count {
                let next = if index + 1 < count { path.steps[index + 1] } else { join };
                self.joins.push(std::mem::replace(&mut join, next));
                self.kept.push(node);
                continue;
            }
            let step = &path.steps[index + 1];
            let information = join.second + path.unary[index] + step.first;
            let own = positive_definite::inverse(&information)
                .map_err(|pivot| KernelError::VirtualNotPositiveDefinite { node, pivot })?;
            let before = own * join.cross.transpose();
            let after = own * step.cross;
            join = PairInformation {
                first: (join.first - join.cross * before).symmetric_part(),
                cross: -join.cross * after,
                second: (step.second - step.cross.transpose() * after).symmetric_part(),
            };
            self.gaps.push(Gap { node, next_kept: self.kept.len() as u32, own, before, after });
        }
        Ok(())
    }
}

impl Gap {
    /// From the joint covariance of the nodes before and after: that of the node before (first) and this one (second).
    pub(super) fn insert(&self, around: &PairCovariance) -> PairCovariance {
        let PairCovariance { first, cross, second } = around;
        // Cov(x_a, x) = -(S_aa A^T + S_ab B^T), Cov(x_b, x) = -(S_ba A^T + S_bb B^T).
        let with_before = -(first * self.before.transpose() + cross * self.after.transpose());
        let with_after = -(cross.transpose() * self.before.transpose() + second * self.after.transpose());
        let own = self.own - self.before * with_before - self.after * with_after;
        PairCovariance { first: *first, cross: with_before, second: own.symmetric_part() }
    }
}
