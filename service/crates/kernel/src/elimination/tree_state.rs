//! A tree without its numbers, which follow from it and the system.

use std::sync::Arc;

use super::assembly::NONE;
use super::front::{Front, Shape};
use super::system::BlockSystem;
use super::tree::{Tree, TreeScratch};
use crate::{KernelError, SharedVec};

/// Which nodes are eliminated where, and when everything was last ordered.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TreeState {
    /// By id; none for ids that are not in use.
    pub fronts: Vec<Option<FrontState>>,
    /// Ids that are not in use, in the order in which they were given up.
    pub unused: Vec<u32>,
    /// Operations of eliminating every front once, as summed up to now.
    pub flops: f64,
    /// The tree when everything was last ordered at once.
    pub ordered: Ordered,
}

/// A tree's size when all of it had just been ordered, by which it is judged later.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ordered {
    /// Keyframes.
    pub nodes: u64,
    /// Operations of eliminating every front once.
    pub flops: f64,
    /// Fronts on the longest path from a leaf to a root.
    pub height: u32,
}

/// A front without its numbers.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrontState {
    /// Nodes eliminated here, in elimination order.
    pub frontal: Vec<u32>,
    /// Nodes eliminated later that these are joined to, in order.
    pub separator: Vec<u32>,
    /// Ids of the fronts directly below, in order.
    pub children: Vec<u32>,
}

impl Tree {
    /// The fronts, the ids not in use, and the operations.
    pub(super) fn state(&self, ordered: Ordered) -> TreeState {
        let front = |id: u32| {
            let Shape { frontal, separator, children, .. } = &*self.front(id).shape;
            FrontState { frontal: frontal.clone(), separator: separator.clone(), children: children.clone() }
        };
        let mut fronts = vec![None; self.id_bound()];
        self.ids().for_each(|id| fronts[id as usize] = Some(front(id)));
        TreeState { fronts, unused: self.unused().to_vec(), flops: self.flops(), ordered }
    }

    /// The tree of this state over a system, eliminated. Cost: one elimination, without ordering.
    ///
    /// Errors: [`KernelError::OtherGraph`] for a state that is not one of a tree over so many nodes.
    pub(super) fn restore(
        state: &TreeState,
        system: &BlockSystem,
        scratch: &mut TreeScratch,
    ) -> Result<Tree, KernelError> {
        let (parents, front_of) = check(state, system.len())?;
        let mut fronts: SharedVec<Option<Arc<Front>>> = SharedVec::default();
        fronts.extend_to(state.fronts.len(), &None);
        for id in upward(state, &parents)? {
            let FrontState { frontal, separator, children } =
                state.fronts[id as usize].clone().unwrap_or_default();
            let below = |id: &u32| fronts[*id as usize].as_deref().expect("children come first");
            let level = children.iter().map(|id| below(id).shape.level + 1).max().unwrap_or(0);
            let shape = Shape { frontal, separator, children, level };
            let mut front = Front::new(Arc::new(shape));
            let shape = front.shape.clone();
            front.eliminate(system, shape.children.iter().map(below), &mut scratch.assembly)?;
            fronts[id as usize] = Some(Arc::new(front));
        }
        Ok(Tree::of(fronts, parents, state.unused.clone(), front_of, state.flops))
    }
}

/// The front above each front and the front of each node, if the state is that of a tree.
fn check(state: &TreeState, nodes: usize) -> Result<(Vec<u32>, Vec<u32>), KernelError> {
    let other = |problem| KernelError::OtherGraph { problem };
    let mut parents = vec![NONE; state.fronts.len()];
    let mut front_of = vec![NONE; nodes];
    let in_use = || state.fronts.iter().zip(0_u32..).filter_map(|(front, id)| Some((front.as_ref()?, id)));
    let is_used = |id: u32| state.fronts.get(id as usize).is_some_and(Option::is_some);
    for (front, id) in in_use() {
        for &node in &front.frontal {
            match front_of.get_mut(node as usize) {
                Some(place) if *place == NONE => *place = id,
                _ => return Err(other("a node is unknown or eliminated twice")),
            }
        }
        for &child in &front.children {
            if !is_used(child) || std::mem::replace(&mut parents[child as usize], id) != NONE {
                return Err(other("a front is unknown or hangs below two others"));
            }
        }
    }
    if front_of.contains(&NONE) {
        return Err(other("a node is eliminated nowhere"));
    }
    let is_unused = |&id: &u32| (id as usize) < state.fronts.len() && !is_used(id);
    if !state.unused.iter().all(is_unused) || state.unused.len() + in_use().count() != state.fronts.len() {
        return Err(other("the ids not in use are others"));
    }
    for (front, id) in in_use() {
        let above = parents[id as usize];
        let rows = |id: u32| state.fronts.get(id as usize).and_then(Option::as_ref);
        let has_row = |node: &u32| {
            rows(above).is_some_and(|rows| rows.frontal.contains(node) || rows.separator.contains(node))
        };
        if !front.separator.iter().all(has_row) {
            return Err(other("a front is joined to nodes that the one above does not have"));
        }
    }
    Ok((parents, front_of))
}

/// All fronts, children before parents.
fn upward(state: &TreeState, parents: &[u32]) -> Result<Vec<u32>, KernelError> {
    let is_root = |&id: &u32| state.fronts[id as usize].is_some() && parents[id as usize] == NONE;
    let mut order: Vec<u32> = (0..state.fronts.len() as u32).filter(is_root).collect();
    let mut next = 0;
    while let Some(&id) = order.get(next) {
        order.extend(state.fronts[id as usize].iter().flat_map(|front| &front.children));
        next += 1;
    }
    order.reverse();
    if order.len() != state.fronts.iter().flatten().count() {
        return Err(KernelError::OtherGraph { problem: "fronts hang below each other in a ring" });
    }
    Ok(order)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Matrix6, Vector6};

    fn chain(nodes: usize) -> BlockSystem {
        let mut system = BlockSystem::new();
        let nodes: Vec<_> = (0..nodes).map(|_| system.add_node()).collect();
        for pair in nodes.windows(2) {
            system.add_cross(pair[0], pair[1], &-Matrix6::identity());
        }
        for &node in &nodes {
            system.add_diagonal(node, &(Matrix6::identity() * 3.0), &Vector6::repeat(1.0));
        }
        system
    }

    #[test]
    fn a_state_of_another_graph_is_refused() {
        let system = chain(40);
        let mut tree = Tree::default();
        tree.rebuild(&system, &mut TreeScratch::default()).expect("it is positive definite");
        let ordered = Ordered { nodes: 40, flops: 1.0, height: 3 };
        let state = tree.state(ordered);
        let restored = |state: &TreeState| Tree::restore(state, &system, &mut TreeScratch::default());
        assert_eq!(restored(&state).expect("its own").state(ordered), state);

        type Break = fn(&mut TreeState);
        let breaks: [Break; 7] = [
            |state| state.fronts.push(None),
            |state| state.fronts.truncate(1),
            |state| state.fronts.iter_mut().flatten().take(1).for_each(|front| front.frontal[0] = 99),
            |state| state.fronts.iter_mut().flatten().take(1).for_each(|front| front.children.push(0)),
            |state| state.fronts.iter_mut().flatten().for_each(|front| front.separator.push(0)),
            |state| state.fronts.iter_mut().flatten().for_each(|front| front.children.clear()),
            |state| state.unused.push(0),
        ];
        for (index, change) in breaks.into_iter().enumerate() {
            let mut other = state.clone();
            change(&mut other);
            let refused = restored(&other).map(|tree| tree.flops());
            assert!(matches!(refused, Err(KernelError::OtherGraph { .. })), "{index}: {refused:?}");
        }
    }
}
