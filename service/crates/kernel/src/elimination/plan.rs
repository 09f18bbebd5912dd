//! From the nodes of dissolved fronts to the fronts that replace them.

use super::assembly::NONE;
use super::order::{Graph, nested_dissection};
use super::symbolic::{self, Part, SymbolicFront};
use super::system::BlockSystem;
use super::tree::Tree;

impl Tree {
    /// Orders these nodes, given the subtrees that hang below them, and groups them into fronts.
    /// `local` is all `NONE` before and after.
    pub(super) fn plan(
        &self,
        system: &BlockSystem,
        nodes: &[u32],
        orphans: &[u32],
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
