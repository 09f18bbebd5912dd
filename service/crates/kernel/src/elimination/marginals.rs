//! Covariances of keyframes.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{Matrix6, Vector6};

use super::assembly::NONE;
use super::dense;
use super::takahashi::FrontCovariance;
use super::tree::Tree;
use crate::Node;

/// Covariance of one node: its 6x6 block of the inverse.
pub(super) fn marginal(tree: &Tree, node: u32) -> Matrix6<f64> {
    combined(tree, &[(Node(node), Matrix6::identity())])
}

/// Covariance of the sum of J_k delta_k. With Lambda = L L^T and B the columns that hold each J_k^T in the rows of its
/// node it is Y^T Y for Y = L^-1 B, and Y is zero but on the ways from the nodes' fronts to the roots.
pub(super) fn combined(tree: &Tree, terms: &[(Node, Matrix6<f64>)]) -> Matrix6<f64> {
    let mut covariance = Matrix6::zeros();
    let mut values: BTreeMap<u32, Matrix6<f64>> = BTreeMap::new();
    for (node, jacobian) in terms {
        *values.entry(node.0).or_insert_with(Matrix6::zeros) += jacobian.transpose();
    }
    for id in ways(tree, terms) {
        let front = tree.front(id);
        let shape = &front.shape;
        let (rows, frontal) = (shape.rows(), shape.frontal_rows());
        let leading = dense::leading(rows);
        let ids = || shape.frontal.iter().chain(&shape.separator);
        let mut columns = vec![0.0; 6 * leading];
        for (place, row_id) in ids().enumerate() {
            if let Some(block) = values.remove(row_id) {
                for column in 0..6 {
                    let start = column * leading + 6 * place;
                    columns[start..start + 6].copy_from_slice(block.column(column).as_slice());
                }
            }
        }
        for column in columns.chunks_exact_mut(leading) {
            dense::forward(&front.factor, rows, column);
        }
        for row in 0..6 {
            for column in 0..=row {
                let one = &columns[row * leading..row * leading + frontal];
                let other = &columns[column * leading..column * leading + frontal];
                covariance[(row, column)] +=
                    one.iter().zip(other).map(|(one, other)| one * other).sum::<f64>();
            }
        }
        for (place, &row_id) in ids().enumerate().skip(shape.frontal.len()) {
            let block = Matrix6::from_columns(&std::array::from_fn::<_, 6, _>(|column| {
                let start = column * leading + 6 * place;
                Vector6::from_column_slice(&columns[start..start + 6])
            }));
            values.insert(row_id, block);
        }
    }
    covariance.fill_upper_triangle_with_lower_triangle();
    covariance
}

/// The fronts of these nodes and all above them, each before its parent.
fn ways(tree: &Tree, terms: &[(Node, Matrix6<f64>)]) -> Vec<u32> {
    let (mut seen, mut order) = (BTreeSet::new(), Vec::new());
    for (node, _) in terms {
        let mut way = Vec::new();
        let mut id = tree.front_of(node.0);
        while id != NONE && seen.insert(id) {
            way.push(id);
            id = tree.parent(id);
        }
        way.append(&mut order); // what is new ends below what is there already
        order = way;
    }
    order
}

/// Covariances of nodes, by the roots down: each front hands its children what they share with it. With `wanted`
/// (ascending, once each) only the ways from the roots to these nodes are gone. Calls `tell` for each node found, in no
/// order.
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
