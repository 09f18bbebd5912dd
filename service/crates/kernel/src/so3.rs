//! Rotations: exponential, logarithm and Jacobians of SO(3). Vectors are rotation vectors, radians.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

use crate::so3_coefficients as coefficients;

/// The cross-product matrix: `hat(a) * b = a x b`.
pub fn hat(a: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0)
}

/// The rotation by the angle |phi| about the axis phi / |phi|: q = [cos(theta / 2), sin(theta / 2) phi /
/// theta].
///
/// ```
/// use nalgebra::Vector3;
/// use std::f64::consts::FRAC_PI_2;
/// let quarter_turn_right = pdn_kernel::so3::exp(&Vector3::new(0.0, 0.0, FRAC_PI_2));
/// assert!((quarter_turn_right * Vector3::x() - Vector3::y()).norm() < 1e-15);
/// ```
pub fn exp(phi: &Vector3<f64>) -> UnitQuaternion<f64> {
    let theta_squared = phi.norm_squared();
    let half = 0.5 * theta_squared.sqrt();
    // sin(half) / theta; its series is exact to the last bit below theta^2 = 1e-4 (next term 4e-18).
    let scale = if theta_squared < 1e-4 {
        0.5 - theta_squared / 48.0 + theta_squared * theta_squared / 3840.0
    } else {
        half.sin() / (2.0 * half)
    };
    UnitQuaternion::new_normalize(Quaternion::from_parts(half.cos(), phi * scale))
}

/// The rotation vector of a rotation, of length at most pi; the inverse of [`exp`] for angles below pi.
///
/// theta = 2 atan2(|v|, |w|) of the quaternion [w, v], which keeps its full relative precision near 0 and
/// near pi. Of the two vectors of a half turn it returns the one whose first component that is not zero is
/// positive.
pub fn log(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    let w = rotation.w;
    let v = rotation.imag();
    let norm = v.norm();
    // atan2(n, |w|) / n -> 1 / |w| for n -> 0; the next term of the series is n^2 / 3 < 1e-17 relative here.
    let scale = if norm < 4e-9 { 2.0 / w.abs() } else { 2.0 * norm.atan2(w.abs()) / norm };
    let flipped = if w == 0.0 {
        v.iter().find(|component| **component != 0.0).is_some_and(|component| *component < 0.0)
    } else {
        w < 0.0
    };
    v * if flipped { -scale } else { scale }
}

/// J_l with Exp(phi + d) = Exp(J_l(phi) d) Exp(phi) to first order in d.
///
/// J_l = I + (1 - cos theta) / theta^2 hat(phi) + (theta - sin theta) / theta^3 hat(phi)^2, by series near
/// zero.
pub fn left_jacobian(phi: &Vector3<f64>) -> Matrix3<f64> {
    let s = phi.norm_squared();
    let hat = hat(phi);
    Matrix3::identity() + hat * coefficients::first(s).value + hat * hat * coefficients::second(s).value
}

/// The inverse of [`left_jacobian`]: I - hat(phi) / 2 + (1 - x cot x) / theta^2 hat(phi)^2, x = theta / 2;
/// regular for theta < 2 pi, so at every result of [`log`]. Log(Exp(d) Exp(phi)) = phi + J_l^-1(phi) d to
/// first order in d.
pub fn left_jacobian_inverse(phi: &Vector3<f64>) -> Matrix3<f64> {
    let hat = hat(phi);
    Matrix3::identity() - hat * 0.5 + hat * hat * coefficients::second_of_inverse(phi.norm_squared()).value
}

/// J_r(phi) = J_l(-phi), with Exp(phi + d) = Exp(phi) Exp(J_r(phi) d) to first order in d.
pub fn right_jacobian(phi: &Vector3<f64>) -> Matrix3<f64> {
    left_jacobian(&-phi)
}

/// The inverse of [`right_jacobian`]: Log(Exp(phi) Exp(d)) = phi + J_r^-1(phi) d to first order in d.
pub fn right_jacobian_inverse(phi: &Vector3<f64>) -> Matrix3<f64> {
    left_jacobian_inverse(&-phi)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use proptest::prelude::*;

    use super::*;
    use crate::testing::{agree, rotation_vectors};

    /// Sum of hat(phi)^k / (k + offset)!, the definition of Exp (offset 0) and of J_l (offset 1). For angles
    /// up to pi the terms stay below 6 and the last of 40 below 1e-27.
    fn power_series(phi: &Vector3<f64>, offset: u32) -> Matrix3<f64> {
        let mut term = Matrix3::identity();
        let mut sum = term;
        for k in 1..40 {
            term = hat(phi) * term / f64::from(k + offset);
            sum += term;
        }
        sum
    }

    proptest! {
        // The series rounds terms of up to 6, so its own error is some 20 eps.
        #[test]
        fn closed_forms_equal_the_series(phi in rotation_vectors()) {
            let rotation = exp(&phi).to_rotation_matrix().into_inner();
            prop_assert_eq!(agree(&rotation, &power_series(&phi, 0), 1e-14), Ok(()));
            prop_assert_eq!(agree(&left_jacobian(&phi), &power_series(&phi, 1), 1e-14), Ok(()));
            let right = power_series(&-phi, 1);
            prop_assert_eq!(agree(&right_jacobian(&phi), &right, 1e-14), Ok(()));
        }

        // Half the angle is rounded once and its cosine near pi inherits 2e-16 absolute: some eps of the
        // angle. The tolerance is relative to |phi| even for |phi| = 1e-18.
        #[test]
        fn log_undoes_exp_to_the_last_digits(phi in rotation_vectors()) {
            let back = log(&exp(&phi));
            prop_assert!((back - phi).norm() <= 8.0 * f64::EPSILON * phi.norm(), "{} {}", back, phi);
        }

        // A quaternion and its negative are the same rotation.
        #[test]
        fn log_does_not_see_the_sign_of_the_quaternion(phi in rotation_vectors()) {
            let rotation = exp(&phi);
            let negative = UnitQuaternion::new_unchecked(-rotation.into_inner());
            prop_assert_eq!(log(&rotation), log(&negative));
        }

        // |J_l^-1| <= pi / 2 up to a half turn, so both products round some 10 eps.
        #[test]
        fn inverses_are_inverses(phi in rotation_vectors()) {
            let left = left_jacobian(&phi) * left_jacobian_inverse(&phi);
            let right = right_jacobian_inverse(&phi) * right_jacobian(&phi);
            prop_assert_eq!(agree(&left, &Matrix3::identity(), 1e-14), Ok(()));
            prop_assert_eq!(agree(&right, &Matrix3::identity(), 1e-14), Ok(()));
        }

        // Exp(J_l phi-scaled) laws: a rotation leaves its own axis alone, so all Jacobians do.
        #[test]
        fn the_axis_is_an_eigenvector(phi in rotation_vectors()) {
            for jacobian in [left_jacobian(&phi), right_jacobian(&phi), left_jacobian_inverse(&phi)] {
                prop_assert!((jacobian * phi - phi).norm() <= 8.0 * f64::EPSILON * phi.norm());
            }
        }
    }

    #[test]
    fn a_half_turn_has_one_logarithm() {
        for axis in [Vector3::x(), Vector3::y(), Vector3::z(), Vector3::new(0.0, 0.6, -0.8)] {
            for sign in [1.0, -1.0] {
                let half_turn = UnitQuaternion::new_unchecked(Quaternion::from_parts(0.0, axis * sign));
                assert!((log(&half_turn) - axis * PI).norm() <= 2.0 * f64::EPSILON * PI);
            }
        }
    }
}
