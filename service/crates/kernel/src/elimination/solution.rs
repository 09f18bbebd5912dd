//! Back-substitution that visits only the fronts whose answer changes.

use nalgebra::Vector6;

use super::dense;
use super::tree::Tree;

/// The solution of Lambda x = b, kept from elimination to elimination.
#[derive(Clone, Debug, Default)]
pub(crate) struct Solution {
    values: Vec<Vector6<f64>>,
    /// For each front, at least how far its separator's values have moved since it was visited.
    unpropagated: Vec<f64>,
    /// Scratch: how far each node moved in this pass.
    moved: Vec<f64>,
    column: Vec<f64>,
}

impl Solution {
    /// The values and, for each front, what has not been propagated to it.
    pub(crate) fn parts(&self) -> (&[Vector6<f64>], &[f64]) {
        (&self.values, &self.unpropagated)
    }

    /// A solution of these parts.
    pub(crate) fn of(values: Vec<Vector6<f64>>, unpropagated: Vec<f64>) -> Solution {
        let moved = vec![0.0; values.len()];
        Solution { values, unpropagated, moved, column: Vec::new() }
    }

    pub(crate) fn value(&self, node: u32) -> &Vector6<f64> {
        &self.values[node as usize]
    }

    /// Appends a node whose value is zero until it is solved for.
    pub(crate) fn add_node(&mut self) {
        self.values.push(Vector6::zeros());
        self.moved.push(0.0);
    }

    /// Sets a value to zero: its linearisation point has moved to where the value pointed.
    pub(crate) fn reset(&mut self, node: u32) {
        self.values[node as usize] = Vector6::zeros();
    }

    /// Whether a movement of more than `prune` has not been propagated to a front.
    pub(super) fn has_unpropagated(&self, prune: f64) -> bool {
        self.unpropagated.iter().any(|&unpropagated| unpropagated > prune)
    }

    /// Before these fronts (parents before children) are dissolved or eliminated again: what moved above them
    /// and was not propagated is left to their children, which may hang elsewhere afterwards.
    pub(super) fn push_down(&mut self, tree: &Tree, fronts: &[u32]) {
        self.unpropagated.resize(tree.id_bound(), 0.0);
        for &id in fronts {
            let unpropagated = std::mem::take(&mut self.unpropagated[id as usize]);
            for &child in &tree.front(id).shape.children {
                self.unpropagated[child as usize] += unpropagated;
            }
        }
    }

    /// Solves after an elimination of these fronts (parents before children), and below them wherever a
    /// separator has moved by more than `prune` in all since the front below it was last visited. Returns the
    /// nodes visited. Cost: the fronts visited and their children.
    pub(super) fn update(&mut self, tree: &Tree, eliminated: &[u32], prune: f64) -> Vec<u32> {
        self.unpropagated.resize(tree.id_bound(), 0.0);
        for &id in eliminated {
            self.unpropagated[id as usize] = f64::INFINITY;
        }
        let mut visited: Vec<u32> = Vec::new();
        let mut below: Vec<(u32, f64)> = Vec::new();
        for &id in eliminated {
            self.visit(tree, id, 0.0, prune, &mut visited, &mut below);
        }
        while let Some((id, earlier)) = below.pop() {
            self.visit(tree, id, earlier, prune, &mut visited, &mut below);
        }
        for &node in &visited {
            self.moved[node as usize] = 0.0;
        }
        visited
    }

    /// `earlier` bounds how far the separator's values moved in passes that did not come here: it has not
    /// been propagated to the fronts below.
    fn visit(
        &mut self,
        tree: &Tree,
        id: u32,
        earlier: f64,
        prune: f64,
        visited: &mut Vec<u32>,
        below: &mut Vec<(u32, f64)>,
    ) {
        let front = tree.front(id);
        let shape = &front.shape;
        let frontal_rows = shape.frontal_rows();
        self.column.clear();
        self.column.resize(frontal_rows, 0.0);
        for &node in &shape.separator {
            self.column.extend_from_slice(self.values[node as usize].as_slice());
        }
        self.column.resize(dense::leading(shape.rows()), 0.0);
        dense::backward(&front.factor, shape.rows(), &front.right[..frontal_rows], &mut self.column);
        for (&node, values) in shape.frontal.iter().zip(self.column.chunks_exact(6)) {
            let value = Vector6::from_column_slice(values);
            self.moved[node as usize] = (value - self.values[node as usize]).amax();
            self.values[node as usize] = value;
        }
        visited.extend_from_slice(&shape.frontal);

        self.unpropagated[id as usize] = 0.0;
        for &child in &shape.children {
            let unpropagated = &mut self.unpropagated[child as usize];
            if unpropagated.is_infinite() {
                continue; // it was eliminated: its turn comes anyhow
            }
            // What moved in this pass is known exactly, since all above was visited if it moved enough to
            // matter.
            let separator = &tree.front(child).shape.separator;
            let now = separator.iter().map(|&node| self.moved[node as usize]).fold(0.0, f64::max);
            let before = *unpropagated + earlier;
            *unpropagated = before + now;
            if *unpropagated > prune {
                below.push((child, before));
            }
        }
    }
}
