//! Covariances from the factor, front by front from the root down (Takahashi, Fagan, Chin 1973).

use nalgebra::Matrix6;

use super::{dense, packed};

/// Covariance of the rows of one front at a time, full; its buffers are used again.
#[derive(Debug, Default)]
pub(super) struct FrontCovariance {
    /// Column-major, columns `leading` apart.
    values: Vec<f64>,
    leading: usize,
    /// Scratch.
    weights: Vec<[f64; 6]>,
}

impl FrontCovariance {
    /// From a front's factor (`rows` x `eliminated.end`, L11 over L21) and the covariance of its separator,
    /// packed. Rows before `eliminated.start` are left out.
    pub(super) fn compute(
        &mut self,
        factor: &[f64],
        rows: usize,
        eliminated: std::ops::Range<usize>,
        separator: &[f64],
    ) {
        let frontal = eliminated.end;
        self.leading = dense::leading(rows);
        self.values.clear();
        self.values.resize(self.leading * rows, 0.0);
        let mut rest = separator;
        for start in (frontal..rows).step_by(6) {
            let height = rows - start;
            let (columns, after) = rest.split_at(6 * height);
            rest = after;
            for (offset, source) in columns.chunks_exact(height).enumerate() {
                let column = start + offset;
                self.values[column * self.leading + start..][..height].copy_from_slice(source);
                for (row, value) in (start..rows).zip(source) {
                    self.values[row * self.leading + column] = *value;
                }
            }
        }
        dense::covariance_of_front(factor, rows, eliminated, &mut self.values, &mut self.weights);
    }

    /// The 6x6 block at a block row and a block column.
    pub(super) fn block(&self, row_place: usize, column_place: usize) -> Matrix6<f64> {
        Matrix6::from_fn(|row, column| {
            self.values[(6 * column_place + column) * self.leading + 6 * row_place + row]
        })
    }

    /// The symmetric block of one node.
    pub(super) fn own_block(&self, place: usize) -> Matrix6<f64> {
        self.block(place, place).symmetric_part()
    }

    /// Rows and columns of these block places, packed.
    pub(super) fn gather(&self, places: &[u32]) -> Vec<f64> {
        let mut gathered = Vec::with_capacity(packed::len(places.len()));
        for (from, &column_place) in places.iter().enumerate() {
            for column in 6 * column_place as usize..6 * column_place as usize + 6 {
                let values = &self.values[column * self.leading..][..self.leading];
                for &row_place in &places[from..] {
                    gathered.extend_from_slice(&values[6 * row_place as usize..][..6]);
                }
            }
        }
        gathered
    }
}
