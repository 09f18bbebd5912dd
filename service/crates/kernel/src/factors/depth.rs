use nalgebra::{Matrix6, Vector3, Vector6};

use crate::se3::Pose;

/// Depth below the world's origin: r = t_z - z.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct DepthMeasurement {
    pub depth_m: f64,
}

impl DepthMeasurement {
    pub fn residual(&self, pose: &Pose) -> Vector6<f64> {
        Vector6::new(pose.translation.z - self.depth_m, 0.0, 0.0, 0.0, 0.0, 0.0)
    }

    /// t moves by R rho: the third row of R on rho.
    pub fn jacobian(&self, pose: &Pose) -> Matrix6<f64> {
        let down_in_body = pose.rotation.inverse() * Vector3::z();
        let mut jacobian = Matrix6::zeros();
        jacobian.fixed_view_mut::<1, 3>(0, 0).copy_from(&down_in_body.transpose());
        jacobian
    }
}
