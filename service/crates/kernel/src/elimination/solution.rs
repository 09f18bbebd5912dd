//! Back-substitution that visits only the fronts whose answer changes.

use nalgebra::Vector6;

use super::dense;
use super::tree::Tree;

/// The solution of Lambda x = b, kept from elimination to elimination.
#[derive(Clone, Debug, Default)]
pub(crate) struct Solution {
    values: Vec<Vector6<f64>>,
    /// For each front, at least how far its separator's values have moved since it was visited.
    unseen: Vec<f64>,
    /// Scratch: how far each node moved in this pass.
    moved: Vec<f64>,
    column: Vec<f64>,
}

impl Solution {
    pub(crate) fn value(&self, node: u32) -> &Vector6<f64> {
        &self.values[node as usize]
    }

    /// Appends a node whose value is zero until it is solved for.
    pub(crate) fn add_node(&mut self) {
        self.values.push(Vector6::zeros());
        self.moved.push(0.0);
    }

    /// Sets a value to zero: its linearisation point has moved to where the value pointed.
    pub(crate) fn absorb(&mut self, node: u32) {
        self.values[node as usize] = Vector6::zeros();
    }

    /// Solves after an elimination of these fronts (parents before children), and below them wherever a
    /// separator has moved by more than `prune` in all since the front below it was last visited. Returns the nodes
    /// visited. Cost: the fronts visited and their children.
    pub(super) fn update(&mut self, tree: &Tree, eliminated: &[u32], prune: f64) -> Vec<u32> {
        self.unseen.resize(tree.id_bound(), 0.0);
        for &id in eliminated {
            self.unseen[id as usize] = f64::INFINITY;
        }
        let mut visited: Vec<u32> = Vec::new();
        let mut below: Vec<u32> = Vec::new();
        for &id in eliminated {
            self.visit(tree, id, prune, &mut visited, &mut below);
        }
        while let Some(id) = below.pop() {
            self.visit(tree, id, prune, &mut visited, &mut below);
        }
        for &node in &visited {
            self.moved[node as usize] = 0.0;
        }
        visited
    }

    fn visit(&mut self, tree: &Tree, id: u32, prune: f64, visited: &mut Vec<u32>, below: &mut Vec<u32>) {
        let front = tree.front(id);
        let shape = &front.shape;
        let frontal_rows = shape.frontal_rows();
        self.column.clear();
        self.column.extend_from_slice(&front.right[..frontal_rows]);
        for &node in &shape.separator {
            self.column.extend_from_slice(self.values[node as usize].as_slice());
        }
        dense::backward(&front.factor, shape.rows(), frontal_rows, &mut self.column);
        for (&node, values) in shape.frontal.iter().zip(self.column.chunks_exact(6)) {
            let value = Vector6::from_column_slice(values);
            self.moved[node as usize] = (value - self.values[node as usize]).amax();
            self.values[node as usize] = value;
        }
        visited.extend_from_slice(&shape.frontal);

        // A front whose separator is not visited in this pass knows only a bound on its movement.
        let above = if self.unseen[id as usize].is_finite() {
            self.unseen[id as usize]
        } else {
            shape.separator.iter().map(|&node| self.moved[node as usize]).fold(0.0, f64::max)
        };
        self.unseen[id as usize] = 0.0;
        for &child in &shape.children {
            let unseen = &mut self.unseen[child as usize];
            if unseen.is_infinite() {
                continue; // it was eliminated: its turn comes anyhow
            }
            let separator = &tree.front(child).shape.separator;
            let here = separator.iter().map(|&node| self.moved[node as usize]).fold(0.0, f64::max);
            *unseen += here.max(above);
            if *unseen > prune {
                below.push(child);
            }
        }
    }
}
