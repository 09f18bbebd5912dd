//! New nodes and pairs come into the tree: its top is dissolved, ordered anew together with them, and
//! eliminated, as in iSAM2 \[ISAM2\]; the subtrees below stay as they are.

use std::sync::Arc;

use super::assembly::{Assembly, NONE};
use super::front::{Front, Shape};
use super::order::{Graph, nested_dissection};
use super::symbolic::{self, Part, SymbolicFront};
use super::system::BlockSystem;
use super::tree::{Tree, TreeScratch};
use crate::KernelError;

/// Beyond this share of the nodes it costs little more to order and eliminate all of them, and the tree is
/// better.
const MOST_DISSOLVED: f64 = 0.5;

/// What is taken out of the tree.
struct Dissolved {
    /// Ids of the fronts, ascending.
    fronts: Vec<u32>,
    /// Their nodes and the new ones, ascending: what is ordered anew.
    nodes: Vec<u32>,
    /// Fronts of subtrees that stay, and hang below the dissolved ones.
    orphans: Vec<u32>,
}

/// Ids for new fronts, and what is left then.
struct Ids {
    /// By new front.
    new: Vec<u32>,
    unused: Vec<u32>,
    /// Ids go up to this number, exclusive.
    bound: u32,
}

impl Tree {
    /// Takes in new nodes and pairs: the fronts of the touched nodes and everything above them are dissolved,
    /// their nodes ordered anew together with the new ones, the highest node last, and eliminated; the
    /// subtrees below stay as they are. If more than `MOST_DISSOLVED` of all nodes are concerned, everything
    /// is ordered anew. Nothing changes on an error. Returns the new fronts, parents before children.
    pub(super) fn restructure(
        &mut self,
        system: &BlockSystem,
        touched: &[u32],
        scratch: &mut TreeScratch,
    ) -> Result<Vec<u32>, KernelError> {
        let dissolved = self.dissolve(system, touched, scratch);
        let symbolic = self.plan(system, &dissolved, &mut scratch.local);
        let ids = self.allot(&dissolved, symbolic.len());
        let fronts = self.eliminate_new(system, &dissolved, &symbolic, &ids.new, &mut scratch.assembly)?;
        Ok(self.replace(&dissolved, fronts, ids, system.len()))
    }

    /// Step 1: which fronts go, which nodes they set free, which subtrees stay.
    fn dissolve(&self, system: &BlockSystem, touched: &[u32], scratch: &mut TreeScratch) -> Dissolved {
        let mut fronts = self.upward(touched, scratch);
        fronts.sort_unstable();
        let dissolved_nodes: usize = fronts.iter().map(|&id| self.front(id).shape.frontal.len()).sum();
        if dissolved_nodes as f64 > MOST_DISSOLVED * self.front_of.len() as f64 {
            fronts = self.ids().collect();
        }
        let mut nodes: Vec<u32> = (self.front_of.len() as u32..system.len() as u32).collect();
        let mut orphans: Vec<u32> = Vec::new();
        for &id in &fronts {
            let shape = &self.front(id).shape;
            nodes.extend(&shape.frontal);
            orphans.extend(shape.children.iter().filter(|child| fronts.binary_search(child).is_err()));
        }
        nodes.sort_unstable();
        Dissolved { fronts, nodes, orphans }
    }

    /// Step 2: orders the nodes, given the subtrees that hang below them, and groups them into fronts.
    /// `local` is all `NONE` before and after.
    fn plan(
        &self,
        system: &BlockSystem,
        Dissolved { nodes, orphans, .. }: &Dissolved,
        local: &mut Vec<u32>,
    ) -> Vec<SymbolicFront> {
        local.resize(system.len(), NONE);
        for (index, &node) in nodes.iter().enumerate() {
            local[node as usize] = index as u32;
        }
        let mut offsets = vec![0];
        let mut targets = Vec::new();
        for &node in nodes {
            let inside = system.neighbours(node).iter().map(|neighbour| local[neighbour.node as usize]);
            targets.extend(inside.filter(|&index| index != NONE));
            offsets.push(targets.len() as u32);
        }
        let separators: Vec<Vec<u32>> = orphans
            .iter()
            .map(|&id| self.front(id).shape.separator.iter().map(|&node| local[node as usize]).collect())
            .collect();
        for &node in nodes {
            local[node as usize] = NONE;
        }
        let last = (nodes.last() == Some(&(system.len() as u32 - 1))).then(|| nodes.len() as u32 - 1);
        let order = if separators.is_empty() {
            nested_dissection(&Graph::unweighted(offsets.clone(), targets.clone()), last)
        } else {
            nested_dissection(&with_cliques(&offsets, &targets, &separators), last)
        };
        symbolic::analyse(&Part { order: &order, offsets: &offsets, targets: &targets, orphans: &separators })
    }

    /// Step 3: ids for so many new fronts: first those of the dissolved ones, then unused ones, then new
    /// ones.
    fn allot(&self, dissolved: &Dissolved, count: usize) -> Ids {
        let mut new: Vec<u32> = dissolved.fronts.clone();
        let mut unused = self.unused.clone();
        let mut bound = self.fronts.len() as u32;
        while new.len() < count {
            new.push(unused.pop().unwrap_or_else(|| {
                bound += 1;
                bound - 1
            }));
        }
        let spare = new.split_off(count);
        unused.extend(spare.iter().rev());
        Ids { new, unused, bound }
    }

    /// Step 4: the new fronts, eliminated, children before parents. The tree is as it was.
    fn eliminate_new(
        &self,
        system: &BlockSystem,
        Dissolved { nodes, orphans, .. }: &Dissolved,
        symbolic: &[SymbolicFront],
        ids: &[u32],
        assembly: &mut Assembly,
    ) -> Result<Vec<Front>, KernelError> {
        let mut fronts: Vec<Front> = Vec::with_capacity(symbolic.len());
        for front in symbolic {
            let new_below = front.children.iter().map(|&child| &fronts[child as usize]);
            let old_below = front.orphans.iter().map(|&orphan| self.front(orphans[orphan as usize]));
            let below = new_below.chain(old_below);
            let new_ids = front.children.iter().map(|&child| ids[child as usize]);
            let old_ids = front.orphans.iter().map(|&orphan| orphans[orphan as usize]);
            let shape = Arc::new(Shape {
                frontal: front.frontal.iter().map(|&local| nodes[local as usize]).collect(),
                separator: front.separator.iter().map(|&local| nodes[local as usize]).collect(),
                children: new_ids.chain(old_ids).collect(),
                level: below.clone().map(|child| child.shape.level + 1).max().unwrap_or(0),
            });
            let mut front = Front::new(shape);
            front.eliminate(system, below, assembly)?;
            fronts.push(front);
        }
        Ok(fronts)
    }

    /// Step 5: puts the new fronts into the tree instead of the dissolved ones. Returns them, parents before
    /// children.
    fn replace(&mut self, dissolved: &Dissolved, fronts: Vec<Front>, ids: Ids, nodes: usize) -> Vec<u32> {
        for &id in &dissolved.fronts {
            self.flops -= self.front(id).shape.flops();
            self.fronts[id as usize] = None;
        }
        let Ids { mut new, unused, bound } = ids;
        self.fronts.extend_to(bound as usize, &None);
        self.parents.resize(bound as usize, NONE);
        self.front_of.resize(nodes, NONE);
        self.unused = unused;
        for (front, &id) in fronts.into_iter().zip(&new) {
            self.parents[id as usize] = NONE;
            for &child in &front.shape.children {
                self.parents[child as usize] = id;
            }
            for &node in &front.shape.frontal {
                self.front_of[node as usize] = id;
            }
            self.flops += front.shape.flops();
            self.fronts[id as usize] = Some(Arc::new(front));
        }
        new.reverse();
        new
    }
}

/// The graph in which each orphan's separator is a clique, as its elimination has left it.
fn with_cliques(offsets: &[u32], targets: &[u32], separators: &[Vec<u32>]) -> Graph {
    let count = offsets.len() - 1;
    let mut holders: Vec<Vec<u32>> = vec![Vec::new(); count];
    for (index, separator) in separators.iter().enumerate() {
        for &vertex in separator {
            holders[vertex as usize].push(index as u32);
        }
    }
    let mut seen = vec![NONE; count];
    let mut all_offsets = vec![0];
    let mut all_targets = Vec::new();
    for vertex in 0..count as u32 {
        seen[vertex as usize] = vertex;
        let own = &targets[offsets[vertex as usize] as usize..offsets[vertex as usize + 1] as usize];
        let filled = holders[vertex as usize].iter().flat_map(|&index| &separators[index as usize]);
        for &other in own.iter().chain(filled) {
            if seen[other as usize] != vertex {
                seen[other as usize] = vertex;
                all_targets.push(other);
            }
        }
        all_offsets.push(all_targets.len() as u32);
    }
    Graph::unweighted(all_offsets, all_targets)
}
