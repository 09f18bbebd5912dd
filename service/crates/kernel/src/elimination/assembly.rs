//! One front's dense matrix while it is put together and eliminated.

use nalgebra::Matrix6;

use super::dense::{self, BadPivot, DenseScratch};
use super::system::BlockSystem;

pub(super) const NONE: u32 = u32::MAX;

/// The buffers of one front. Rows are known by ids: keyframes by their index, virtual nodes by larger ones.
#[derive(Debug, Default)]
pub(crate) struct Assembly {
    /// Block row of each id that is in the front, else `NONE`.
    place: Vec<u32>,
    ids: Vec<u32>,
    frontal: usize,
    /// Column-major, lower triangle valid.
    matrix: Vec<f64>,
    right: Vec<f64>,
    /// Diagonal of the frontal rows before any elimination.
    original: Vec<f64>,
    scratch: DenseScratch,
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
        let rows = self.rows();
        self.matrix.clear();
        self.matrix.resize(rows * rows, 0.0);
        self.right.clear();
        self.right.resize(rows, 0.0);
        self.original.clear();
        self.original.resize(6 * frontal, 0.0);
    }

    /// Scalar rows of the front.
    pub(super) fn rows(&self) -> usize {
        6 * self.ids.len()
    }

    /// Scalar rows that are eliminated in it.
    pub(super) fn frontal_rows(&self) -> usize {
        6 * self.frontal
    }

    /// Block rows that are eliminated later.
    pub(super) fn separator(&self) -> &[u32] {
        &self.ids[self.frontal..]
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
        let rows = self.rows();
        for column in 0..6 {
            for row in column..6 {
                self.matrix[(start + column) * rows + start + row] += block[(row, column)];
            }
            if let Some(original) = self.original.get_mut(start + column) {
                *original += block[(column, column)];
            }
        }
    }

    /// Adds a block with the rows of one node and the columns of another.
    pub(super) fn add_cross(&mut self, of_rows: u32, of_columns: u32, block: &Matrix6<f64>) {
        let (row_place, column_place) =
            (self.place[of_rows as usize] as usize, self.place[of_columns as usize] as usize);
        let rows = self.rows();
        for column in 0..6 {
            for row in 0..6 {
                let index = if row_place > column_place {
                    (6 * column_place + column) * rows + 6 * row_place + row
                } else {
                    (6 * row_place + row) * rows + 6 * column_place + column
                };
                self.matrix[index] += block[(row, column)];
            }
        }
    }

    /// Adds a child's update matrix (column-major, lower triangle valid), whose block rows have these ids.
    pub(super) fn add_update(&mut self, ids: &[u32], update: &[f64]) {
        let rows = self.rows();
        let height = 6 * ids.len();
        for (from_column, column_id) in ids.iter().enumerate() {
            let to_column = self.place[*column_id as usize] as usize;
            for (offset, row_id) in ids[from_column..].iter().enumerate() {
                let from_row = from_column + offset;
                let to_row = self.place[*row_id as usize] as usize;
                if to_row >= to_column {
                    for column in 0..6 {
                        let from = (6 * from_column + column) * height + 6 * from_row;
                        let to = (6 * to_column + column) * rows + 6 * to_row;
                        // Above the diagonal of a diagonal block nothing is valid, nor read later.
                        for (target, value) in self.matrix[to..to + 6].iter_mut().zip(&update[from..from + 6])
                        {
                            *target += value;
                        }
                    }
                } else {
                    for column in 0..6 {
                        let from = (6 * from_column + column) * height + 6 * from_row;
                        for (row, value) in update[from..from + 6].iter().enumerate() {
                            self.matrix[(6 * to_row + row) * rows + 6 * to_column + column] += value;
                        }
                    }
                }
            }
        }
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
    /// puts the same front together once more, to find it.
    pub(super) fn eliminate(&mut self, again: impl FnOnce(&mut Assembly)) -> Result<(), (u32, f64)> {
        let (rows, frontal) = (self.rows(), self.frontal_rows());
        let result = dense::eliminate(&mut self.matrix, rows, frontal, &self.original, &mut self.scratch);
        result.map_err(|suspect| {
            self.matrix.fill(0.0);
            self.original.fill(0.0);
            again(self);
            let BadPivot { column, pivot } =
                dense::bad_pivot(&mut self.matrix, rows, suspect, &self.original);
            (self.ids[column / 6], pivot)
        })
    }

    /// Forward substitution of the right-hand side, after `eliminate`: y on the frontal rows, and what the
    /// separator's rows are left with.
    pub(super) fn forward(&mut self) -> &[f64] {
        let (rows, frontal) = (self.rows(), self.frontal_rows());
        dense::forward(&self.matrix[..rows * frontal], rows, frontal, &mut self.right);
        &self.right
    }

    /// L11 over L21, after `eliminate`.
    pub(super) fn factor(&self) -> &[f64] {
        &self.matrix[..self.rows() * self.frontal_rows()]
    }

    /// The last 6x6 pivot block, after `eliminate`: the information of the last frontal node given the separator.
    pub(super) fn last_pivot(&self) -> Matrix6<f64> {
        let (rows, start) = (self.rows(), self.frontal_rows() - 6);
        let factor = Matrix6::from_fn(|row, column| {
            if row >= column { self.matrix[(start + column) * rows + start + row] } else { 0.0 }
        });
        factor * factor.transpose()
    }

    /// Block rows in order, those eliminated here first.
    pub(super) fn ids(&self) -> &[u32] {
        &self.ids
    }

    /// Appends the update matrix, after `eliminate`: column-major, square, lower triangle valid.
    pub(super) fn copy_update(&self, into: &mut Vec<f64>) {
        let (rows, frontal) = (self.rows(), self.frontal_rows());
        for column in frontal..rows {
            into.extend_from_slice(&self.matrix[column * rows + frontal..(column + 1) * rows]);
        }
    }
}
