//! Covariance of every virtual node of a path, from the factors of the touched fronts.

use nalgebra::Matrix6;

use super::assembly::{Assembly, NONE};
use super::chain::PairCovariance;
use super::dense;
use super::expected::Workspace;
use super::takahashi::FrontCovariance;

/// Factors of the touched fronts, in the order of elimination.
#[derive(Debug, Default)]
pub(super) struct Record {
    ids: Vec<u32>,
    factors: Vec<f64>,
    entries: Vec<Entry>,
}

#[derive(Clone, Copy, Debug)]
struct Entry {
    first_id: usize,
    blocks: usize,
    frontal: usize,
    first_value: usize,
}

impl Record {
    pub(super) fn clear(&mut self) {
        self.ids.clear();
        self.factors.clear();
        self.entries.clear();
    }

    pub(super) fn push(&mut self, eliminated: &Assembly) {
        let (first_id, first_value) = (self.ids.len(), self.factors.len());
        let blocks = eliminated.ids().len();
        self.entries.push(Entry { first_id, blocks, frontal: eliminated.frontal_rows() / 6, first_value });
        self.ids.extend_from_slice(eliminated.ids());
        self.factors.extend_from_slice(eliminated.factor());
    }
}

impl Workspace {
    /// Covariance of each virtual node 1 to n, after `terminal` with `record`. `robot` is the robot's id, `base` the id of
    /// the first kept node.
    pub(super) fn along(&self, robot: u32, base: u32) -> Vec<Matrix6<f64>> {
        let kept = &self.attachment.chain.kept;
        let mut own = vec![Matrix6::zeros(); kept.len()];
        let mut pairs: Vec<Option<PairCovariance>> = vec![None; kept.len()];
        self.descend(robot, base, |ids, frontal, covariance| {
            for (place, &id) in ids[..frontal].iter().enumerate() {
                // The nodes along the path: the robot, then the kept ones.
                let step = if id == robot {
                    0
                } else if id >= base {
                    own[(id - base) as usize] = covariance.own_block(place);
                    (id - base) as usize + 1
                } else {
                    continue;
                };
                let find = |step: usize| {
                    let wanted = if step == 0 { robot } else { base + step as u32 - 1 };
                    ids.iter().position(|&id| id == wanted)
                };
                let mut join = |first: usize, second: usize, at: usize| {
                    pairs[at] = Some(PairCovariance {
                        first: covariance.own_block(first),
                        cross: covariance.block(first, second),
                        second: covariance.own_block(second),
                    });
                };
                if let Some(before) = step.checked_sub(1).and_then(find) {
                    join(before, place, step - 1);
                }
                if let Some(after) = Some(step + 1).filter(|&next| next <= kept.len()).and_then(find) {
                    join(place, after, step);
                }
            }
        });
        self.fill_gaps(&own, &pairs)
    }

    /// Visits the touched fronts that eliminate a node of the path, and those above them, from the top down with their
    /// ids, the number eliminated in each, and the covariance of all its rows.
    fn descend(&self, robot: u32, base: u32, mut visit: impl FnMut(&[u32], usize, &FrontCovariance)) {
        let count = self.attachment.touched.len();
        let mut needed = vec![false; count];
        let mut first_child = vec![NONE; count];
        let mut sibling = vec![NONE; count];
        for index in 0..count {
            let (entry, ids) = self.recorded(index);
            needed[index] |= ids[..entry.frontal].iter().any(|&id| id == robot || id >= base);
            if let Some(&parent) = self.attachment.parents.get(index).filter(|_| needed[index]) {
                needed[parent as usize] = true;
                sibling[index] = first_child[parent as usize];
                first_child[parent as usize] = index as u32;
            }
        }
        let mut separators: Vec<Vec<f64>> = vec![Vec::new(); count];
        let id_bound = self.record.ids.iter().max().map_or(0, |&greatest| greatest as usize + 1);
        let mut place_of = vec![NONE; id_bound];
        let mut covariance = FrontCovariance::default();
        for index in (0..count).rev().filter(|&index| needed[index]) {
            let (entry, ids) = self.recorded(index);
            let (rows, frontal_rows) = (6 * entry.blocks, 6 * entry.frontal);
            let factor = &self.record.factors[entry.first_value..][..dense::leading(rows) * frontal_rows];
            covariance.compute(factor, rows, frontal_rows, &std::mem::take(&mut separators[index]));
            visit(ids, entry.frontal, &covariance);
            for (place, &id) in ids.iter().enumerate() {
                place_of[id as usize] = place as u32;
            }
            let mut child = first_child[index];
            while child != NONE {
                let (below, child_ids) = self.recorded(child as usize);
                let shared: Vec<u32> =
                    child_ids[below.frontal..].iter().map(|&id| place_of[id as usize]).collect();
                separators[child as usize] = covariance.gather(&shared);
                child = sibling[child as usize];
            }
        }
    }

    fn recorded(&self, index: usize) -> (Entry, &[u32]) {
        let entry = self.record.entries[index];
        (entry, &self.record.ids[entry.first_id..entry.first_id + entry.blocks])
    }

    /// Puts the nodes that were taken out of the chain back in, from the end of the path to its beginning.
    fn fill_gaps(&self, own: &[Matrix6<f64>], pairs: &[Option<PairCovariance>]) -> Vec<Matrix6<f64>> {
        let mut covariances =
            vec![Matrix6::zeros(); self.attachment.chain.kept.last().map_or(0, |&last| last as usize)];
        for (&node, covariance) in self.attachment.chain.kept.iter().zip(own) {
            covariances[node as usize - 1] = *covariance;
        }
        let mut around: Option<(u32, PairCovariance)> = None;
        for gap in self.attachment.chain.gaps.iter().rev() {
            let outer = match around {
                Some((next_kept, inner)) if next_kept == gap.next_kept => inner,
                _ => pairs[gap.next_kept as usize].expect("neighbours meet in the front of the lower one"),
            };
            let inserted = gap.insert(&outer);
            covariances[gap.node as usize - 1] = inserted.second;
            around = Some((gap.next_kept, inserted));
        }
        covariances
    }
}
