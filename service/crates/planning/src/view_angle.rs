//! How much the views of two cameras differ: the angle between their optical axes.

use nalgebra::Vector3;
use pdn_kernel::se3::Pose;

/// Far above what rounding does to a cosine.
const COSINE_ROUNDING: f64 = 1e-9;

/// Optical axis of a camera in the world, a unit vector.
pub(crate) fn optical_axis(world_from_camera: &Pose) -> Vector3<f64> {
    world_from_camera.rotation * Vector3::z()
}

/// By how much optical axes may differ.
pub(crate) struct AngleLimit {
    limit_rad: f64,
    cosine: f64,
}

impl AngleLimit {
    pub(crate) fn new(limit_rad: f64) -> AngleLimit {
        AngleLimit { limit_rad, cosine: limit_rad.min(std::f64::consts::PI).cos() }
    }

    /// Whether two unit vectors differ by it at most. The cosine tells without the angle, unless it is near
    /// the limit's.
    pub(crate) fn admits(&self, axis: &Vector3<f64>, other: &Vector3<f64>) -> bool {
        let inside = axis.dot(other) - self.cosine;
        if inside.abs() > COSINE_ROUNDING { inside > 0.0 } else { angle_rad(axis, other) <= self.limit_rad }
    }
}

/// Angle between two unit vectors, rad in [0, pi]; exact also for small angles.
fn angle_rad(axis: &Vector3<f64>, other: &Vector3<f64>) -> f64 {
    axis.cross(other).norm().atan2(axis.dot(other))
}
