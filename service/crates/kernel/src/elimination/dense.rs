//! Partial Cholesky factorisation of one dense front.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{
    LltError, LltParams, LltRegularization, cholesky_in_place, cholesky_in_place_scratch,
};
use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Accum, Auto, MatMut, MatRef, Par, Spec};

/// Where a factorisation stopped, and on what pivot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BadPivot {
    pub column: usize,
    pub pivot: f64,
}

/// Scratch memory of the dense kernels.
pub(super) struct DenseScratch {
    memory: MemBuffer,
    columns: usize,
}

impl Default for DenseScratch {
    fn default() -> Self {
        DenseScratch { memory: MemBuffer::new(faer::dyn_stack::StackReq::EMPTY), columns: 0 }
    }
}

impl std::fmt::Debug for DenseScratch {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "DenseScratch({} columns)", self.columns)
    }
}

impl DenseScratch {
    fn stack(&mut self, columns: usize) -> &mut MemStack {
        if columns > self.columns {
            let params: Spec<LltParams, f64> = <LltParams as Auto<f64>>::auto().into();
            self.memory = MemBuffer::new(cholesky_in_place_scratch::<f64>(columns, Par::Seq, params));
            self.columns = columns;
        }
        MemStack::new(&mut self.memory)
    }
}

/// A pivot at or below this share of its original diagonal entry has no correct digit left: what rounding
/// errors of the elimination add to it is as large.
const PIVOT_FLOOR: f64 = 16.0 * f64::EPSILON;

/// A pivot that is not a number is lost too.
fn is_lost(pivot: f64, original: f64) -> bool {
    pivot.is_nan() || pivot <= PIVOT_FLOOR * original
}

/// Eliminates the first `frontal` of the `rows` rows of a symmetric matrix, in place.
///
/// `matrix` is column-major, `rows * rows`, its lower triangle valid. Afterwards the first columns hold
/// L11 over L21, and the lower triangle of the rest the update matrix F22 - L21 L21^T.
/// `original` holds the diagonal entries before any elimination, against which pivots are judged.
/// The error is the column that has no pivot.
pub(super) fn eliminate(
    matrix: &mut [f64],
    rows: usize,
    frontal: usize,
    original: &[f64],
    scratch: &mut DenseScratch,
) -> Result<(), usize> {
    let whole = MatMut::from_column_major_slice_mut(matrix, rows, rows);
    let (mut pivot_block, _, mut below, mut rest) = whole.split_at_mut(frontal, frontal);
    cholesky_in_place(
        pivot_block.rb_mut(),
        LltRegularization::default(),
        Par::Seq,
        scratch.stack(frontal),
        <LltParams as Auto<f64>>::auto().into(),
    )
    .map_err(|LltError::NonPositivePivot { index }| index)?;
    for (column, &original) in original.iter().enumerate() {
        let root = pivot_block[(column, column)];
        if is_lost(root * root, original) {
            return Err(column);
        }
    }
    if rows > frontal {
        solve_lower_triangular_in_place(pivot_block.rb(), below.rb_mut().transpose_mut(), Par::Seq);
        matmul(
            rest.rb_mut(),
            BlockStructure::TriangularLower,
            Accum::Add,
            below.rb(),
            BlockStructure::Rectangular,
            below.rb().transpose(),
            BlockStructure::Rectangular,
            -1.0,
            Par::Seq,
        );
    }
    Ok(())
}

/// The first pivot that [`eliminate`] would refuse, by the textbook method: the evidence after a failure.
/// `suspect` is the column to report should every pivot before it pass.
pub(super) fn bad_pivot(matrix: &mut [f64], rows: usize, suspect: usize, original: &[f64]) -> BadPivot {
    for column in 0..=suspect {
        let pivot = matrix[column * rows + column];
        if column == suspect || is_lost(pivot, original[column]) {
            return BadPivot { column, pivot };
        }
        for right in column + 1..=suspect {
            let scale = matrix[column * rows + right] / pivot;
            for row in right..=suspect {
                matrix[right * rows + row] -= scale * matrix[column * rows + row];
            }
        }
    }
    unreachable!("the loop returns at the suspect")
}

/// Forward substitution through a front's factor (`rows` x `frontal`, L11 over L21): `right[..frontal]` becomes
/// y = L11^-1 b, the rest loses L21 y.
pub(super) fn forward(factor: &[f64], rows: usize, frontal: usize, right: &mut [f64]) {
    for column in 0..frontal {
        let entries = &factor[column * rows..(column + 1) * rows];
        let value = right[column] / entries[column];
        right[column] = value;
        for (target, entry) in right[column + 1..rows].iter_mut().zip(&entries[column + 1..]) {
            *target -= entry * value;
        }
    }
}

/// Backward substitution: `solution[frontal..]` holds the separator's values, `solution[..frontal]` holds y and
/// becomes x = L11^-T (y - L21^T x_separator).
pub(super) fn backward(factor: &[f64], rows: usize, frontal: usize, solution: &mut [f64]) {
    for column in (0..frontal).rev() {
        let entries = &factor[column * rows..(column + 1) * rows];
        let known = dot(&entries[column + 1..], &solution[column + 1..rows]);
        solution[column] = (solution[column] - known) / entries[column];
    }
}

/// Inner product in eight partial sums, which the compiler can keep in vector registers.
fn dot(one: &[f64], other: &[f64]) -> f64 {
    const LANES: usize = 8;
    let mut sums = [0.0; LANES];
    let (ones, others) = (one.chunks_exact(LANES), other.chunks_exact(LANES));
    let rest: f64 = ones.remainder().iter().zip(others.remainder()).map(|(one, other)| one * other).sum();
    for (one, other) in ones.zip(others) {
        for lane in 0..LANES {
            sums[lane] += one[lane] * other[lane];
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// A view of a front's factor.
pub(super) fn factor_view(factor: &[f64], rows: usize, frontal: usize) -> MatRef<'_, f64> {
    MatRef::from_column_major_slice(factor, rows, frontal)
}
