//! Expected covariance of a path: only the fronts it touches are eliminated again.

use std::ops::Range;

use nalgebra::{Cholesky, Matrix6};

use super::along;
use super::assembly::Assembly;
use super::chain::Chain;
use super::homes::{self, TOP};
use super::system::BlockSystem;
use super::tree::Tree;
use super::update_stack::UpdateStack;
use super::virtual_path::{LinkWeight, VirtualPath};
use crate::{KernelError, Node};

/// Buffers that expected covariances are computed in; one a thread, reused from call to call.
#[derive(Debug, Default)]
pub struct Workspace {
    pub(super) assembly: Assembly,
    pub(super) chain: Chain,
    pub(super) is_linked: Vec<bool>,
    /// Place in `chain.kept` of each virtual node (by node - 1).
    pub(super) kept_place: Vec<u32>,
    pub(super) anchors: Vec<(u32, u32)>,
    pub(super) homes: Vec<u32>,
    /// Touched fronts, children before parents, then `TOP`.
    pub(super) touched: Vec<u32>,
    /// Place in `touched` of each of them's parent, but for `TOP`.
    pub(super) parents: Vec<u32>,
    /// Place of each front in `touched`, else `NONE`.
    pub(super) place: Vec<u32>,
    /// Links that count, and kept nodes, by the place of the front they belong to.
    pub(super) links: Vec<(u32, u32)>,
    pub(super) homed: Vec<(u32, u32)>,
    updates: UpdateStack,
    pub(super) record: along::Record,
}

/// What is needed of the elimination.
#[derive(Clone, Copy)]
pub(super) struct Ground<'a> {
    pub tree: &'a Tree,
    pub system: &'a BlockSystem,
}

impl Workspace {
    /// Covariance of the terminal node. With `record`, the factors of all touched fronts are kept.
    pub(super) fn terminal(
        &mut self,
        ground: Ground,
        path: &VirtualPath,
        weight: LinkWeight,
        record: bool,
    ) -> Result<Matrix6<f64>, KernelError> {
        self.attach(ground, path, weight)?;
        self.record.clear();
        self.updates.clear();
        let (mut next_link, mut next_homed) = (0, 0);
        for index in 0..self.touched.len() {
            let links = take_group(&self.links, index as u32, &mut next_link);
            let homed = take_group(&self.homed, index as u32, &mut next_homed);
            self.eliminate(ground, path, weight, self.touched[index], links, homed, record)?;
        }
        let information = self.assembly.last_pivot();
        Ok(Cholesky::new(information).expect("a pivot that was accepted is positive definite").inverse())
    }

    #[allow(clippy::too_many_arguments, reason = "one front's share of a path has this many parts")]
    fn eliminate(
        &mut self,
        ground: Ground,
        path: &VirtualPath,
        weight: LinkWeight,
        front: u32,
        links: Range<usize>,
        homed: Range<usize>,
        record: bool,
    ) -> Result<(), KernelError> {
        let base = ground.system.len() as u32;
        let shape = (front != TOP).then(|| &*ground.tree.front(front).shape);
        let (frontal, separator, children) = shape.map_or((&[][..], &[][..], &[][..]), |shape| {
            (&shape.frontal[..], &shape.separator[..], &shape.children[..])
        });
        let below = self.updates.first_below(ground.tree, front);
        let holds_robot = frontal.contains(&path.robot.0);

        // Virtual nodes that pass through: joined here, eliminated further up.
        let mut passing: Vec<u32> = Vec::new();
        passing.extend(
            self.links[links.clone()]
                .iter()
                .map(|&(_, link)| self.kept_place[path.links[link as usize].node as usize - 1]),
        );
        if holds_robot {
            passing.push(0);
        }
        for entry in below..self.updates.len() {
            passing.extend(self.updates.ids(entry).iter().filter(|&&id| id >= base).map(|&id| id - base));
        }
        for &(_, kept) in &self.homed[homed.clone()] {
            passing.extend((kept > 0).then(|| kept - 1));
            passing.extend((kept as usize + 1 < self.homes.len()).then_some(kept + 1));
        }
        passing.sort_unstable();
        passing.dedup();
        passing.retain(|&kept| homes::is_above(ground.tree, self.homes[kept as usize], front));

        let virtual_frontal = || self.homed[homed.clone()].iter().map(|&(_, kept)| base + kept);
        let ids = frontal.iter().copied().chain(virtual_frontal());
        let ids = ids.chain(separator.iter().copied()).chain(passing.iter().map(|&kept| base + kept));
        let frontal_count = frontal.len() + homed.len();
        self.assembly.begin(ids, frontal_count, base as usize + self.homes.len());

        let (chain, updates, homes) = (&self.chain, &self.updates, &self.homes);
        let (links, homed) = (&self.links[links], &self.homed[homed]);
        let kept_place = &self.kept_place;
        let put_together = |assembly: &mut Assembly| {
            assembly.add_system(ground.system, frontal);
            for &(_, link) in links {
                let link = &path.links[link as usize];
                let scale = weight.of(link);
                assembly.add_diagonal(link.keyframe.0, &(link.information.first * scale));
                let id = base + kept_place[link.node as usize - 1];
                assembly.add_cross(link.keyframe.0, id, &(link.information.cross * scale));
                assembly.add_diagonal(id, &(link.information.second * scale));
            }
            if holds_robot {
                assembly.add_diagonal(path.robot.0, &chain.joins[0].first);
                assembly.add_cross(path.robot.0, base, &chain.joins[0].cross);
                assembly.add_diagonal(base, &chain.joins[0].second);
            }
            for &(_, kept) in homed {
                assembly.add_diagonal(base + kept, &path.unary[chain.kept[kept as usize] as usize - 1]);
            }
            add_joins(assembly, chain, homed, homes, base);
            for &child in children {
                if !updates.holds(below, child) {
                    let child = ground.tree.front(child);
                    assembly.add_update(&child.shape.separator, &child.update);
                }
            }
            for entry in below..updates.len() {
                assembly.add_update(updates.ids(entry), updates.values(entry));
            }
        };
        put_together(&mut self.assembly);
        self.assembly.eliminate(put_together).map_err(|(id, pivot)| match id.checked_sub(base) {
            None => KernelError::NotPositiveDefinite { node: Node(id), pivot },
            Some(kept) => KernelError::VirtualNotPositiveDefinite { node: chain.kept[kept as usize], pivot },
        })?;
        self.updates.replace(below, front, &self.assembly);
        if record {
            self.record.push(&self.assembly);
        }
        Ok(())
    }
}

/// Adds the information between neighbours along the path of which one is eliminated here and the other not
/// before.
fn add_joins(assembly: &mut Assembly, chain: &Chain, homed: &[(u32, u32)], homes: &[u32], base: u32) {
    for &(_, kept) in homed {
        let here = homes[kept as usize];
        if kept > 0 && assembly.has(base + kept - 1) {
            add_join(assembly, chain, kept, base);
        }
        // If the next node is eliminated here too, its own turn adds what joins them.
        if homes.get(kept as usize + 1).is_some_and(|&next| next != here) && assembly.has(base + kept + 1) {
            add_join(assembly, chain, kept + 1, base);
        }
    }
}

fn add_join(assembly: &mut Assembly, chain: &Chain, kept: u32, base: u32) {
    let join = &chain.joins[kept as usize];
    assembly.add_diagonal(base + kept - 1, &join.first);
    assembly.add_cross(base + kept - 1, base + kept, &join.cross);
    assembly.add_diagonal(base + kept, &join.second);
}

/// The next entries that belong to a front's place in the order.
fn take_group(sorted: &[(u32, u32)], place: u32, next: &mut usize) -> Range<usize> {
    let start = *next;
    while sorted.get(*next).is_some_and(|&(at, _)| at == place) {
        *next += 1;
    }
    start..*next
}
