//! The tree of fronts: which parts stay and which are eliminated anew.

use std::cmp::Reverse;
use std::sync::Arc;

use super::assembly::{Assembly, NONE};
use super::front::Front;
use super::system::BlockSystem;
use crate::{KernelError, SharedVec};

/// All fronts. A front's id stays while the front does; ids of removed fronts are used again.
///
/// Every front below a front is eliminated before it. Copies share the fronts.
#[derive(Clone, Debug, Default)]
pub(super) struct Tree {
    pub(super) fronts: SharedVec<Option<Arc<Front>>>,
    pub(super) parents: Vec<u32>,
    pub(super) unused: Vec<u32>,
    /// The front that eliminates each node.
    pub(super) front_of: Vec<u32>,
    /// Operations of eliminating every front once.
    pub(super) flops: f64,
}

/// Scratch of restructuring: local indices of nodes, marks of fronts.
#[derive(Debug, Default)]
pub(super) struct TreeScratch {
    pub(super) local: Vec<u32>,
    marked: Vec<bool>,
    pub assembly: Assembly,
}

impl Tree {
    pub(super) fn front(&self, id: u32) -> &Front {
        self.fronts[id as usize].as_ref().expect("ids in use have a front")
    }

    /// The front above, or `NONE`.
    pub(super) fn parent(&self, id: u32) -> u32 {
        self.parents[id as usize]
    }

    /// The front that eliminates a node, or `NONE` if the node is not in the tree yet.
    pub(super) fn front_of(&self, node: u32) -> u32 {
        self.front_of.get(node as usize).copied().unwrap_or(NONE)
    }

    /// Number of nodes that are eliminated somewhere in the tree.
    pub(super) fn nodes(&self) -> usize {
        self.front_of.len()
    }

    /// Ids go up to this number, exclusive.
    pub(super) fn id_bound(&self) -> usize {
        self.fronts.len()
    }

    /// Ids in use, ascending.
    pub(super) fn ids(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.fronts.len() as u32).filter(|&id| self.fronts[id as usize].is_some())
    }

    /// Fronts without a parent, ascending.
    pub(super) fn roots(&self) -> impl Iterator<Item = u32> + '_ {
        self.ids().filter(|&id| self.parent(id) == NONE)
    }

    pub(super) fn flops(&self) -> f64 {
        self.flops
    }

    /// Ids not in use, the one that is used next last.
    pub(super) fn unused(&self) -> &[u32] {
        &self.unused
    }

    /// A tree of its parts, which must fit one another.
    pub(super) fn of(
        fronts: SharedVec<Option<Arc<Front>>>,
        parents: Vec<u32>,
        unused: Vec<u32>,
        front_of: Vec<u32>,
        flops: f64,
    ) -> Tree {
        Tree { fronts, parents, unused, front_of, flops }
    }

    /// Eliminates again, in their shapes, the fronts of these nodes and everything above them. For changed
    /// numbers without new pairs of nodes. After an error the tree must not be used. Returns the fronts,
    /// parents before children.
    pub(super) fn refresh(
        &mut self,
        system: &BlockSystem,
        touched: &[u32],
        scratch: &mut TreeScratch,
    ) -> Result<Vec<u32>, KernelError> {
        let mut ids = self.upward(touched, scratch);
        ids.reverse();
        for &id in &ids {
            let place = &mut self.fronts[id as usize];
            let mut front = place.take().expect("ids in use have a front");
            if Arc::get_mut(&mut front).is_none() {
                front = Arc::new(Front::new(front.shape.clone())); // a copy of the tree holds the old numbers
            }
            let shape = front.shape.clone();
            let below = shape.children.iter().map(|&child| self.front(child));
            let own = Arc::get_mut(&mut front).expect("nobody else holds it");
            let eliminated = own.eliminate(system, below, &mut scratch.assembly);
            self.fronts[id as usize] = Some(front);
            eliminated?;
        }
        ids.reverse();
        Ok(ids)
    }

    /// Orders and eliminates everything anew. What there was goes first, so that memory never holds two
    /// trees; after an error there is none.
    pub(super) fn rebuild(
        &mut self,
        system: &BlockSystem,
        scratch: &mut TreeScratch,
    ) -> Result<Vec<u32>, KernelError> {
        *self = Tree::default();
        self.restructure(system, &[], scratch)
    }

    /// The fronts of these nodes and everything above them, each once, parents before children.
    pub(super) fn upward(&self, nodes: &[u32], scratch: &mut TreeScratch) -> Vec<u32> {
        scratch.marked.resize(self.fronts.len(), false);
        let mut found = Vec::new();
        for &node in nodes {
            let mut id = self.front_of(node);
            while id != NONE && !scratch.marked[id as usize] {
                scratch.marked[id as usize] = true;
                found.push(id);
                id = self.parent(id);
            }
        }
        for &id in &found {
            scratch.marked[id as usize] = false;
        }
        found.sort_unstable_by_key(|&id| Reverse((self.front(id).shape.level, id)));
        found
    }
}
