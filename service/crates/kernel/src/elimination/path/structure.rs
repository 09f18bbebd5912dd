//! The symbolic analysis of a path on the tree: the fronts it touches, their order, and where each of its
//! places is eliminated. One structure serves every weight of the links.

use std::ops::Range;

use super::chain::Chain;
use super::front_assignment::{TOP, assign_fronts};
use super::variables::Variables;
use super::virtual_path::VirtualPath;
use crate::KernelError;
use crate::elimination::assembly::NONE;
use crate::elimination::tree::Tree;

/// A path on a tree. Retained places are those that are left after the ones without links are taken out.
#[derive(Debug, Default)]
pub(super) struct PathStructure {
    pub chain: Chain,
    /// Index in `chain.retained` of each place, else `NONE`.
    pub retained_index: Vec<u32>,
    /// The front in which each retained place is eliminated, or `TOP`.
    pub front_of: Vec<u32>,
    /// Touched fronts, children before parents, then `TOP`.
    pub touched: Vec<u32>,
    /// The touched children of each touched front, by place in `touched`: the last one, and of each the one
    /// before it.
    pub last_child: Vec<u32>,
    pub child_before: Vec<u32>,
    /// The rows of each touched front; see `layout`.
    pub rows: Vec<Rows>,
    pub ids: Vec<u32>,
    /// Links, by the front that eliminates their keyframe.
    pub links: Vec<LinkAt>,
    /// Retained places with the place in `touched` of the front that eliminates them, by that.
    pub eliminated: Vec<(u32, u32)>,
    /// Place in `touched` of the front that eliminates the robot.
    pub robot_at: u32,
    /// Unknowns from this one on, but for the terminal node, may be others than those of the path before.
    pub first_unshared: u32,
    is_linked: Vec<bool>,
    /// Retained places and fronts they are tied to.
    anchors: Vec<(u32, u32)>,
    /// Place of each front in `touched`, else `NONE`.
    place: Vec<u32>,
}

/// Where a link is, on the tree and on the path; ordered.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct LinkAt {
    /// Place in `PathStructure::touched` of the front that eliminates its keyframe.
    pub front: u32,
    /// The path's place.
    pub place: u32,
    /// Among the links of that place.
    pub index: u32,
}

/// A touched front's share of the path.
#[derive(Clone, Debug, Default)]
pub(super) struct Rows {
    /// Its block rows in `PathStructure::ids`: eliminated keyframes, eliminated unknowns of the path,
    /// separator, unknowns that pass.
    pub ids: Range<usize>,
    /// How many of them are eliminated in it.
    pub frontal: usize,
    /// Its entries of `PathStructure::links` and `PathStructure::eliminated`.
    pub links: Range<usize>,
    pub eliminated: Range<usize>,
}

impl PathStructure {
    /// Finds what the path touches. `previous` is the path that was analysed before, if results for it are to
    /// serve again.
    pub(super) fn analyse(
        &mut self,
        tree: &Tree,
        nodes: u32,
        path: &VirtualPath,
        previous: Option<&VirtualPath>,
    ) -> Result<(), KernelError> {
        self.forget_touched();
        self.is_linked.clear();
        self.is_linked.extend(path.places.iter().map(|place| !place.links.is_empty()));
        self.chain.reduce(path, &self.is_linked)?;
        self.find_anchors(tree, path);
        assign_fronts(tree, self.chain.retained.len(), &self.anchors, &mut self.front_of);
        self.order_touched(tree);
        self.group_by_front(tree, path);
        self.link_children(tree);
        let variables = self.variables(nodes);
        let shared = previous.map_or(0, |previous| path.shared_places(previous));
        let shared_retained = self.chain.retained.partition_point(|&place| place <= shared);
        self.first_unshared = variables.sum(shared_retained as u32);
        self.lay_out(tree, variables);
        Ok(())
    }

    /// The path's unknowns over so many keyframes.
    pub(super) fn variables(&self, nodes: u32) -> Variables {
        Variables { base: nodes, retained: self.front_of.len() as u32 }
    }

    /// The unknown that registrations at a place are with.
    pub(super) fn linked(&self, variables: Variables, place: u32) -> u32 {
        match self.retained_index[place as usize] {
            NONE => variables.terminal(),
            retained => variables.sum(retained),
        }
    }

    /// Touched children of a touched front, as places in `touched`, in a fixed order.
    pub(super) fn children(&self, index: usize) -> impl Iterator<Item = usize> + '_ {
        let mut next = self.last_child[index];
        std::iter::from_fn(move || {
            let child = (next != NONE).then_some(next as usize)?;
            next = self.child_before[child];
            Some(child)
        })
    }

    /// Whether the path touches a front of the tree.
    pub(super) fn touches(&self, front: u32) -> bool {
        self.place[front as usize] != NONE
    }

    /// Fills `retained_index` and `anchors`: the robot's front, and that of each linked keyframe.
    fn find_anchors(&mut self, tree: &Tree, path: &VirtualPath) {
        self.retained_index.clear();
        self.retained_index.resize(path.places.len(), NONE);
        for (index, &place) in self.chain.retained.iter().enumerate() {
            self.retained_index[place as usize] = index as u32;
        }
        self.anchors.clear();
        self.anchors.push((0, tree.front_of(path.robot.0)));
        for (place, link) in path.links() {
            self.anchors.push((self.retained_index[place as usize], tree.front_of(link.keyframe.0)));
        }
    }

    /// Fills `links`, `eliminated` and `robot_at`.
    fn group_by_front(&mut self, tree: &Tree, path: &VirtualPath) {
        let place = &self.place;
        self.links.clear();
        for (number, virtual_place) in (0..).zip(&path.places) {
            for (index, link) in (0..).zip(&virtual_place.links) {
                let front = place[tree.front_of(link.keyframe.0) as usize];
                self.links.push(LinkAt { front, place: number, index });
            }
        }
        self.links.sort_unstable();
        let top = self.touched.len() as u32 - 1;
        self.eliminated.clear();
        for (retained, &front) in self.front_of.iter().enumerate() {
            let at = if front == TOP { top } else { place[front as usize] };
            self.eliminated.push((at, retained as u32));
        }
        self.eliminated.sort_unstable();
        self.robot_at = place[tree.front_of(path.robot.0) as usize];
    }

    fn link_children(&mut self, tree: &Tree) {
        self.last_child.clear();
        self.last_child.resize(self.touched.len(), NONE);
        self.child_before.clear();
        self.child_before.resize(self.touched.len(), NONE);
        let top = self.touched.len() - 1;
        for (index, &front) in self.touched[..top].iter().enumerate() {
            let parent = match tree.parent(front) {
                TOP => top,
                parent => self.place[parent as usize] as usize,
            };
            self.child_before[index] = std::mem::replace(&mut self.last_child[parent], index as u32);
        }
    }

    fn forget_touched(&mut self) {
        for front in self.touched.drain(..).filter(|&front| front != TOP) {
            self.place[front as usize] = NONE;
        }
    }

    /// Fills `touched` and `place` from the anchors: each anchor's front and all above it, so that the
    /// subtree of each comes in one piece right before it.
    fn order_touched(&mut self, tree: &Tree) {
        self.place.resize(tree.id_bound().max(self.place.len()), NONE);
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
}
