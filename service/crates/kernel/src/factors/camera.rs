use nalgebra::{Matrix2x3, Matrix3, Matrix6, RowVector3, UnitQuaternion, Vector3, Vector6};

use crate::se3::{self, Pose};
use crate::so3;

/// A registration of two cameras, which tells rotation and direction of their baseline, not its length.
///
/// With T = C_i^-1 C_j, C = X * body_from_camera, u = t / |t| and the measured direction z and rotation Z:
/// r = [b1.u; b2.u; Log(Z^T R)]. The basis (b1, b2) of the plane normal to z has no singular direction: with
/// e_a the coordinate axis of smallest |z_a| (the lowest on a tie), b1 = normalize(z x e_a) and b2 = z x b1.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct CameraMeasurement {
    camera_from_body: [Pose; 2],
    /// Rows b1, b2.
    basis: Matrix2x3<f64>,
    rotation: UnitQuaternion<f64>,
}

impl CameraMeasurement {
    /// `direction` and `rotation` must be of unit length.
    pub fn new(
        first_body_from_camera: &Pose,
        second_body_from_camera: &Pose,
        direction: &Vector3<f64>,
        rotation: &UnitQuaternion<f64>,
    ) -> Self {
        Self {
            camera_from_body: [first_body_from_camera.inverse(), second_body_from_camera.inverse()],
            basis: tangent_basis(direction),
            rotation: *rotation,
        }
    }

    /// |t|, the distance between the two cameras.
    pub fn baseline_m(&self, first: &Pose, second: &Pose) -> f64 {
        self.first_camera_from_second(first, second).translation.vector.norm()
    }

    pub fn residual(&self, first: &Pose, second: &Pose) -> Vector6<f64> {
        let relative = self.first_camera_from_second(first, second);
        let direction = self.basis * relative.translation.vector.normalize();
        let rotation = so3::log(&(self.rotation.inverse() * relative.rotation));
        Vector6::new(direction.x, direction.y, rotation.x, rotation.y, rotation.z, 0.0)
    }

    /// In the cameras' own perturbations eta = Ad(camera_from_body) xi, the second moves T by dt = R rho and
    /// the first by dt = -rho + hat(t) phi; du = (I - u u^T) dt / |t|. The rotation part is J_r^-1(e) phi for
    /// the second and -J_r^-1(e) R^T phi for the first, e = Log(Z^T R).
    pub fn jacobians(&self, first: &Pose, second: &Pose) -> [Matrix6<f64>; 2] {
        let relative = self.first_camera_from_second(first, second);
        let baseline = relative.translation.vector;
        let rotation = relative.rotation.to_rotation_matrix().into_inner();
        let unit = baseline.normalize();
        let direction_by_baseline =
            self.basis * (Matrix3::identity() - unit * unit.transpose()) / baseline.norm();
        let rotation_by_second =
            so3::right_jacobian_inverse(&so3::log(&(self.rotation.inverse() * relative.rotation)));
        let by_first_camera = rows(
            &-direction_by_baseline,
            &(direction_by_baseline * so3::hat(&baseline)),
            &-(rotation_by_second * rotation.transpose()),
        );
        let by_second_camera =
            rows(&(direction_by_baseline * rotation), &Matrix2x3::zeros(), &rotation_by_second);
        [
            by_first_camera * se3::adjoint(&self.camera_from_body[0]),
            by_second_camera * se3::adjoint(&self.camera_from_body[1]),
        ]
    }

    fn first_camera_from_second(&self, first: &Pose, second: &Pose) -> Pose {
        let [first_camera_from_body, second_camera_from_body] = &self.camera_from_body;
        first_camera_from_body * (first.inverse() * second) * second_camera_from_body.inverse()
    }
}

/// Rows b1, b2: an orthonormal basis of the plane normal to the unit vector z.
pub(crate) fn tangent_basis(z: &Vector3<f64>) -> Matrix2x3<f64> {
    let mut axis = 0;
    for candidate in 1..3 {
        if z[candidate].abs() < z[axis].abs() {
            axis = candidate;
        }
    }
    let mut along = Vector3::zeros();
    along[axis] = 1.0;
    let first = z.cross(&along).normalize();
    let second = z.cross(&first);
    Matrix2x3::from_rows(&[RowVector3::from(first.transpose()), RowVector3::from(second.transpose())])
}

fn rows(
    direction_by_rho: &Matrix2x3<f64>,
    direction_by_phi: &Matrix2x3<f64>,
    rotation_by_phi: &Matrix3<f64>,
) -> Matrix6<f64> {
    let mut jacobian = Matrix6::zeros();
    jacobian.fixed_view_mut::<2, 3>(0, 0).copy_from(direction_by_rho);
    jacobian.fixed_view_mut::<2, 3>(0, 3).copy_from(direction_by_phi);
    jacobian.fixed_view_mut::<3, 3>(2, 3).copy_from(rotation_by_phi);
    jacobian
}
