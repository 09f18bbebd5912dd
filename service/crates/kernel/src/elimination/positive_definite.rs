//! Inverses of single blocks.

#![allow(clippy::needless_range_loop, reason = "several arrays share the index, as in the formulas")]

use nalgebra::Matrix6;

/// Inverse of a symmetric positive definite block, of which the lower triangle is read. The error is the
/// pivot at which Cholesky's method stops.
pub(super) fn inverse(block: &Matrix6<f64>) -> Result<Matrix6<f64>, f64> {
    let mut lower = [[0.0_f64; 6]; 6];
    let mut reciprocals = [0.0_f64; 6];
    for column in 0..6 {
        for row in column..6 {
            let mut entry = block[(row, column)];
            for left in 0..column {
                entry -= lower[row][left] * lower[column][left];
            }
            if row > column {
                lower[row][column] = entry * reciprocals[column];
            } else if entry > 0.0 {
                reciprocals[column] = entry.sqrt().recip();
            } else {
                return Err(entry);
            }
        }
    }
    Ok(inverse_of_factored(&lower, &reciprocals))
}

/// Inverse of L L^T, from L by rows and the reciprocals of its diagonal. Nearer the truth than from the
/// product.
pub(super) fn inverse_of_factored(lower: &[[f64; 6]; 6], reciprocals: &[f64; 6]) -> Matrix6<f64> {
    // L^-1, by rows.
    let mut inverse = [[0.0_f64; 6]; 6];
    for row in 0..6 {
        inverse[row][row] = reciprocals[row];
        for column in 0..row {
            let mut sum = 0.0;
            for between in column..row {
                sum += lower[row][between] * inverse[between][column];
            }
            inverse[row][column] = -sum * reciprocals[row];
        }
    }
    let inverse = Matrix6::from_fn(|row, column| inverse[row][column]);
    inverse.tr_mul(&inverse)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_times_its_inverse_is_the_identity() {
        let half = Matrix6::from_fn(|row, column| ((3 * row + 5 * column) % 7) as f64 - 2.0);
        let block = half * half.transpose() + Matrix6::identity();
        let inverse = inverse(&block).expect("positive definite");
        assert!((block * inverse - Matrix6::identity()).amax() < 1e-12);
    }

    #[test]
    fn the_pivot_tells_where_it_stops() {
        let mut block = Matrix6::identity();
        block[(3, 3)] = -2.0;
        assert_eq!(inverse(&block), Err(-2.0));
        block[(3, 3)] = f64::NAN;
        assert!(inverse(&block).unwrap_err().is_nan());
    }
}
