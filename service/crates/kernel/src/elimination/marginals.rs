//! Covariances of keyframes.

use std::collections::BTreeMap;

use nalgebra::{Matrix6, Vector6};

use super::assembly::NONE;
use super::tree::Tree;
use super::{dense, takahashi};

/// Covariance of one node. With Lambda = L L^T and E the node's six unit columns it is Y^T Y for Y = L^-1 E, and Y
/// is zero but on the way from the node's front to its root.
pub(super) fn marginal(tree: &Tree, node: u32) -> Matrix6<f64> {
    let mut covariance = Matrix6::zeros();
    let mut values: BTreeMap<u32, Matrix6<f64>> = BTreeMap::from([(node, Matrix6::identity())]);
    let mut id = tree.front_of(node);
    while id != NONE {
        let front = tree.front(id);
        let shape = &front.shape;
        let (rows, frontal) = (shape.rows(), shape.frontal_rows());
        let ids = || shape.frontal.iter().chain(&shape.separator);
        let mut columns = vec![0.0; 6 * rows];
        for (place, row_id) in ids().enumerate() {
            if let Some(block) = values.remove(row_id) {
                for column in 0..6 {
                    let start = column * rows + 6 * place;
                    columns[start..start + 6].copy_from_slice(block.column(column).as_slice());
                }
            }
        }
        for column in columns.chunks_exact_mut(rows) {
            dense::forward(&front.factor, rows, frontal, column);
        }
        for row in 0..6 {
            for column in 0..=row {
                let one = &columns[row * rows..row * rows + frontal];
                let other = &columns[column * rows..column * rows + frontal];
                covariance[(row, column)] +=
                    one.iter().zip(other).map(|(one, other)| one * other).sum::<f64>();
            }
        }
        for (place, &row_id) in ids().enumerate().skip(shape.frontal.len()) {
            let block = Matrix6::from_columns(&std::array::from_fn::<_, 6, _>(|column| {
                let start = column * rows + 6 * place;
                Vector6::from_column_slice(&columns[start..start + 6])
            }));
            values.insert(row_id, block);
        }
        id = tree.parent(id);
    }
    covariance.fill_upper_triangle_with_lower_triangle();
    covariance
}

/// Covariance of each node, from the roots down. Each front hands its children what they share with it.
pub(super) fn marginals(tree: &Tree, nodes: usize) -> Vec<Matrix6<f64>> {
    let mut covariances = vec![Matrix6::zeros(); nodes];
    let mut place = vec![NONE; nodes];
    let mut waiting: Vec<(u32, Vec<f64>)> = tree.roots().map(|root| (root, Vec::new())).collect();
    while let Some((id, separator)) = waiting.pop() {
        let front = tree.front(id);
        let shape = &front.shape;
        let rows = shape.rows();
        let whole = takahashi::covariance_of_front(&front.factor, rows, shape.frontal_rows(), &separator);
        for (at, &node) in shape.frontal.iter().enumerate() {
            covariances[node as usize] = takahashi::diagonal_block(&whole, rows, at);
        }
        for (at, &node) in shape.frontal.iter().chain(&shape.separator).enumerate() {
            place[node as usize] = at as u32;
        }
        for &child in &shape.children {
            let shared: Vec<u32> =
                tree.front(child).shape.separator.iter().map(|&node| place[node as usize]).collect();
            waiting.push((child, takahashi::gather(&whole, rows, &shared)));
        }
    }
    covariances
}
