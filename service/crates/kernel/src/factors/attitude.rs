use nalgebra::{Matrix6, UnitQuaternion, Vector6};

use crate::se3::Pose;
use crate::so3;

/// The orientation in the world: r = Log(R Z^T), in world axes: tilt about x and y (north and east), then
/// heading.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct AttitudeMeasurement {
    pub world_from_body: UnitQuaternion<f64>,
}

impl AttitudeMeasurement {
    pub fn residual(&self, pose: &Pose) -> Vector6<f64> {
        let error = so3::log(&(pose.rotation * self.world_from_body.inverse()));
        Vector6::new(error.x, error.y, error.z, 0.0, 0.0, 0.0)
    }

    /// R Exp(phi) Z^T = Exp(R phi) R Z^T, so dr/dphi = J_l^-1(r) R.
    pub fn jacobian(&self, pose: &Pose) -> Matrix6<f64> {
        let error = self.residual(pose).fixed_rows::<3>(0).into_owned();
        let rotation = pose.rotation.to_rotation_matrix().into_inner();
        let mut jacobian = Matrix6::zeros();
        jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(&(so3::left_jacobian_inverse(&error) * rotation));
        jacobian
    }
}
