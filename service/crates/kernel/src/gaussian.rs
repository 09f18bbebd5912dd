//! Covariances: are they ones, how to whiten with them, how much they leave open.

use nalgebra::{SMatrix, SVector};

use crate::KernelError;

/// Mirrored entries may differ by this share of the product of their standard deviations, 8.6e-6: room for
/// whoever computed the covariance in single precision, none for a mistake.
///
/// Entries (i, j) and (j, i) of A S A^T, n by n, are summed in different orders. Each errs by at most
/// g sum_kl |a_ik s_kl a_jl|, g = 2n u to first order, with unit roundoff u = 2^-24. With S = D R D, D its
/// standard deviations and R its correlations, and b_i = D a_i, the variance of component i is
/// b_i^T R b_i >= r |b_i|^2, r the least eigenvalue of R, and |r_kl| <= 1, so that by Cauchy-Schwarz the sum
/// is at most |b_i|_1 |b_j|_1 <= n |b_i| |b_j| <= (n / r) sigma_i sigma_j; for uncorrelated S at most
/// sigma_i sigma_j. So the two differ by at most 2 g = 24 u of that product for uncorrelated S of n = 6,
/// whatever the lever arm in A, and by 2 g n = 144 u for r = 1. That is the tolerance. Measured: 4e-7 for one
/// product, with lever arms of 100 m and correlations; 2.8e-6 for 1,000 steps compounded. Strong cancellation
/// (r far below 1) can exceed it and is refused: such entries are rounding for the most part.
pub const SYMMETRY_TOLERANCE: f64 = 144.0 / 16_777_216.0;

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

    /// J S J^T in single precision, summed from the left; J is a rotation with a lever arm of up to 100 m.
    fn in_single_precision(sigmas: &[f64], turn: &nalgebra::Vector3<f64>, arm_m: f64) -> Matrix6<f64> {
        let rotation = crate::so3::exp(turn);
        let arm = nalgebra::Vector3::new(arm_m, -0.3 * arm_m, 0.7 * arm_m);
        let carry = crate::se3::adjoint(&crate::se3::Pose::from_parts(arm.into(), rotation)).cast::<f32>();
        let diagonal = SVector::<f64, 6>::from_column_slice(sigmas).map(|sigma| sigma * sigma);
        let sigma = Matrix6::from_diagonal(&diagonal).cast::<f32>();
        ((carry * sigma) * carry.transpose()).cast::<f64>()
    }

    fn greatest_asymmetry(covariance: &Matrix6<f64>) -> f64 {
        let sigmas = covariance.diagonal().map(f64::sqrt);
        (covariance - covariance.transpose()).component_div(&(sigmas * sigmas.transpose())).amax()
    }

    proptest! {
        // Uncorrelated before: at most 24 roundings of 2^-24, a sixth of what is taken.
        #[test]
        fn single_precision_is_taken(
            sigmas in prop::collection::vec(1e-3..1e-1f64, 6),
            turn in crate::testing::rotation_vectors(),
            arm_m in -1.0..1.0f64,
        ) {
            let covariance = in_single_precision(&sigmas, &turn, arm_m);
            prop_assert!(greatest_asymmetry(&covariance) <= SYMMETRY_TOLERANCE / 6.0);
            let lower = cholesky(&covariance).map_err(|error| TestCaseError::fail(error.to_string()))?;
            // What is used is the mean: half the difference away, and roundings of the factor.
            let used = lower * lower.transpose();
            let scale = covariance.diagonal().map(f64::sqrt);
            let away = (used - covariance).component_div(&(scale * scale.transpose())).amax();
            prop_assert!(away <= SYMMETRY_TOLERANCE / 2.0 + 1e-14);
        }

        // The determinant of an arm of 100 m is beyond single precision, its symmetry is not.
        #[test]
        fn a_lever_arm_makes_no_asymmetry(
            sigmas in prop::collection::vec(1e-3..1e-1f64, 6),
            turn in crate::testing::rotation_vectors(),
            arm_m in -100.0..100.0f64,
        ) {
            let covariance = in_single_precision(&sigmas, &turn, arm_m);
            let refused = matches!(validate(&covariance), Err(KernelError::NotSymmetric { .. }));
            prop_assert!(!refused);
        }

        // Ten times the tolerance is a mistake, in any entry and whichever the scale.
        #[test]
        fn mistakes_are_refused(sigma in covariances::<6>(), row in 1..6usize, column in 0..5usize) {
            prop_assume!(column < row);
            let mut broken = sigma;
            let scale = (sigma[(row, row)] * sigma[(column, column)]).sqrt();
            broken[(row, column)] += 1e-4 * scale;
            match validate(&broken) {
                Err(KernelError::NotSymmetric { row: r, column: c, difference_ratio }) => {
                    prop_assert_eq!((r, c), (row, column));
                    prop_assert!((difference_ratio - 1e-4).abs() < 1e-12);
                }
                other => prop_assert!(false, "{:?}", other),
            }
        }
    }

    /// Rows swapped, one block transposed: what a wrong layout looks like.
    #[test]
    fn wrong_layouts_are_refused() {
        let covariance = in_single_precision(
            &[0.01, 0.02, 0.03, 0.001, 0.002, 0.003],
            &nalgebra::Vector3::new(0.4, -0.2, 0.9),
            0.5,
        );
        assert!(validate(&covariance).is_ok());
        let mut swapped = covariance;
        swapped.swap_rows(0, 1);
        let mut transposed = covariance;
        let block = covariance.fixed_view::<3, 3>(0, 3).transpose();
        transposed.fixed_view_mut::<3, 3>(0, 3).copy_from(&block);
        // The swap puts a negative covariance on the diagonal, which is told first.
        let error = validate(&swapped).expect_err("it is no covariance");
        assert!(matches!(error, KernelError::CovarianceNotPositiveDefinite { index: 0 | 1, .. }), "{error}");
        let error = validate(&transposed).expect_err("it is no covariance");
        assert!(matches!(error, KernelError::NotSymmetric { row: 3, column: 1, .. }), "{error}");
        assert!(error.to_string().contains("of the product of their standard deviations"), "{error}");
    }

    /// Whoever computes A Sigma A^T gets mirrored entries that differ by roundings.
    #[test]
    fn rounding_is_no_asymmetry() {
        let covariance = Matrix2::new(4.0, 0.5, 0.5 + 1e-12, 1.0);
        let lower = cholesky(&covariance).unwrap();
        assert!(((lower * lower.transpose())[(1, 0)] - (0.5 + 0.5e-12)).abs() < 1e-15);
    }
}
