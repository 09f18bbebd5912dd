//! Covariances: are they ones, how to whiten with them, how much they leave open.

use nalgebra::{SMatrix, SVector};

use crate::KernelError;

/// Mirrored entries may differ by this share of the product of their standard deviations: room for the
/// rounding of whoever computed the covariance, none for a mistake.
pub const SYMMETRY_TOLERANCE: f64 = 1e-9;

/// The lower Cholesky factor L of a covariance Sigma = L L^T, D from 1 to 6.
///
/// Entries must be finite (`NotFinite`), mirrored ones equal within [`SYMMETRY_TOLERANCE`] (`NotSymmetric`;
/// their mean is used) and every pivot positive (`CovarianceNotPositiveDefinite` says which and how far). A
/// pivot within (D + 1) roundings of the variance it is left from is no evidence of a positive one and is
/// refused too.
pub fn cholesky<const D: usize>(covariance: &SMatrix<f64, D, D>) -> Result<SMatrix<f64, D, D>, KernelError> {
    validate_shape(covariance)?;
    let mut lower = SMatrix::<f64, D, D>::zeros();
    for column in 0..D {
        let variance = covariance[(column, column)];
        let mut pivot = variance;
        for k in 0..column {
            pivot -= lower[(column, k)] * lower[(column, k)];
        }
        let noise = (D + 1) as f64 * f64::EPSILON * variance;
        if pivot.is_nan() || pivot <= noise {
            return Err(KernelError::CovarianceNotPositiveDefinite { index: column, pivot, variance });
        }
        let root = pivot.sqrt();
        lower[(column, column)] = root;
        for row in column + 1..D {
            let mut rest = 0.5 * (covariance[(row, column)] + covariance[(column, row)]);
            for k in 0..column {
                rest -= lower[(row, k)] * lower[(column, k)];
            }
            lower[(row, column)] = rest / root;
        }
    }
    Ok(lower)
}

/// W = L^-1 with Sigma = L L^T, so that W^T W = Sigma^-1: a residual r of covariance Sigma becomes the
/// whitened W r of covariance I. Lower triangular; refusals as of [`cholesky`].
///
/// ```
/// use nalgebra::{Matrix2, Vector2};
/// let whitening = pdn_kernel::gaussian::square_root_information(&Matrix2::new(4.0, 0.0, 0.0, 0.25))?;
/// assert_eq!(whitening * Vector2::new(2.0, 1.0), Vector2::new(1.0, 2.0));
/// # Ok::<(), pdn_kernel::KernelError>(())
/// ```
pub fn square_root_information<const D: usize>(
    covariance: &SMatrix<f64, D, D>,
) -> Result<SMatrix<f64, D, D>, KernelError> {
    let lower = cholesky(covariance)?;
    let mut inverse = SMatrix::<f64, D, D>::zeros();
    for column in 0..D {
        inverse[(column, column)] = 1.0 / lower[(column, column)];
        for row in column + 1..D {
            let mut sum = 0.0;
            for k in column..row {
                sum += lower[(row, k)] * inverse[(k, column)];
            }
            inverse[(row, column)] = -sum / lower[(row, row)];
        }
    }
    // A variance of 1e-320 has a square root but no information that a double can hold.
    validate_finite("square-root information", inverse.as_slice())?;
    Ok(inverse)
}

/// ln |Sigma| = 2 sum ln L_ii. The determinant itself may be far below the smallest double. Refusals as of
/// [`cholesky`].
///
/// ```
/// use nalgebra::Matrix6;
/// let sigma = Matrix6::identity() * 1e-80;
/// assert_eq!(sigma.determinant(), 0.0);
/// let log_determinant = pdn_kernel::gaussian::log_determinant(&sigma)?;
/// assert!((log_determinant - 6.0 * 1e-80f64.ln()).abs() < 1e-9);
/// # Ok::<(), pdn_kernel::KernelError>(())
/// ```
pub fn log_determinant<const D: usize>(covariance: &SMatrix<f64, D, D>) -> Result<f64, KernelError> {
    let lower = cholesky(covariance)?;
    Ok(2.0 * (0..D).map(|i| lower[(i, i)].ln()).sum::<f64>())
}

/// Refuses a covariance for the first reason that [`cholesky`] finds.
pub fn validate<const D: usize>(covariance: &SMatrix<f64, D, D>) -> Result<(), KernelError> {
    cholesky(covariance).map(|_| ())
}

/// The 1x1 covariance of one variance, for the kinds of measurement that have one number each.
pub(crate) fn standard_information(variance: f64) -> Result<f64, KernelError> {
    square_root_information(&SMatrix::<f64, 1, 1>::new(variance)).map(|root| root[(0, 0)])
}

/// Refuses the first entry that is infinite or not a number.
pub(crate) fn validate_finite(what: &'static str, values: &[f64]) -> Result<(), KernelError> {
    match values.iter().position(|value| !value.is_finite()) {
        Some(index) => Err(KernelError::NotFinite { what, index, value: values[index] }),
        None => Ok(()),
    }
}

fn validate_shape<const D: usize>(covariance: &SMatrix<f64, D, D>) -> Result<(), KernelError> {
    validate_finite("covariance", covariance.transpose().as_slice())?;
    let variances: SVector<f64, D> = covariance.diagonal();
    if let Some(index) = (0..D).find(|&i| variances[i] <= 0.0) {
        let variance = variances[index];
        return Err(KernelError::CovarianceNotPositiveDefinite { index, pivot: variance, variance });
    }
    for row in 1..D {
        for column in 0..row {
            let scale = variances[row].sqrt() * variances[column].sqrt();
            let difference_ratio = (covariance[(row, column)] - covariance[(column, row)]).abs() / scale;
            if difference_ratio.is_nan() || difference_ratio > SYMMETRY_TOLERANCE {
                return Err(KernelError::NotSymmetric { row, column, difference_ratio });
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix2, Matrix3, Matrix5, Matrix6};
    use proptest::prelude::*;

    use super::*;
    use crate::testing::covariances;

    proptest! {
        // Cholesky does not depend on the scale of the components, so what is left is the condition of the
        // scaled covariance, below 1e3, times some 10 eps.
        #[test]
        fn whitening_makes_covariances_unit(sigma in covariances::<6>()) {
            let whitening = square_root_information(&sigma).unwrap();
            let unit = whitening * sigma * whitening.transpose();
            prop_assert!((unit - Matrix6::identity()).amax() < 1e-11);
            prop_assert_eq!(whitening.upper_triangle(), Matrix6::from_diagonal(&whitening.diagonal()));
        }

        // The determinant by LU is another method; here it stays within the range of a double.
        #[test]
        fn log_determinant_is_that_of_the_determinant(sigma in covariances::<5>()) {
            let by_elimination = sigma.determinant().ln();
            prop_assert!((log_determinant(&sigma).unwrap() - by_elimination).abs() < 1e-11);
        }

        // Taking more from one variance than the others leave it makes any covariance none; the pivot says
        // how much.
        #[test]
        fn an_indefinite_matrix_is_refused_at_its_pivot(sigma in covariances::<5>(), index in 0..5usize) {
            let lower = cholesky(&sigma).unwrap();
            let left = lower[(index, index)] * lower[(index, index)];
            let mut broken = sigma;
            broken[(index, index)] -= 1.5 * left;
            // A variance that is negative itself is refused before the others are looked at.
            let expected = if broken[(index, index)] > 0.0 { -0.5 * left } else { broken[(index, index)] };
            match cholesky(&broken) {
                Err(KernelError::CovarianceNotPositiveDefinite { index: found, pivot, .. }) => {
                    prop_assert_eq!(found, index);
                    prop_assert!((pivot - expected).abs() < 1e-12 * sigma[(index, index)]);
                }
                other => prop_assert!(false, "{:?}", other),
            }
        }
    }

    #[test]
    fn refusals_name_the_number() {
        let mut sigma = Matrix5::identity();
        sigma[(1, 3)] = f64::NAN;
        assert!(matches!(validate(&sigma), Err(KernelError::NotFinite { index: 8, .. })));

        let skewed = Matrix2::new(4.0, 0.5, 0.3, 1.0);
        let Err(KernelError::NotSymmetric { row: 1, column: 0, difference_ratio }) = validate(&skewed) else {
            panic!("accepted {skewed}");
        };
        assert!((difference_ratio - 0.1).abs() < 1e-15);

        for variance in [0.0, -1.0, -0.0] {
            let sigma = Matrix3::from_diagonal(&[1.0, variance, 1.0].into());
            assert!(matches!(
                validate(&sigma),
                Err(KernelError::CovarianceNotPositiveDefinite { index: 1, .. })
            ));
        }
    }

    /// Fully correlated components: the rest is rounding, whatever its sign.
    #[test]
    fn a_singular_covariance_is_refused() {
        let direction = nalgebra::Vector3::new(0.1, 0.7, 1.3);
        let singular = direction * direction.transpose();
        assert!(matches!(
            validate(&singular),
            Err(KernelError::CovarianceNotPositiveDefinite { index: 1, .. })
        ));
    }

    /// Whoever computes A Sigma A^T gets mirrored entries that differ by roundings.
    #[test]
    fn rounding_is_no_asymmetry() {
        let covariance = Matrix2::new(4.0, 0.5, 0.5 + 1e-12, 1.0);
        let lower = cholesky(&covariance).unwrap();
        assert!(((lower * lower.transpose())[(1, 0)] - (0.5 + 0.5e-12)).abs() < 1e-15);
    }
}
