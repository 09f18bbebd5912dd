//! Partial Cholesky factorisation of one dense front, and what its factor is used for.
//!
//! A front is a column-major matrix whose columns are [`leading`] scalars apart, a whole number of vectors,
//! so that a kernel never meets a remainder. Only the lower triangle is meant; rows past the last, and what
//! lies above the diagonal, hold finite numbers that nothing reads.
//!
//! Small fronts, nearly all of a survey, go through kernels of our own ([`small`]), which lose no time in
//! packing; large ones through faer ([`large`]).

#![allow(clippy::needless_range_loop, reason = "several arrays share the index, as in the formulas")]

mod covariance;
mod large;
mod small;
mod substitution;

pub(super) use covariance::covariance_of_front;
pub(super) use substitution::{backward, forward};

/// Scalars of the widest vector that a kernel is compiled for.
const WIDEST: usize = 8;

/// Fronts of more rows that eliminate more than `MANY_FRONTAL` go through faer. Measured: there its packing
/// pays.
const MANY_ROWS: usize = 480;
const MANY_FRONTAL: usize = 96;

/// A pivot at or below this share of its original diagonal entry has no correct digit left: what rounding
/// errors of the elimination add to it is as large.
const PIVOT_FLOOR: f64 = 16.0 * f64::EPSILON;

/// Where a factorisation stopped, and on what pivot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct BadPivot {
    pub column: usize,
    pub pivot: f64,
}

/// From one column of a front to the next.
pub(super) fn leading(rows: usize) -> usize {
    rows.next_multiple_of(WIDEST)
}

/// Whether [`eliminate_large`] is the faster way.
pub(super) fn is_large(rows: usize, frontal: usize) -> bool {
    rows > MANY_ROWS && frontal > MANY_FRONTAL
}

/// Eliminates the first `frontal` of the `rows` rows of a symmetric matrix, in place.
///
/// Afterwards the first columns hold L11 over L21, and the lower triangle of the rest the update matrix F22 -
/// L21 L21^T. `original` holds the diagonal entries before any elimination, against which pivots are judged.
/// `rows` and `frontal` are whole blocks. The error is the first column without a pivot.
pub(super) fn eliminate(
    matrix: &mut [f64],
    rows: usize,
    frontal: usize,
    original: &[f64],
) -> Result<(), BadPivot> {
    pulp::Arch::new().dispatch(small::Eliminate { matrix, rows, frontal, original })
}

/// As [`eliminate`], for large fronts; a failure leaves no evidence, since faer does not tell the pivot.
pub(super) fn eliminate_large(
    matrix: &mut [f64],
    rows: usize,
    frontal: usize,
    original: &[f64],
) -> Option<()> {
    large::eliminate(matrix, rows, frontal, original)
}

/// A pivot that is not a number is lost too.
fn is_lost(pivot: f64, original: f64) -> bool {
    pivot.is_nan() || pivot <= PIVOT_FLOOR * original
}
