//! Covariances of keyframes.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, Matrix6, Matrix6xX};

use super::assembly::NONE;
use super::dense;
use super::takahashi::FrontCovariance;
use super::tree::Tree;
use crate::Node;

/// Covariance of one node: its 6x6 block of the inverse.
pub(super) fn marginal(tree: &Tree, node: u32) -> Matrix6<f64> {
    joint(tree, &[Node(node)]).fixed_view::<6, 6>(0, 0).into_owned()
}

/// Covariance of these nodes together, in their order. With Lambda = L L^T and E the nodes' unit columns it
/// is Y^T Y for Y = L^-1 E, and Y is zero but on the paths from the nodes' fronts to the roots.
pub(super) fn joint(tree: &Tree, nodes: &[Node]) -> DMatrix<f64> {
    let size = 6 * nodes.len();
    let mut covariance = DMatrix::zeros(size, size);
    let mut values: BTreeMap<u32, Rows> = BTreeMap::new();
    for (place, node) in nodes.iter().enumerate() {
        let rows = values.entry(node.0).or_insert_with(|| Rows::zeros(size));
        rows.fixed_view_mut::<6, 6>(0, 6 * place).fill_with_identity();
    }
    for id in paths_to_roots(tree, nodes) {
        let front = tree.front(id);
        let shape = &front.shape;
        let (rows, frontal) = (shape.rows(), shape.frontal_rows());
        let leading = dense::leading(rows);
        let ids = || shape.frontal.iter().chain(&shape.separator);
        let mut columns = vec![0.0; size * leading];
        for (place, row_id) in ids().enumerate() {
            if let Some(block) = values.remove(row_id) {
                for column in 0..size {
                    let start = column * leading + 6 * place;
                    columns[start..start + 6].copy_from_slice(block.column(column).as_slice());
                }
            }
        }
        for column in columns.chunks_exact_mut(leading) {
            dense::forward(&front.factor, rows, column);
        }
        for row in 0..size {
            for column in 0..=row {
                let one = &columns[row * leading..row * leading + frontal];
                let other = &columns[column * leading..column * leading + frontal];
                covariance[(row, column)] +=
                    one.iter().zip(other).map(|(one, other)| one * other).sum::<f64>();
            }
        }
        for (place, &row_id) in ids().enumerate().skip(shape.frontal.len()) {
            let at = |row, column| columns[column * leading + 6 * place + row];
            values.insert(row_id, Rows::from_fn(size, at));
        }
    }
    covariance.fill_upper_triangle_with_lower_triangle();
    covariance
}

/// A node's rows of the columns that are solved for.
type Rows = Matrix6xX<f64>;

/// The fronts of these nodes and all above them, each before its parent.
fn paths_to_roots(tree: &Tree, nodes: &[Node]) -> Vec<u32> {
    let (mut seen, mut order) = (BTreeSet::new(), Vec::new());
    for node in nodes {
        let mut path = Vec::new();
        let mut id = tree.front_of(node.0);
        while id != NONE && seen.insert(id) {
            path.push(id);
            id = tree.parent(id);
        }
        path.append(&mut order); // what is new ends below what is there already
        order = path;
    }
    order
}

/// Covariances of nodes, by the roots down: each front hands its children what they share with it. With
/// `wanted` (ascending, once each) only the paths from the roots to these nodes are visited. Calls `tell` for
/// each node found, in no order.
pub(super) fn marginals(
    tree: &Tree,
    nodes: usize,
    wanted: Option<&[Node]>,
    mut tell: impl FnMut(u32, Matrix6<f64>),
) {
    let needed = wanted.map(|wanted| above(tree, wanted));
    let is_needed = |id: u32| needed.as_ref().is_none_or(|needed| needed[id as usize]);
    let mut place = vec![NONE; nodes];
    let mut covariance = FrontCovariance::default();
    let mut shared: Vec<u32> = Vec::new();
    let roots = tree.roots().filter(|&root| is_needed(root));
    let mut waiting: Vec<(u32, Vec<f64>)> = roots.map(|root| (root, Vec::new())).collect();
    while let Some((id, separator)) = waiting.pop() {
        let front = tree.front(id);
        let shape = &front.shape;
        covariance.compute(&front.factor, shape.rows(), 0..shape.frontal_rows(), &separator);
        for (at, &node) in shape.frontal.iter().enumerate() {
            tell(node, covariance.own_block(at));
        }
        for (at, &node) in shape.frontal.iter().chain(&shape.separator).enumerate() {
            place[node as usize] = at as u32;
        }
        for &child in shape.children.iter().filter(|&&child| is_needed(child)) {
            shared.clear();
            shared.extend(tree.front(child).shape.separator.iter().map(|&node| place[node as usize]));
            waiting.push((child, covariance.gather(&shared)));
        }
    }
}

/// Marks the fronts of these nodes and everything above them, by id.
fn above(tree: &Tree, nodes: &[Node]) -> Vec<bool> {
    let mut marked = vec![false; tree.id_bound()];
    for node in nodes {
        let mut id = tree.front_of(node.0);
        while id != NONE && !marked[id as usize] {
            marked[id as usize] = true;
            id = tree.parent(id);
        }
    }
    marked
}
