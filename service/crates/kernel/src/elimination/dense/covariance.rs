//! The covariance of a front's rows from its factor and the covariance of its separator.

use pulp::{Arch, Simd, WithSimd};

use super::leading;
use super::small::{first_vector, tile};

const BLOCK: usize = 6;

/// Covariance of all rows of a front, full, columns [`leading`] apart, from its factor (`rows` x
/// `eliminated.end`, L11 over L21).
///
/// On entry the rows and columns of the separator hold its covariance (full). Column by column from the last
/// eliminated one (Takahashi): with W = L[below, j] L_jj^-1 the covariance is S[below, j] = -S[below, below]
/// W and S_jj = (L_jj L_jj^T)^-1 - W^T S[below, j]. Rows and columns before `eliminated.start`, whole blocks,
/// are left out. `weights` is scratch.
pub(in crate::elimination) fn covariance_of_front(
    factor: &[f64],
    rows: usize,
    eliminated: std::ops::Range<usize>,
    covariance: &mut [f64],
    weights: &mut Vec<[f64; BLOCK]>,
) {
    debug_assert_eq!(covariance.len(), leading(rows) * rows);
    Arch::new().dispatch(Covariance { factor, rows, eliminated, covariance, weights });
}

struct Covariance<'a> {
    factor: &'a [f64],
    rows: usize,
    eliminated: std::ops::Range<usize>,
    covariance: &'a mut [f64],
    weights: &'a mut Vec<[f64; BLOCK]>,
}

impl WithSimd for Covariance<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Covariance { factor, rows, eliminated, covariance, weights } = self;
        let leading = leading(rows);
        let height = leading / S::F64_LANES;
        for column in eliminated.step_by(BLOCK).rev() {
            let below = column + BLOCK;
            let entries = &factor[column * leading..below * leading];
            let inverse = inverse_of_triangle(entries, leading, column);
            weigh(entries, leading, below..rows, &inverse, weights);

            let (left, right) = covariance.split_at_mut(below * leading);
            let target = &mut left[column * leading..];
            target.fill(0.0);
            let known = S::as_simd_f64s(right).0;
            let vectors = S::as_mut_simd_f64s(target).0;
            let mut at = first_vector::<S>(below);
            while at + 2 <= height {
                tile::<S, 2>(simd, known, weights.iter().copied(), vectors, height, at);
                at += 2;
            }
            if at < height {
                tile::<S, 1>(simd, known, weights.iter().copied(), vectors, height, at);
            }
            finish(target, leading, below..rows, column, &inverse, weights);
            for (row, column_of_row) in (below..rows).zip(right.chunks_exact_mut(leading)) {
                for offset in 0..BLOCK {
                    column_of_row[column + offset] = target[offset * leading + row];
                }
            }
        }
    }
}

/// Inverse of the lower triangle at rows `column..` of a block column, by rows: `[row][column]`.
#[inline(always)]
fn inverse_of_triangle(entries: &[f64], leading: usize, column: usize) -> [[f64; BLOCK]; BLOCK] {
    let mut inverse = [[0.0_f64; BLOCK]; BLOCK];
    for row in 0..BLOCK {
        let pivot = entries[row * leading + column + row].recip();
        for of in 0..row {
            let mut sum = 0.0_f64;
            for between in of..row {
                sum = entries[between * leading + column + row].mul_add(inverse[between][of], sum);
            }
            inverse[row][of] = -sum * pivot;
        }
        inverse[row][row] = pivot;
    }
    inverse
}

/// W = L[below, j] L_jj^-1, a row for each row below.
#[inline(always)]
fn weigh(
    entries: &[f64],
    leading: usize,
    below: std::ops::Range<usize>,
    inverse: &[[f64; BLOCK]; BLOCK],
    weights: &mut Vec<[f64; BLOCK]>,
) {
    weights.clear();
    for row in below {
        let mut weight = [0.0_f64; BLOCK];
        for between in 0..BLOCK {
            let entry = entries[between * leading + row];
            for of in 0..=between {
                weight[of] = entry.mul_add(inverse[between][of], weight[of]);
            }
        }
        weights.push(weight);
    }
}

/// The diagonal block: S_jj = L_jj^-T L_jj^-1 - W^T S[below, j].
#[inline(always)]
fn finish(
    target: &mut [f64],
    leading: usize,
    below: std::ops::Range<usize>,
    column: usize,
    inverse: &[[f64; BLOCK]; BLOCK],
    weights: &[[f64; BLOCK]],
) {
    for of in 0..BLOCK {
        let mut sums = [0.0_f64; BLOCK];
        for between in of..BLOCK {
            for row in 0..=between {
                sums[row] = inverse[between][row].mul_add(inverse[between][of], sums[row]);
            }
        }
        let known = &target[of * leading..][below.clone()];
        for (weight, known) in weights.iter().zip(known) {
            for row in 0..BLOCK {
                sums[row] = (-weight[row]).mul_add(*known, sums[row]);
            }
        }
        target[of * leading + column..][..BLOCK].copy_from_slice(&sums);
    }
}
