//! From factors to the blocks of the normal equations at the linearisation points.

use std::collections::BTreeSet;

use super::Smoother;
use crate::factors::Linearized;
use crate::{KernelError, Node};

/// Which parts of a factor's information are wanted.
struct Wanted {
    first: bool,
    second: bool,
    cross: bool,
}

impl Smoother {
    /// Linearises the factors that have come since the last call. Returns the keyframes they touch, and
    /// whether they bring new keyframes or new pairs.
    pub(super) fn linearize_new_factors(&mut self) -> Result<(Vec<u32>, bool), KernelError> {
        let mut touched = Vec::new();
        let mut new_pairs = self.elimination.has_new_nodes();
        for index in self.linearized_factors..self.factors.len() {
            let (first, second) = self.factors.get(index).nodes();
            touched.push(first.0);
            touched.extend(second.map(|node| node.0));
            new_pairs |= self.add_blocks(index, &Wanted { first: true, second: true, cross: true })?;
        }
        self.linearized_factors = self.factors.len();
        if new_pairs {
            // A keyframe without any factor must be reported, not overlooked.
            touched.extend(self.elimination.new_nodes());
        }
        touched.sort_unstable();
        touched.dedup();
        Ok((touched, new_pairs))
    }

    /// Linearises all factors of these keyframes (ascending) anew. Returns the keyframes whose blocks change.
    ///
    /// The diagonal block of a neighbour changes too, and is summed anew from all of its factors: subtracting
    /// the old information would leave rounding errors behind.
    pub(super) fn linearize_around(&mut self, moved: &[u32]) -> Result<Vec<u32>, KernelError> {
        let mut changed: BTreeSet<u32> = moved.iter().copied().collect();
        for &node in moved {
            changed.extend(self.elimination.system().neighbours(node).iter().map(|neighbour| neighbour.node));
        }
        let mut factors: Vec<u32> = changed.iter().flat_map(|&node| self.factors.of(node)).collect();
        factors.sort_unstable();
        factors.dedup();
        for &node in &changed {
            self.elimination.system_mut().clear_diagonal(node);
        }
        for &node in moved {
            self.elimination.system_mut().clear_cross(node);
        }
        let has_moved = |node: Node| moved.binary_search(&node.0).is_ok();
        for index in factors {
            let (first, second) = self.factors.get(index as usize).nodes();
            let wanted = Wanted {
                first: changed.contains(&first.0),
                second: second.is_some_and(|node| changed.contains(&node.0)),
                cross: has_moved(first) || second.is_some_and(has_moved),
            };
            self.add_blocks(index as usize, &wanted)?;
        }
        Ok(changed.into_iter().collect())
    }

    /// Adds the wanted parts of J^T J and -J^T r of one factor. True if it joins a new pair.
    fn add_blocks(&mut self, index: usize, wanted: &Wanted) -> Result<bool, KernelError> {
        let factor = self.factors.get(index);
        let (first, second) = factor.nodes();
        let at = |node: Node| &self.linearizations[node.index()];
        let Linearized { residual, jacobians: [of_first, of_second] } =
            factor.linearize(at(first), second.map(at))?;
        let system = self.elimination.system_mut();
        if wanted.first {
            system.add_diagonal(first, &of_first.tr_mul(&of_first), &-of_first.tr_mul(&residual));
        }
        let Some(second) = second else { return Ok(false) };
        if wanted.second {
            system.add_diagonal(second, &of_second.tr_mul(&of_second), &-of_second.tr_mul(&residual));
        }
        Ok(wanted.cross && system.add_cross(first, second, &of_first.tr_mul(&of_second)))
    }
}
