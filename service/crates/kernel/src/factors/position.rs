use nalgebra::{Matrix6, Vector3, Vector6};

use crate::se3::{self, Pose};

/// The place of the body in the world: r = t - z, world axes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PositionMeasurement {
    pub position_in_world: Vector3<f64>,
}

impl PositionMeasurement {
    pub fn residual(&self, pose: &Pose) -> Vector6<f64> {
        se3::join(&(pose.translation.vector - self.position_in_world), &Vector3::zeros())
    }

    /// t moves by R rho.
    pub fn jacobian(&self, pose: &Pose) -> Matrix6<f64> {
        let mut jacobian = Matrix6::zeros();
        jacobian.fixed_view_mut::<3, 3>(0, 0).copy_from(pose.rotation.to_rotation_matrix().matrix());
        jacobian
    }
}
