//! Covariances from the factor, front by front from the root down (Takahashi, Fagan, Chin 1973).

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::{solve_lower_triangular_in_place, solve_upper_triangular_in_place};
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Accum, Mat, MatMut, Par};

use super::dense::factor_view;

/// Covariance of all rows of a front, column-major and full, from its factor (`rows` x `frontal`, L11 over L21) and the
/// covariance of its separator (full, column-major).
///
/// With W = L21 L11^-1: S_sf = -S_ss W and S_ff = (L11 L11^T)^-1 + W^T S_ss W.
pub(super) fn covariance_of_front(
    factor: &[f64],
    rows: usize,
    frontal: usize,
    separator: &[f64],
) -> Vec<f64> {
    let (upper, below) = factor_view(factor, rows, frontal).split_at_row(frontal);
    let behind = rows - frontal;
    let mut whole = vec![0.0; rows * rows];
    let mut covariance = MatMut::from_column_major_slice_mut(&mut whole, rows, rows);

    let mut inverse = Mat::<f64>::identity(frontal, frontal);
    solve_lower_triangular_in_place(upper, inverse.as_mut(), Par::Seq);
    let own = covariance.rb_mut().submatrix_mut(0, 0, frontal, frontal);
    matmul(own, Accum::Replace, inverse.transpose(), &inverse, 1.0, Par::Seq);

    if behind > 0 {
        let mut weights = below.transpose().to_owned();
        solve_upper_triangular_in_place(upper.transpose(), weights.as_mut(), Par::Seq);
        let of_separator = faer::MatRef::from_column_major_slice(separator, behind, behind);
        let cross = covariance.rb_mut().submatrix_mut(frontal, 0, behind, frontal);
        matmul(cross, Accum::Replace, of_separator, weights.transpose(), -1.0, Par::Seq);
        let (mut own, mut mirrored, cross, mut corner) = covariance.split_at_mut(frontal, frontal);
        matmul(own.rb_mut(), Accum::Add, &weights, cross.rb(), -1.0, Par::Seq);
        mirrored.copy_from(cross.transpose());
        corner.copy_from(of_separator);
    }
    whole
}

/// Rows and columns of these block places, from a full column-major matrix of `rows` rows.
pub(super) fn gather(matrix: &[f64], rows: usize, places: &[u32]) -> Vec<f64> {
    let mut gathered = Vec::with_capacity(36 * places.len() * places.len());
    for &column_place in places {
        for column in 6 * column_place as usize..6 * column_place as usize + 6 {
            let values = &matrix[column * rows..(column + 1) * rows];
            for &row_place in places {
                gathered.extend_from_slice(&values[6 * row_place as usize..6 * row_place as usize + 6]);
            }
        }
    }
    gathered
}

/// The symmetric 6x6 block at one block row and column.
pub(super) fn diagonal_block(matrix: &[f64], rows: usize, place: usize) -> nalgebra::Matrix6<f64> {
    cross_block(matrix, rows, place, place).symmetric_part()
}

/// The 6x6 block at a block row and a block column.
pub(super) fn cross_block(
    matrix: &[f64],
    rows: usize,
    row_place: usize,
    column_place: usize,
) -> nalgebra::Matrix6<f64> {
    nalgebra::Matrix6::from_fn(|row, column| matrix[(6 * column_place + column) * rows + 6 * row_place + row])
}
