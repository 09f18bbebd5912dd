use nalgebra::{Matrix6, Vector6};

use crate::se3::{self, Pose};

/// A pose known beforehand: r = Log(Z^-1 X).
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PriorMeasurement {
    pub world_from_body: Pose,
}

impl PriorMeasurement {
    pub fn residual(&self, pose: &Pose) -> Vector6<f64> {
        se3::log(&(self.world_from_body.inverse() * pose))
    }

    /// Log(Exp(r) Exp(xi)) = r + J_r^-1(r) xi.
    pub fn jacobian(&self, pose: &Pose) -> Matrix6<f64> {
        se3::right_jacobian_inverse(&self.residual(pose))
    }
}
