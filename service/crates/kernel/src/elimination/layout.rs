//! The rows of the touched fronts: which virtual nodes are eliminated in each, and which pass through it.

use std::ops::Range;

use super::attachment::{Attachment, Rows};
use super::homes::{self, TOP};
use super::tree::Tree;
use super::virtual_path::VirtualPath;

impl Attachment {
    /// Fills `rows` and `ids`, touched front by touched front. `base` is the id of the first kept node.
    pub(super) fn lay_out(&mut self, tree: &Tree, base: u32, path: &VirtualPath) {
        self.rows.clear();
        self.ids.clear();
        // Of each touched front whose parent has not come yet: the kept nodes that pass through it. A subtree comes
        // in one piece, so a front finds those of its children on top.
        let mut waiting: Vec<(u32, Range<usize>)> = Vec::new();
        let mut passing: Vec<u32> = Vec::new();
        let (mut next_link, mut next_homed) = (0, 0);
        for index in 0..self.touched.len() {
            let front = self.touched[index];
            let links = take_group(&self.links, index as u32, &mut next_link);
            let homed = take_group(&self.homed, index as u32, &mut next_homed);

            passing.clear();
            let linked = self.links[links.clone()].iter();
            passing.extend(
                linked.map(|&(_, link)| self.kept_place[path.links[link as usize].node as usize - 1]),
            );
            passing.extend((self.robot_at == index as u32).then_some(0));
            while let Some((child, ids)) = waiting.pop_if(|(child, _)| tree.parent(*child) == front) {
                debug_assert_ne!(child, front);
                passing.extend(self.ids[ids].iter().map(|&id| id - base));
            }
            for &(_, kept) in &self.homed[homed.clone()] {
                passing.extend(kept.checked_sub(1));
                passing.extend(Some(kept + 1).filter(|&next| (next as usize) < self.homes.len()));
            }
            passing.sort_unstable();
            passing.dedup();
            passing.retain(|&kept| homes::is_above(tree, self.homes[kept as usize], front));

            let start = self.ids.len();
            let shape = (front != TOP).then(|| &tree.front(front).shape);
            self.ids.extend(shape.iter().flat_map(|shape| &shape.frontal));
            self.ids.extend(self.homed[homed.clone()].iter().map(|&(_, kept)| base + kept));
            let frontal = self.ids.len() - start;
            self.ids.extend(shape.iter().flat_map(|shape| &shape.separator));
            let first_passing = self.ids.len();
            self.ids.extend(passing.iter().map(|&kept| base + kept));
            if front != TOP {
                waiting.push((front, first_passing..self.ids.len()));
            }
            self.rows.push(Rows { ids: start..self.ids.len(), frontal, links, homed });
        }
    }
}

/// The next entries that belong to a front's place in the order.
fn take_group(sorted: &[(u32, u32)], place: u32, next: &mut usize) -> Range<usize> {
    let start = *next;
    while sorted.get(*next).is_some_and(|&(at, _)| at == place) {
        *next += 1;
    }
    start..*next
}
