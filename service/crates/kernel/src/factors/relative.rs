use nalgebra::{Matrix6, Vector6};

use crate::se3::{self, Pose};

/// The relative pose of two bodies, odometry or not: r = Log(Z^-1 X_i^-1 X_j).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct RelativeMeasurement {
    /// Maps the second body's frame into the first's.
    pub relative: Pose,
}

impl RelativeMeasurement {
    pub fn residual(&self, first: &Pose, second: &Pose) -> Vector6<f64> {
        se3::log(&(self.relative.inverse() * (first.inverse() * second)))
    }

    /// J_j = J_r^-1(r). A perturbation of X_i acts as Exp(-xi) on the left of X_i^-1 X_j, that is as
    /// Exp(-Ad((X_i^-1 X_j)^-1) xi) on its right: J_i = -J_r^-1(r) Ad((X_i^-1 X_j)^-1).
    pub fn jacobians(&self, first: &Pose, second: &Pose) -> [Matrix6<f64>; 2] {
        let on_second = se3::right_jacobian_inverse(&self.residual(first, second));
        let second_from_first = second.inverse() * first;
        [-(on_second * se3::adjoint(&second_from_first)), on_second]
    }
}
