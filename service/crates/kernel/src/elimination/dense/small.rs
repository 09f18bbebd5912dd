//! The factorisation of small fronts, block column by block column, in the vectors that the processor has.
//!
//! Each entry is the sum of its products in the order of the eliminated columns, by fused multiply-add. So
//! the bits of a result depend neither on the width of the vectors nor on how a front is cut into tiles.

use pulp::{Simd, WithSimd};

use super::{BadPivot, WIDEST, is_lost, leading};

/// Scalars of a block, the degrees of freedom of a pose.
const BLOCK: usize = 6;

/// The arguments of [`super::eliminate`].
pub(super) struct Eliminate<'a> {
    pub matrix: &'a mut [f64],
    pub rows: usize,
    pub frontal: usize,
    pub original: &'a [f64],
}

impl WithSimd for Eliminate<'_> {
    type Output = Result<(), BadPivot>;

    /// Left-looking: a block column first loses what all eliminated columns before it have to do with it,
    /// while its tiles stay in registers; then, if it is to be eliminated, its diagonal block is factored and
    /// the rows below are solved with it.
    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Eliminate { matrix, rows, frontal, original } = self;
        let leading = leading(rows);
        for column in (0..rows).step_by(BLOCK) {
            let depth = column.min(frontal);
            let (factor, rest) = matrix.split_at_mut(depth * leading);
            let target = &mut rest[(column - depth) * leading..][..BLOCK * leading];
            if depth > 0 {
                subtract_products(simd, factor, target, leading, column);
            }
            if column < frontal {
                let pivot_block = Triangle::factor(target, leading, column, original)?;
                solve(simd, target, leading, column, &pivot_block);
                pivot_block.write(target, leading, column);
            }
        }
        Ok(())
    }
}

/// target -= L[rows, ..] L[column.., ..]^T for the rows from `column` on.
#[inline(always)]
fn subtract_products<S: Simd>(simd: S, factor: &[f64], target: &mut [f64], leading: usize, column: usize) {
    let height = leading / S::F64_LANES;
    let rows_of = |scalars: &[f64]| -> [f64; BLOCK] {
        scalars[column..column + BLOCK].try_into().expect("a block of scalars")
    };
    let vectors = S::as_simd_f64s(factor).0;
    let target = S::as_mut_simd_f64s(target).0;
    let mut at = first_vector::<S>(column);
    while at + 2 <= height {
        let factors = factor.chunks_exact(leading).map(rows_of);
        tile::<S, 2>(simd, vectors, factors, target, height, at);
        at += 2;
    }
    if at < height {
        let factors = factor.chunks_exact(leading).map(rows_of);
        tile::<S, 1>(simd, vectors, factors, target, height, at);
    }
}

/// The vector in which a row lies, or one before it. The rows that come with it are above the diagonal.
#[inline(always)]
pub(super) fn first_vector<S: Simd>(row: usize) -> usize {
    row / WIDEST * (WIDEST / S::F64_LANES)
}

/// `V` vectors of rows by one block of columns: target -= sum over k of left[rows, k] factors[k].
#[inline(always)]
pub(super) fn tile<S: Simd, const V: usize>(
    simd: S,
    left: &[S::f64s],
    factors: impl Iterator<Item = [f64; BLOCK]>,
    target: &mut [S::f64s],
    height: usize,
    at: usize,
) {
    let mut sums = [[simd.splat_f64s(0.0); V]; BLOCK];
    for (rows, factors) in left.chunks_exact(height).zip(factors) {
        let rows: &[S::f64s; V] = rows[at..at + V].try_into().expect("a tile of rows");
        for (sums, factor) in sums.iter_mut().zip(factors) {
            let factor = simd.splat_f64s(factor);
            for (sum, row) in sums.iter_mut().zip(rows) {
                *sum = simd.mul_add_f64s(*row, factor, *sum);
            }
        }
    }
    for (column, sums) in target.chunks_exact_mut(height).zip(&sums) {
        for (entry, sum) in column[at..at + V].iter_mut().zip(sums) {
            *entry = simd.sub_f64s(*entry, *sum);
        }
    }
}

/// X L11^T = A in place, for the rows from `column` on; those of the pivot block itself come out wrong.
#[inline(always)]
fn solve<S: Simd>(simd: S, target: &mut [f64], leading: usize, column: usize, pivot_block: &Triangle) {
    let height = leading / S::F64_LANES;
    let target = S::as_mut_simd_f64s(target).0;
    for at in first_vector::<S>(column)..height {
        let mut solved = [simd.splat_f64s(0.0); BLOCK];
        for right in 0..BLOCK {
            let mut entry = target[right * height + at];
            for (left, known) in solved.iter().enumerate().take(right) {
                entry =
                    simd.negate_mul_add_f64s(*known, simd.splat_f64s(pivot_block.lower[left][right]), entry);
            }
            solved[right] = simd.mul_f64s(entry, simd.splat_f64s(pivot_block.reciprocals[right]));
            target[right * height + at] = solved[right];
        }
    }
}

/// The Cholesky factor of a pivot block.
struct Triangle {
    /// By columns; zero above the diagonal.
    lower: [[f64; BLOCK]; BLOCK],
    reciprocals: [f64; BLOCK],
}

impl Triangle {
    /// Factors the block at rows `column..` of a block column.
    #[inline(always)]
    fn factor(target: &[f64], leading: usize, column: usize, original: &[f64]) -> Result<Triangle, BadPivot> {
        let mut lower = [[0.0_f64; BLOCK]; BLOCK];
        let mut reciprocals = [0.0_f64; BLOCK];
        for here in 0..BLOCK {
            let mut entries = [0.0; BLOCK];
            entries[here..].copy_from_slice(&target[here * leading + column..][here..BLOCK]);
            for left in &lower[..here] {
                for row in here..BLOCK {
                    entries[row] = (-left[row]).mul_add(left[here], entries[row]);
                }
            }
            let pivot = entries[here];
            if is_lost(pivot, original[column + here]) {
                return Err(BadPivot { column: column + here, pivot });
            }
            let root = pivot.sqrt();
            reciprocals[here] = root.recip();
            lower[here][here] = root;
            for row in here + 1..BLOCK {
                lower[here][row] = entries[row] * reciprocals[here];
            }
        }
        Ok(Triangle { lower, reciprocals })
    }

    #[inline(always)]
    fn write(&self, target: &mut [f64], leading: usize, column: usize) {
        for (entries, target) in self.lower.iter().zip(target.chunks_exact_mut(leading)) {
            target[column..column + BLOCK].copy_from_slice(entries);
        }
    }
}
