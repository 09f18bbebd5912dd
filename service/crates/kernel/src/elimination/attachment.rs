//! Where a path attaches to the tree: its homes, the fronts it touches and their order.

use super::assembly::NONE;
use super::expected::{Ground, Workspace};
use super::homes::{self, TOP};
use super::tree::Tree;
use super::virtual_path::{LinkWeight, VirtualLink, VirtualPath};
use crate::KernelError;

impl Workspace {
    /// Finds what the path touches: kept nodes, their homes, the fronts in order.
    pub(super) fn attach(
        &mut self,
        ground: Ground,
        path: &VirtualPath,
        weight: LinkWeight,
    ) -> Result<(), KernelError> {
        let count = path.unary.len();
        self.is_linked.clear();
        self.is_linked.resize(count, false);
        let counts = |link: &VirtualLink| weight.of(link) > 0.0;
        for link in path.links.iter().filter(|link| counts(link)) {
            self.is_linked[link.node as usize - 1] = true;
        }
        self.chain.reduce(path, &self.is_linked)?;
        self.kept_place.clear();
        self.kept_place.resize(count, NONE);
        for (place, &node) in self.chain.kept.iter().enumerate() {
            self.kept_place[node as usize - 1] = place as u32;
        }

        let tree = ground.tree;
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
        self.parents.clear();
        for &front in &self.touched[..top as usize] {
            let parent = tree.parent(front);
            self.parents.push(if parent == TOP { top } else { self.place[parent as usize] });
        }
        for &front in &self.touched[..top as usize] {
            self.place[front as usize] = NONE;
        }
        Ok(())
    }

    /// Fills `touched` and `place` from the anchors: each anchor's front and all above it, so that the subtree of
    /// each comes in one piece right before it.
    fn order_touched(&mut self, tree: &Tree) {
        self.place.resize(tree.id_bound().max(self.place.len()), NONE);
        self.touched.clear();
        let mut roots: Vec<u32> = Vec::new();
        let mut found: Vec<u32> = Vec::new();
        for &(_, front) in &self.anchors {
            let mut id = front;
            while id != TOP && self.place[id as usize] == NONE {
                self.place[id as usize] = 0;
                found.push(id);
                if tree.parent(id) == TOP {
                    roots.push(id);
                }
                id = tree.parent(id);
            }
        }
        // Parents first, then reversed: a depth-first order without recursion.
        let mut waiting = roots;
        while let Some(id) = waiting.pop() {
            self.touched.push(id);
            waiting.extend(
                tree.front(id).shape.children.iter().filter(|&&child| self.place[child as usize] != NONE),
            );
        }
        self.touched.reverse();
        for (place, &id) in self.touched.iter().enumerate() {
            self.place[id as usize] = place as u32;
        }
        self.touched.push(TOP);
    }
}
