//! The rows of the touched fronts: which unknowns of the path are eliminated in each, and which pass through
//! it.

use std::ops::Range;

use super::front_assignment::{self, TOP};
use super::structure::{PathStructure, Rows};
use super::variables::Variables;
use crate::elimination::tree::Tree;

impl PathStructure {
    /// Fills `rows` and `ids`, touched front by touched front.
    pub(super) fn lay_out(&mut self, tree: &Tree, variables: Variables) {
        self.rows.clear();
        self.ids.clear();
        // Of each touched front whose parent has not come yet: the unknowns that pass through it. A subtree
        // comes in one piece, so a front finds those of its children on top.
        let mut waiting: Vec<(u32, Range<usize>)> = Vec::new();
        let mut passing: Vec<u32> = Vec::new();
        let (mut next_link, mut next_eliminated) = (0, 0);
        for index in 0..self.touched.len() {
            let front = self.touched[index];
            let links = take_group(&self.links, |link| link.front, index as u32, &mut next_link);
            let eliminated =
                take_group(&self.eliminated, |eliminated| eliminated.0, index as u32, &mut next_eliminated);

            passing.clear();
            passing.extend(self.links[links.clone()].iter().map(|link| self.linked(variables, link.place)));
            if self.robot_at == index as u32 {
                passing.extend(variables.of(0));
            }
            while let Some((_, ids)) = waiting.pop_if(|(child, _)| tree.parent(*child) == front) {
                passing.extend_from_slice(&self.ids[ids]);
            }
            for &(_, retained) in &self.eliminated[eliminated.clone()] {
                match retained.checked_sub(1) {
                    Some(before) => passing.extend(variables.of(before)),
                    None => passing.push(variables.terminal()),
                }
                if retained + 1 < variables.retained {
                    passing.extend(variables.of(retained + 1));
                }
            }
            passing.sort_unstable();
            passing.dedup();
            passing.retain(|&id| match variables.retained_of(id) {
                Some(retained) => front_assignment::is_above(tree, self.front_of[retained as usize], front),
                None => front != TOP,
            });

            let start = self.ids.len();
            let shape = (front != TOP).then(|| &tree.front(front).shape);
            self.ids.extend(shape.iter().flat_map(|shape| &shape.frontal));
            self.ids.extend(
                self.eliminated[eliminated.clone()].iter().flat_map(|&(_, retained)| variables.of(retained)),
            );
            if front == TOP {
                self.ids.push(variables.terminal());
            }
            let frontal = self.ids.len() - start;
            self.ids.extend(shape.iter().flat_map(|shape| &shape.separator));
            let first_passing = self.ids.len();
            self.ids.extend_from_slice(&passing);
            waiting.push((front, first_passing..self.ids.len()));
            self.rows.push(Rows { ids: start..self.ids.len(), frontal, links, eliminated });
        }
    }
}

/// The next entries that belong to a front's place in the order.
fn take_group<T>(sorted: &[T], front: impl Fn(&T) -> u32, place: u32, next: &mut usize) -> Range<usize> {
    let start = *next;
    while sorted.get(*next).is_some_and(|entry| front(entry) == place) {
        *next += 1;
    }
    start..*next
}
