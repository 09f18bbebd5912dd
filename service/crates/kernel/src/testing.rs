//! What the tests of this crate share: random motions that include the awkward ones, and numerical Jacobians.

use std::f64::consts::PI;

use nalgebra::{Matrix6, SMatrix, UnitVector3, Vector3, Vector6};
use proptest::prelude::*;

use crate::se3::{self, Pose};

/// Unit vectors, among them the coordinate axes.
pub(crate) fn directions() -> impl Strategy<Value = Vector3<f64>> {
    let any = (-1.0..1.0f64, -PI..PI).prop_map(|(height, angle)| {
        let radius = (1.0 - height * height).sqrt();
        Vector3::new(radius * angle.cos(), radius * angle.sin(), height)
    });
    let axes = (0..3usize, prop::bool::ANY).prop_map(|(axis, negative)| {
        let mut direction = Vector3::zeros();
        direction[axis] = if negative { -1.0 } else { 1.0 };
        direction
    });
    prop_oneof![4 => any, 1 => axes].prop_map(|direction| UnitVector3::new_normalize(direction).into_inner())
}

/// Rotation vectors shorter than pi, among them zero, nearly zero, where series hand over, and nearly pi.
pub(crate) fn rotation_vectors() -> impl Strategy<Value = Vector3<f64>> {
    let angles = prop_oneof![
        6 => 0.0..PI,
        1 => Just(0.0),
        2 => (-18.0..-1.0f64).prop_map(|exponent| 10f64.powf(exponent)),
        1 => 0.499..0.501f64,
        2 => (-14.0..-1.0f64).prop_map(|exponent| PI - 10f64.powf(exponent)),
    ];
    (directions(), angles).prop_map(|(direction, angle)| direction * angle)
}

/// Tangent vectors with a translation of up to 10 m.
pub(crate) fn tangents() -> impl Strategy<Value = Vector6<f64>> {
    (directions(), 0.0..10.0f64, rotation_vectors())
        .prop_map(|(direction, length, phi)| se3::join(&(direction * length), &phi))
}

/// Poses of vehicles, among them level ones that head nearly south (heading near +-pi).
pub(crate) fn poses() -> impl Strategy<Value = Pose> {
    let south = (tangents(), -1e-6..1e-6f64).prop_map(|(xi, beyond)| {
        Pose::new(xi.fixed_rows::<3>(0).into_owned(), Vector3::new(0.0, 0.0, PI + beyond))
    });
    prop_oneof![3 => tangents().prop_map(|xi| se3::exp(&xi)), 1 => south]
}

/// Covariances L D L^T with sigmas from 1e-3 to 10 and correlations that leave a condition below 1e3 after
/// scaling.
pub(crate) fn covariances<const D: usize>() -> impl Strategy<Value = SMatrix<f64, D, D>> {
    (prop::collection::vec(-0.5..0.5f64, D * D), prop::collection::vec(-3.0..1.0f64, D)).prop_map(
        |(entries, exponents)| {
            let mut lower = SMatrix::<f64, D, D>::identity();
            for row in 0..D {
                for column in 0..row {
                    lower[(row, column)] = entries[row * D + column];
                }
            }
            let sigmas =
                SMatrix::<f64, D, D>::from_fn(
                    |row, column| {
                        if row == column { 10f64.powf(exponents[row]) } else { 0.0 }
                    },
                );
            let root = sigmas * lower;
            root * root.transpose()
        },
    )
}

/// The Jacobian at 0 of a function of a tangent vector, by central differences of fourth order:
/// (8 (f(h) - f(-h)) - (f(2h) - f(-2h))) / 12 h.
///
/// With h = 2e-4 its own error is h^4 / 30 = 5e-17 fifth derivatives and about 1.5 eps / h = 2e-12 values.
pub(crate) fn numerical_jacobian(function: impl Fn(&Vector6<f64>) -> Vector6<f64>) -> Matrix6<f64> {
    let h = 2e-4;
    let mut jacobian = Matrix6::zeros();
    for column in 0..6 {
        let at = |steps: f64| {
            let mut xi = Vector6::zeros();
            xi[column] = steps * h;
            function(&xi)
        };
        let slope = ((at(1.0) - at(-1.0)) * 8.0 - (at(2.0) - at(-2.0))) / (12.0 * h);
        jacobian.set_column(column, &slope);
    }
    jacobian
}

/// Whether two matrices agree within `tolerance` times the greatest entry of the first, or 1 if that is
/// smaller; else says where they do not.
pub(crate) fn agree<const R: usize, const C: usize>(
    analytic: &SMatrix<f64, R, C>,
    other: &SMatrix<f64, R, C>,
    tolerance: f64,
) -> Result<(), String> {
    let allowed = tolerance * analytic.amax().max(1.0);
    for row in 0..R {
        for column in 0..C {
            let difference = analytic[(row, column)] - other[(row, column)];
            if difference.is_nan() || difference.abs() > allowed {
                return Err(format!(
                    "entry ({row}, {column}) differs by {difference:e}, allowed {allowed:e}"
                ));
            }
        }
    }
    Ok(())
}
