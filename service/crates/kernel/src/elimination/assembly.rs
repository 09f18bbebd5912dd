//! One front's dense matrix while it is assembled and eliminated, and the covariance of its last node.

use nalgebra::Matrix6;

use super::dense::{self, BadPivot};
use super::packed;
use super::positive_definite;
use super::system::BlockSystem;

pub(super) const NONE: u32 = u32::MAX;

/// The buffers of one front. Rows are known by ids: keyframes by their index, virtual nodes by larger ones.
#[derive(Debug, Default)]
pub(crate) struct Assembly {
    /// Block row of each id that is in the front, else `NONE`.
    place: Vec<u32>,
    ids: Vec<u32>,
    frontal: usize,
    /// Scalars from one column to the next.
    leading: usize,
    /// Column-major; only the lower triangle is meant.
    matrix: Vec<f64>,
    right: Vec<f64>,
    /// Diagonal of the frontal rows before any elimination.
    original: Vec<f64>,
    /// Scratch: the places of a child's ids here.
    places: Vec<u32>,
}

impl Assembly {
    /// Starts an empty front with these block rows, of which the first `frontal` are eliminated in it.
    /// Ids are below `id_count`.
    pub(super) fn begin(&mut self, ids: impl Iterator<Item = u32>, frontal: usize, id_count: usize) {
        for &id in &self.ids {
            self.place[id as usize] = NONE;
        }
        self.ids.clear();
        self.ids.extend(ids);
        if self.place.len() < id_count {
            self.place.resize(id_count, NONE);
        }
        for (place, &id) in self.ids.iter().enumerate() {
            self.place[id as usize] = place as u32;
        }
        self.frontal = frontal;
        self.leading = dense::leading(self.rows());
        self.clear();
    }

    /// Sets everything to zero that is meant, and what lies beside it in the diagonal blocks.
    fn clear(&mut self) {
        let (rows, leading) = (self.rows(), self.leading);
        if self.matrix.len() < rows * leading {
            self.matrix.resize(rows * leading, 0.0);
        }
        for (column, entries) in self.matrix[..rows * leading].chunks_exact_mut(leading).enumerate() {
            entries[column / 6 * 6..].fill(0.0);
        }
        self.right.clear();
        self.right.resize(leading, 0.0);
        self.original.clear();
        self.original.resize(6 * self.frontal, 0.0);
    }

    /// Scalar rows of the front.
    pub(super) fn rows(&self) -> usize {
        6 * self.ids.len()
    }

    /// Scalar rows that are eliminated in it.
    pub(super) fn frontal_rows(&self) -> usize {
        6 * self.frontal
    }

    /// Whether this id has a row here.
    pub(super) fn has(&self, id: u32) -> bool {
        self.place.get(id as usize).is_some_and(|&place| place != NONE)
    }

    /// Adds the blocks of the system whose first eliminated node is one of these.
    pub(super) fn add_system(&mut self, system: &BlockSystem, frontal: &[u32]) {
        for &node in frontal {
            let own = self.place[node as usize];
            let diagonal = system.diagonal(node);
            self.add_diagonal(node, &diagonal.block);
            for (target, value) in self.right[6 * own as usize..].iter_mut().zip(diagonal.rhs.iter()) {
                *target += value;
            }
            for neighbour in system.neighbours(node) {
                let other = self.place[neighbour.node as usize];
                // The pair belongs to whichever is eliminated first; eliminated ones have no row here.
                if other != NONE && other > own {
                    let block = system.edge_block(neighbour.edge);
                    if node < neighbour.node {
                        self.add_cross(node, neighbour.node, block);
                    } else {
                        self.add_cross(neighbour.node, node, block);
                    }
                }
            }
        }
    }

    /// Adds original information of one node.
    pub(super) fn add_diagonal(&mut self, id: u32, block: &Matrix6<f64>) {
        let start = 6 * self.place[id as usize] as usize;
        let columns = &mut self.matrix[start * self.leading..];
        for (column, target) in columns.chunks_exact_mut(self.leading).take(6).enumerate() {
            for row in column..6 {
                target[start + row] += block[(row, column)];
            }
        }
        if let Some(original) = self.original.get_mut(start..start + 6) {
            for (axis, original) in original.iter_mut().enumerate() {
                *original += block[(axis, axis)];
            }
        }
    }

    /// Adds a block with the rows of one node and the columns of another.
    pub(super) fn add_cross(&mut self, of_rows: u32, of_columns: u32, block: &Matrix6<f64>) {
        let row = 6 * self.place[of_rows as usize] as usize;
        let column = 6 * self.place[of_columns as usize] as usize;
        let start = row.min(column);
        let columns = &mut self.matrix[start * self.leading..];
        for (offset, target) in columns.chunks_exact_mut(self.leading).take(6).enumerate() {
            if row > column {
                for (target, value) in target[row..row + 6].iter_mut().zip(block.column(offset).iter()) {
                    *target += value;
                }
            } else {
                for (at, target) in target[column..column + 6].iter_mut().enumerate() {
                    *target += block[(offset, at)];
                }
            }
        }
    }

    /// Adds a child's packed update matrix, whose block rows have these ids.
    pub(super) fn add_update(&mut self, ids: &[u32], update: &[f64]) {
        self.places.clear();
        self.places.extend(ids.iter().map(|&id| self.place[id as usize]));
        packed::add(&self.places, update, &mut self.matrix, self.leading);
    }

    /// Adds a child's part of the right-hand side, whose block rows have these ids.
    pub(super) fn add_right(&mut self, ids: &[u32], values: &[f64]) {
        for (id, values) in ids.iter().zip(values.chunks_exact(6)) {
            let start = 6 * self.place[*id as usize] as usize;
            for (target, value) in self.right[start..start + 6].iter_mut().zip(values) {
                *target += value;
            }
        }
    }

    /// Eliminates the frontal rows. The error is the id of the node without a pivot, and the pivot; `again`
    /// puts the same front together once more, should its evidence be lost.
    pub(super) fn eliminate(&mut self, again: impl FnOnce(&mut Assembly)) -> Result<(), (u32, f64)> {
        let (rows, frontal) = (self.rows(), self.frontal_rows());
        let matrix = &mut self.matrix[..rows * self.leading];
        if dense::is_large(rows, frontal) {
            if dense::eliminate_large(matrix, rows, frontal, &self.original).is_some() {
                return Ok(());
            }
            self.clear();
            again(self);
        }
        let matrix = &mut self.matrix[..rows * self.leading];
        dense::eliminate(matrix, rows, frontal, &self.original)
            .map_err(|BadPivot { column, pivot }| (self.ids[column / 6], pivot))
    }

    /// Floating point operations of `eliminate`.
    pub(super) fn flops(&self) -> f64 {
        let (p, q) = (self.frontal_rows() as f64, (self.rows() - self.frontal_rows()) as f64);
        p * p * p / 3.0 + p * p * q + p * q * q
    }

    /// Forward substitution of the right-hand side, after `eliminate`: y on the frontal rows, and what the
    /// separator's rows are left with.
    pub(super) fn forward(&mut self) -> &[f64] {
        let rows = self.rows();
        dense::forward(&self.matrix[..self.leading * 6 * self.frontal], rows, &mut self.right);
        &self.right[..rows]
    }

    /// L11 over L21, after `eliminate`, columns [`dense::leading`] apart.
    pub(super) fn factor(&self) -> &[f64] {
        &self.matrix[..self.leading * self.frontal_rows()]
    }

    /// Covariance of the last frontal node given the separator, after `eliminate`: the inverse of its pivot
    /// block.
    pub(super) fn last_covariance(&self) -> Matrix6<f64> {
        let start = self.frontal_rows() - 6;
        let entry = |row: usize, column: usize| self.matrix[(start + column) * self.leading + start + row];
        let lower = std::array::from_fn(|row| {
            std::array::from_fn(|column| if row >= column { entry(row, column) } else { 0.0 })
        });
        positive_definite::inverse_of_factored(&lower, &std::array::from_fn(|row| entry(row, row).recip()))
    }

    /// Block rows in order, those eliminated here first.
    pub(super) fn ids(&self) -> &[u32] {
        &self.ids
    }

    /// Appends the update matrix, after `eliminate`, packed.
    pub(super) fn copy_update(&self, into: &mut Vec<f64>) {
        packed::append(&self.matrix, self.leading, self.frontal, self.ids.len(), into);
    }
}
