//! What a measurement that has not been made yet will tell: its expected information, J^T Sigma^-1 J at zero
//! residual.
//!
//! The planner adds these blocks for the keyframes of a path that the vehicle has not travelled (`[PDN12, eq.
//! 1, 3, 4]`).

use nalgebra::{Matrix3, Matrix5, Matrix6, Vector3};

use crate::factors::camera::CameraMeasurement;
use crate::factors::relative::RelativeMeasurement;
use crate::{KernelError, se3, se3::Pose};

/// Cameras nearer to each other than this see no direction: a vehicle cannot tell its place to a micrometre.
const SMALLEST_BASELINE_M: f64 = 1e-6;

/// The information that one measurement adds on two poses: [[first, cross], [cross^T, second]].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PairInformation {
    /// On the first pose alone.
    pub first: Matrix6<f64>,
    /// Between the first pose (rows) and the second (columns).
    pub cross: Matrix6<f64>,
    /// On the second pose alone.
    pub second: Matrix6<f64>,
}

impl PairInformation {
    /// J^T J from the whitened Jacobians of both poses (rows: residual, columns: tangent vector).
    pub fn from_jacobians(first: &Matrix6<f64>, second: &Matrix6<f64>) -> Self {
        Self { first: first.tr_mul(first), cross: first.tr_mul(second), second: second.tr_mul(second) }
    }

    /// The same information with the two poses exchanged.
    pub fn exchanged(&self) -> Self {
        Self { first: self.second, cross: self.cross.transpose(), second: self.first }
    }
}

/// Expected information of a camera registration between two poses; rows and columns of
/// `square_root_information`: two direction components, three of rotation, as in [`crate::factors`]. `first`
/// is m, `second` is i.
///
/// Errors: `DegenerateBaseline` when the cameras coincide (within a micrometre).
pub fn camera(
    world_from_body_m: &Pose,
    body_from_camera_m: &Pose,
    world_from_body_i: &Pose,
    body_from_camera_i: &Pose,
    square_root_information: &Matrix5<f64>,
) -> Result<PairInformation, KernelError> {
    let camera_m_from_camera_i =
        (world_from_body_m * body_from_camera_m).inverse() * (world_from_body_i * body_from_camera_i);
    let baseline_m = camera_m_from_camera_i.translation.vector.norm();
    if baseline_m.is_nan() || baseline_m < SMALLEST_BASELINE_M {
        return Err(KernelError::DegenerateBaseline { baseline_m, min_baseline_m: SMALLEST_BASELINE_M });
    }
    let measurement = CameraMeasurement::new(
        body_from_camera_m,
        body_from_camera_i,
        &(camera_m_from_camera_i.translation.vector / baseline_m),
        &camera_m_from_camera_i.rotation,
    );
    let [first, second] = measurement.jacobians(world_from_body_m, world_from_body_i);
    let mut whitening = Matrix6::zeros();
    whitening.fixed_view_mut::<5, 5>(0, 0).copy_from(square_root_information);
    Ok(PairInformation::from_jacobians(&(whitening * first), &(whitening * second)))
}

/// Expected information of odometry from one pose to the next: J_second = I, J_first = -Ad((X_from^-1
/// X_to)^-1) (`[PDN12, eq. 1]`).
pub fn odometry(
    world_from_body_from: &Pose,
    world_from_body_to: &Pose,
    square_root_information: &Matrix6<f64>,
) -> PairInformation {
    let relative = world_from_body_from.inverse() * world_from_body_to;
    let measurement = RelativeMeasurement { relative };
    let [first, second] = measurement.jacobians(world_from_body_from, world_from_body_to);
    PairInformation::from_jacobians(&(square_root_information * first), &(square_root_information * second))
}

/// Expected information of an attitude sensor: R^T diag(tilt^-2, tilt^-2, heading^-2) R on phi, since the
/// errors stand in world axes. Sigmas in radians; `None`: the heading is not observed, its row is left out.
///
/// ```
/// use nalgebra::Matrix3;
/// let level = pdn_kernel::se3::Pose::identity();
/// let information = pdn_kernel::information::attitude(&level, 0.5, Some(0.25));
/// assert_eq!(information.fixed_view::<3, 3>(3, 3), Matrix3::from_diagonal(&[4.0, 4.0, 16.0].into()));
/// assert_eq!(information.fixed_view::<3, 3>(0, 0), Matrix3::zeros());
/// ```
pub fn attitude(world_from_body: &Pose, tilt_sigma: f64, heading_sigma: Option<f64>) -> Matrix6<f64> {
    let rotation = world_from_body.rotation.to_rotation_matrix().into_inner();
    let tilt = 1.0 / (tilt_sigma * tilt_sigma);
    let heading = heading_sigma.map_or(0.0, |sigma| 1.0 / (sigma * sigma));
    let in_world = Matrix3::from_diagonal(&Vector3::new(tilt, tilt, heading));
    let mut information = Matrix6::zeros();
    information.fixed_view_mut::<3, 3>(3, 3).copy_from(&(rotation.transpose() * in_world * rotation));
    information
}

/// Expected information of a depth sensor: sigma^-2 h^T h with h the third row of R, on rho. Sigma in metres.
///
/// ```
/// let level = pdn_kernel::se3::Pose::identity();
/// let information = pdn_kernel::information::depth(&level, 0.5);
/// assert_eq!(information[(2, 2)], 4.0);
/// assert_eq!(information.sum(), 4.0);
/// ```
pub fn depth(world_from_body: &Pose, sigma: f64) -> Matrix6<f64> {
    let down_in_body = world_from_body.rotation.inverse() * Vector3::z();
    let row = se3::join(&(down_in_body / sigma), &Vector3::zeros());
    row * row.transpose()
}
