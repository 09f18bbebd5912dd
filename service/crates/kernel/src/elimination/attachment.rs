//! Where a path attaches to the tree: its homes, the fronts it touches and their order. Structure only; the same
//! attachment serves every weight of the links.

use std::ops::Range;

use super::assembly::{Assembly, NONE};
use super::chain::Chain;
use super::homes::{self, TOP};
use super::tree::Tree;
use super::virtual_path::{LinkWeight, VirtualLink, VirtualPath};
use crate::KernelError;

/// A path on a tree. Kept nodes are the virtual nodes that are left after those without links are taken out.
#[derive(Debug, Default)]
pub(super) struct Attachment {
    pub chain: Chain,
    /// Place in `chain.kept` of each virtual node (by node - 1).
    pub kept_place: Vec<u32>,
    /// The front in which each kept node is eliminated, or `TOP`.
    pub homes: Vec<u32>,
    /// Touched fronts, children before parents, then `TOP`.
    pub touched: Vec<u32>,
    /// Place in `touched` of each of them's parent, but for `TOP`.
    pub parents: Vec<u32>,
    /// The rows of each touched front; see `layout`.
    pub rows: Vec<Rows>,
    pub ids: Vec<u32>,
    /// Links and kept nodes, by the place of the front they belong to.
    pub links: Vec<(u32, u32)>,
    pub homed: Vec<(u32, u32)>,
    /// Place in `touched` of the front that eliminates the robot.
    pub robot_at: u32,
    is_linked: Vec<bool>,
    anchors: Vec<(u32, u32)>,
    /// Place of each front in `touched`, else `NONE`.
    place: Vec<u32>,
}

/// A touched front's share of the path.
#[derive(Clone, Debug, Default)]
pub(super) struct Rows {
    /// Its block rows in `Attachment::ids`: eliminated keyframes, eliminated kept nodes, separator, kept nodes that pass.
    pub ids: Range<usize>,
    /// How many of them are eliminated in it.
    pub frontal: usize,
    /// Its entries of `Attachment::links` and `Attachment::homed`.
    pub links: Range<usize>,
    pub homed: Range<usize>,
}

impl Attachment {
    /// Finds what the path touches, with the links that `counts` lets count.
    pub(super) fn attach(
        &mut self,
        tree: &Tree,
        nodes: u32,
        path: &VirtualPath,
        counts: impl Fn(&VirtualLink) -> bool,
    ) -> Result<(), KernelError> {
        let count = path.unary.len();
        self.is_linked.clear();
        self.is_linked.resize(count, false);
        for link in path.links.iter().filter(|link| counts(link)) {
            self.is_linked[link.node as usize - 1] = true;
        }
        self.chain.reduce(path, &self.is_linked)?;
        self.kept_place.clear();
        self.kept_place.resize(count, NONE);
        for (place, &node) in self.chain.kept.iter().enumerate() {
            self.kept_place[node as usize - 1] = place as u32;
        }

        self.anchors.clear();
        self.anchors.push((0, tree.front_of(path.robot.0)));
        for link in path.links.iter().filter(|link| counts(link)) {
            self.anchors.push((self.kept_place[link.node as usize - 1], tree.front_of(link.keyframe.0)));
        }
        homes::homes(tree, self.chain.kept.len(), &self.anchors, &mut self.homes);
        self.order_touched(tree);

        let place = &self.place;
        self.links.clear();
        for (index, link) in path.links.iter().enumerate().filter(|(_, link)| counts(link)) {
            self.links.push((place[tree.front_of(link.keyframe.0) as usize], index as u32));
        }
        self.links.sort_unstable();
        let top = self.touched.len() as u32 - 1;
        self.homed.clear();
        for (kept, &home) in self.homes.iter().enumerate() {
            let at = if home == TOP { top } else { place[home as usize] };
            self.homed.push((at, kept as u32));
        }
        self.homed.sort_unstable();
        self.robot_at = place[tree.front_of(path.robot.0) as usize];
        self.parents.clear();
        for &front in &self.touched[..top as usize] {
            let parent = tree.parent(front);
            self.parents.push(if parent == TOP { top } else { self.place[parent as usize] });
        }
        for &front in &self.touched[..top as usize] {
            self.place[front as usize] = NONE;
        }
        self.lay_out(tree, nodes, path);
        Ok(())
    }

    /// Fills `touched` and `place` from the anchors: each anchor's front and all above it, so that the subtree of
    /// each comes in one piece right before it.
    fn order_touched(&mut self, tree: &Tree) {
        self.place.resize(tree.id_bound().max(self.place.len()), NONE);
        self.touched.clear();
        let mut waiting: Vec<u32> = Vec::new();
        for &(_, front) in &self.anchors {
            let mut id = front;
            while id != TOP && self.place[id as usize] == NONE {
                self.place[id as usize] = 0;
                if tree.parent(id) == TOP {
                    waiting.push(id);
                }
                id = tree.parent(id);
            }
        }
        // Parents first, then reversed: a depth-first order without recursion.
        while let Some(id) = waiting.pop() {
            self.touched.push(id);
            let children = &tree.front(id).shape.children;
            waiting.extend(children.iter().filter(|&&child| self.place[child as usize] != NONE));
        }
        self.touched.reverse();
        for (place, &id) in self.touched.iter().enumerate() {
            self.place[id as usize] = place as u32;
        }
        self.touched.push(TOP);
    }

    /// Adds a touched front's share of the path's information. `base` is the id of the first kept node.
    pub(super) fn add_path(
        &self,
        assembly: &mut Assembly,
        path: &VirtualPath,
        weight: LinkWeight,
        index: usize,
        base: u32,
    ) {
        let rows = &self.rows[index];
        for &(_, link) in &self.links[rows.links.clone()] {
            let link = &path.links[link as usize];
            let scale = weight.of(link);
            let id = base + self.kept_place[link.node as usize - 1];
            assembly.add_diagonal(link.keyframe.0, &(link.information.first * scale));
            assembly.add_cross(link.keyframe.0, id, &(link.information.cross * scale));
            assembly.add_diagonal(id, &(link.information.second * scale));
        }
        if self.robot_at == index as u32 {
            self.add_join(assembly, 0, path.robot.0, base);
        }
        for &(_, kept) in &self.homed[rows.homed.clone()] {
            assembly.add_diagonal(base + kept, &path.unary[self.chain.kept[kept as usize] as usize - 1]);
            if kept > 0 && assembly.has(base + kept - 1) {
                self.add_join(assembly, kept, base + kept - 1, base);
            }
            // If the next node is eliminated here too, its own turn adds what joins them.
            let next_home = self.homes.get(kept as usize + 1);
            if next_home.is_some_and(|&next| next != self.touched[index]) && assembly.has(base + kept + 1) {
                self.add_join(assembly, kept + 1, base + kept, base);
            }
        }
    }

    /// What joins a kept node to the node before it along the path, whose id is `before`.
    fn add_join(&self, assembly: &mut Assembly, kept: u32, before: u32, base: u32) {
        let join = &self.chain.joins[kept as usize];
        assembly.add_diagonal(before, &join.first);
        assembly.add_cross(before, base + kept, &join.cross);
        assembly.add_diagonal(base + kept, &join.second);
    }
}
