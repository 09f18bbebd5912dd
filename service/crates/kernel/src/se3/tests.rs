use nalgebra::{Matrix4, Matrix6, Vector6};
use proptest::prelude::*;

use super::*;
use crate::testing::{agree, numerical_jacobian, poses, tangents};

/// ad(xi) = [[phi^, rho^], [0, phi^]], the adjoint of the algebra.
fn small_adjoint(xi: &Vector6<f64>) -> Matrix6<f64> {
    let (rho, phi) = parts(xi);
    blocks(&so3::hat(&phi), &so3::hat(&rho), &so3::hat(&phi))
}

/// Sum of ad(xi)^k / (k + 1)!, the definition of J_l. 60 terms: with |phi| <= pi and |rho| <= 10 the last is
/// 1e-45.
fn left_jacobian_by_series(xi: &Vector6<f64>) -> Matrix6<f64> {
    let mut term = Matrix6::identity();
    let mut sum = term;
    for k in 1..60 {
        term = small_adjoint(xi) * term / f64::from(k + 1);
        sum += term;
    }
    sum
}

/// Sum of xi^^k / k! of 4x4 matrices, the definition of Exp.
fn exp_by_series(xi: &Vector6<f64>) -> Matrix4<f64> {
    let (rho, phi) = parts(xi);
    let mut generator = Matrix4::zeros();
    generator.fixed_view_mut::<3, 3>(0, 0).copy_from(&so3::hat(&phi));
    generator.fixed_view_mut::<3, 1>(0, 3).copy_from(&rho);
    let mut term = Matrix4::identity();
    let mut sum = term;
    for k in 1..60 {
        term = generator * term / f64::from(k);
        sum += term;
    }
    sum
}

// Tolerances: with translations of up to 10 m and terms of the series of up to 6 times that, 60 summands
// round to some 1e-14 of the greatest entry; 1e-13 leaves a margin. `agree` scales by that entry.
proptest! {
    #[test]
    fn exp_equals_its_series(xi in tangents()) {
        let by_series = exp_by_series(&xi);
        let scale = by_series.amax().max(xi.norm());
        prop_assert!((exp(&xi).to_homogeneous() - by_series).amax() <= 1e-14 * scale);
    }

    #[test]
    fn left_jacobian_equals_its_series(xi in tangents()) {
        let by_series = left_jacobian_by_series(&xi);
        let allowed = 1e-13 * xi.norm().max(1.0);
        prop_assert!((left_jacobian(&xi) - by_series).amax() <= allowed);
        prop_assert!((right_jacobian(&-xi) - by_series).amax() <= allowed);
    }

    #[test]
    fn jacobian_inverses_are_inverses(xi in tangents()) {
        let allowed = 1e-13 * xi.norm().max(1.0);
        let identity = Matrix6::identity();
        prop_assert!((left_jacobian(&xi) * left_jacobian_inverse(&xi) - identity).amax() <= allowed);
        prop_assert!((right_jacobian_inverse(&xi) * right_jacobian(&xi) - identity).amax() <= allowed);
    }

    // The rotation comes back to a few eps (see so3). J_l and its inverse (norm at most pi / 2) each round t
    // by a few eps, and an error of phi turns t by as much: some 20 eps |xi|, even within 1e-14 of a half
    // turn.
    #[test]
    fn log_undoes_exp(xi in tangents()) {
        let back = log(&exp(&xi));
        prop_assert!((back - xi).norm() <= 1e-14 * xi.norm(), "{} {}", back, xi);
    }

    // Up to a half turn and beyond, where log takes the shorter way: as motions they agree.
    #[test]
    fn exp_undoes_log(a in poses(), b in poses()) {
        let pose = a * b;
        let back = exp(&log(&pose));
        let difference = (back.to_homogeneous() - pose.to_homogeneous()).amax();
        prop_assert!(difference <= 1e-14 * pose.translation.vector.norm().max(1.0));
    }

    #[test]
    fn one_parameter_subgroups(xi in tangents(), a in -1.0..1.0f64, b in -1.0..1.0f64) {
        let product = exp(&(xi * a)) * exp(&(xi * b));
        let whole = exp(&(xi * (a + b)));
        let allowed = 1e-14 * xi.norm().max(1.0);
        prop_assert!((product.to_homogeneous() - whole.to_homogeneous()).amax() <= allowed);
        let nowhere = exp(&xi) * exp(&-xi);
        prop_assert!((nowhere.to_homogeneous() - Matrix4::identity()).amax() <= allowed);
    }

    // The identity that defines the adjoint, for whole motions and not only to first order.
    #[test]
    fn adjoint_carries_motions(pose in poses(), xi in tangents()) {
        let conjugate = pose * exp(&xi) * pose.inverse();
        let carried = exp(&(adjoint(&pose) * xi));
        prop_assert!((conjugate.to_homogeneous() - carried.to_homogeneous()).amax() <= 1e-12);
    }

    #[test]
    fn adjoint_is_a_homomorphism(a in poses(), b in poses()) {
        let product = adjoint(&a) * adjoint(&b);
        prop_assert_eq!(agree(&adjoint(&(a * b)), &product, 1e-14), Ok(()));
        let back = adjoint(&a) * adjoint(&a.inverse());
        prop_assert!((back - Matrix6::identity()).amax() <= 1e-13);
    }

    // Fifth derivatives of Log are below 1e3 for |xi| <= 10, so the truncation is below 1e-13; rounding is
    // 2e-12 times
    // |xi|. Beyond a half turn minus the step, Log jumps: such xi are kept away.
    #[test]
    fn right_jacobians_equal_central_differences(mut xi in tangents()) {
        let angle = xi.fixed_rows::<3>(3).norm();
        if angle > 3.1 {
            xi *= 3.1 / angle;
        }
        let motion = exp(&xi);
        let of_log = numerical_jacobian(|d| log(&(motion * exp(d))));
        let of_exp = numerical_jacobian(|d| log(&(motion.inverse() * exp(&(xi + d)))));
        prop_assert_eq!(agree(&right_jacobian_inverse(&xi), &of_log, 1e-9), Ok(()));
        prop_assert_eq!(agree(&right_jacobian(&xi), &of_exp, 1e-9), Ok(()));
        let of_log_left = numerical_jacobian(|d| log(&(exp(d) * motion)));
        prop_assert_eq!(agree(&left_jacobian_inverse(&xi), &of_log_left, 1e-9), Ok(()));
    }
}

/// The comparison above must be able to fail: the left Jacobian is not the right one, and without the slopes
/// of the coefficients the coupling block is wrong.
#[test]
fn wrong_jacobians_are_told_from_right_ones() {
    let xi = Vector6::new(0.3, -0.2, 0.5, 0.4, 0.1, -0.6);
    let motion = exp(&xi);
    let numerical = numerical_jacobian(|d| log(&(motion * exp(d))));
    assert_eq!(agree(&right_jacobian_inverse(&xi), &numerical, 1e-9), Ok(()));
    assert!(agree(&left_jacobian_inverse(&xi), &numerical, 1e-9).is_err());

    let (rho, phi) = parts(&-xi);
    let e = coefficients::second_of_inverse(phi.norm_squared()).value;
    let without_slope = so3::hat(&rho) * -0.5 + anticommutator(&so3::hat(&phi), &so3::hat(&rho)) * e;
    let mut twin = right_jacobian_inverse(&xi);
    twin.fixed_view_mut::<3, 3>(0, 3).copy_from(&without_slope);
    assert!(agree(&twin, &numerical, 1e-9).is_err());
}
