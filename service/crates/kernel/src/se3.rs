//! Rigid-body motions: exponential, logarithm, adjoint and Jacobians of SE(3).
//!
//! Tangent vectors are xi = [rho (3, m); phi (3, rad)], translation first \[SDA18\]. The Jacobians are
//! closed forms built on one observation: the block that couples translation with rotation is the directional
//! derivative, along rho, of the corresponding Jacobian of SO(3) at phi.

use nalgebra::{Isometry3, Matrix3, Matrix6, Translation3, Vector3, Vector6};

use crate::{so3, so3_coefficients as coefficients};

/// A pose or a relative pose, such as `world_from_body`.
pub type Pose = Isometry3<f64>;

/// The motion reached after unit time with the constant body velocity [rho; phi]: translation J_l(phi) rho,
/// rotation Exp(phi).
///
/// ```
/// use nalgebra::{Vector3, Vector6};
/// use std::f64::consts::{FRAC_PI_2, PI};
/// // A quarter circle of length 1 to the right ends 2 / pi ahead and 2 / pi to the right.
/// let arc = pdn_kernel::se3::exp(&Vector6::new(1.0, 0.0, 0.0, 0.0, 0.0, FRAC_PI_2));
/// assert!((arc.translation.vector - Vector3::new(2.0 / PI, 2.0 / PI, 0.0)).norm() < 1e-15);
/// ```
pub fn exp(xi: &Vector6<f64>) -> Pose {
    let (rho, phi) = parts(xi);
    Pose::from_parts(Translation3::from(so3::left_jacobian(&phi) * rho), so3::exp(&phi))
}

/// The tangent vector of a motion, with a rotation of at most pi: rho = J_l^-1(phi) t, phi = Log(R).
pub fn log(pose: &Pose) -> Vector6<f64> {
    let phi = so3::log(&pose.rotation);
    join(&(so3::left_jacobian_inverse(&phi) * pose.translation.vector), &phi)
}

/// Ad(X) = [[R, hat(t) R], [0, R]], with X Exp(xi) X^-1 = Exp(Ad(X) xi).
///
/// ```
/// use nalgebra::{Matrix6, Vector3, Vector6};
/// use pdn_kernel::se3::{self, Pose};
/// assert_eq!(se3::adjoint(&Pose::identity()), Matrix6::identity());
/// // Turning about a body two metres ahead moves the place one stands at sideways.
/// let ahead = Pose::translation(2.0, 0.0, 0.0);
/// let turned = se3::adjoint(&ahead) * Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 1.0);
/// assert_eq!(turned, Vector6::new(0.0, -2.0, 0.0, 0.0, 0.0, 1.0));
/// ```
pub fn adjoint(pose: &Pose) -> Matrix6<f64> {
    let rotation = pose.rotation.to_rotation_matrix().into_inner();
    blocks(&rotation, &(so3::hat(&pose.translation.vector) * rotation), &rotation)
}

/// J_l with Exp(xi + d) = Exp(J_l(xi) d) Exp(xi) to first order in d: [[J, D], [0, J]], J the left Jacobian
/// of SO(3) at phi and D its derivative along rho,
/// D = b hat(rho) + c (hat(phi) hat(rho) + hat(rho) hat(phi)) + (phi . rho) (b' hat(phi) + c' hat(phi)^2),
/// b = (1 - cos theta) / theta^2, c = (theta - sin theta) / theta^3,
/// and ' the derivative by theta over theta.
pub fn left_jacobian(xi: &Vector6<f64>) -> Matrix6<f64> {
    let (rho, phi) = parts(xi);
    let s = phi.norm_squared();
    let (first, second) = (coefficients::first(s), coefficients::second(s));
    let (hat_rho, hat_phi) = (so3::hat(&rho), so3::hat(&phi));
    let along = phi.dot(&rho);
    let derivative = hat_rho * first.value
        + anticommutator(&hat_phi, &hat_rho) * second.value
        + (hat_phi * first.slope + hat_phi * hat_phi * second.slope) * along;
    let jacobian = so3::left_jacobian(&phi);
    blocks(&jacobian, &derivative, &jacobian)
}

/// The inverse of [`left_jacobian`]: [[K, E], [0, K]], K the inverse left Jacobian of SO(3) at phi and E its
/// derivative along rho,
/// E = -hat(rho) / 2 + e (hat(phi) hat(rho) + hat(rho) hat(phi)) + (phi . rho) e' hat(phi)^2,
/// e = (1 - x cot x) / theta^2, x = theta / 2. Regular for theta < 2 pi.
pub fn left_jacobian_inverse(xi: &Vector6<f64>) -> Matrix6<f64> {
    let (rho, phi) = parts(xi);
    let second = coefficients::second_of_inverse(phi.norm_squared());
    let (hat_rho, hat_phi) = (so3::hat(&rho), so3::hat(&phi));
    let derivative = hat_rho * -0.5
        + anticommutator(&hat_phi, &hat_rho) * second.value
        + hat_phi * hat_phi * (second.slope * phi.dot(&rho));
    let jacobian = so3::left_jacobian_inverse(&phi);
    blocks(&jacobian, &derivative, &jacobian)
}

/// J_r(xi) = J_l(-xi), with Exp(xi + d) = Exp(xi) Exp(J_r(xi) d) to first order in d.
pub fn right_jacobian(xi: &Vector6<f64>) -> Matrix6<f64> {
    left_jacobian(&-xi)
}

/// The inverse of [`right_jacobian`]: Log(Exp(xi) Exp(d)) = xi + J_r^-1(xi) d to first order in d.
pub fn right_jacobian_inverse(xi: &Vector6<f64>) -> Matrix6<f64> {
    left_jacobian_inverse(&-xi)
}

/// Splits xi into (rho, phi).
pub(crate) fn parts(xi: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (xi.fixed_rows::<3>(0).into_owned(), xi.fixed_rows::<3>(3).into_owned())
}

/// Joins rho and phi to xi.
pub(crate) fn join(rho: &Vector3<f64>, phi: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(rho.x, rho.y, rho.z, phi.x, phi.y, phi.z)
}

/// [[translation, coupling], [0, rotation]].
fn blocks(translation: &Matrix3<f64>, coupling: &Matrix3<f64>, rotation: &Matrix3<f64>) -> Matrix6<f64> {
    let mut matrix = Matrix6::zeros();
    matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(translation);
    matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(coupling);
    matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(rotation);
    matrix
}

/// a b + b a.
fn anticommutator(a: &Matrix3<f64>, b: &Matrix3<f64>) -> Matrix3<f64> {
    a * b + b * a
}

#[cfg(test)]
mod tests;
