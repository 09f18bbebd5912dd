//! All factors, and those of each keyframe.

use crate::SharedVec;
use crate::factors::Factor;

const END: u32 = u32::MAX;

/// Factors in the order of addition. The factors of a keyframe are linked from the latest to the first, in
/// flat lists that copies share.
#[derive(Clone, Debug, Default)]
pub(super) struct FactorList {
    factors: SharedVec<Factor>,
    /// The latest factor of each keyframe.
    latest: SharedVec<u32>,
    /// For each factor, the one before it at its first and at its second keyframe.
    before: SharedVec<[u32; 2]>,
}

impl FactorList {
    pub(super) fn add_node(&mut self) {
        self.latest.push(END);
    }

    pub(super) fn push(&mut self, factor: Factor) {
        let index = u32::try_from(self.factors.len()).expect("fewer than 2^32 factors");
        let (first, second) = factor.nodes();
        let mut link = |node: crate::Node| std::mem::replace(&mut self.latest[node.index()], index);
        let before = [link(first), second.map_or(END, link)];
        self.before.push(before);
        self.factors.push(factor);
    }

    pub(super) fn len(&self) -> usize {
        self.factors.len()
    }

    pub(super) fn get(&self, index: usize) -> &Factor {
        &self.factors[index]
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &Factor> {
        self.factors.iter()
    }

    /// Indices of a keyframe's factors, the latest first.
    pub(super) fn of(&self, node: u32) -> impl Iterator<Item = u32> + '_ {
        let mut next = self.latest[node as usize];
        std::iter::from_fn(move || {
            let index = next;
            if index == END {
                return None;
            }
            let is_first = self.factors[index as usize].nodes().0.0 == node;
            next = self.before[index as usize][usize::from(!is_first)];
            Some(index)
        })
    }
}
