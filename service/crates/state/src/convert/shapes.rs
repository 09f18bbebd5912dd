//! Poses, rotations, directions and covariances.

use crate::error::StateError;
use crate::error::translate::kernel;
use crate::limits::UNIT_TOLERANCE;
use nalgebra::{Isometry3, Matrix6, Quaternion, SMatrix, Translation3, UnitQuaternion, Vector3};
use pdn_kernel::gaussian;
use pdn_kernel::se3::Pose;
use pdn_schemas::shared::{Covariance6, Pose as WirePose};

/// No coordinate of the world lies farther from its origin, m: beyond it a double resolves no nanometre.
pub const MAX_COORDINATE_M: f64 = 1e7;

/// Refuses what is infinite or not a number.
pub fn finite(field: &str, value: f64) -> Result<f64, StateError> {
    if value.is_finite() { Ok(value) } else { Err(StateError::NotFinite { field: field.to_string(), value }) }
}

/// Refuses a list with an element that is infinite or not a number.
pub fn all_finite(field: &str, values: &[f64]) -> Result<(), StateError> {
    match values.iter().position(|value| !value.is_finite()) {
        Some(index) => finite(&format!("{field}[{index}]"), values[index]).map(drop),
        None => Ok(()),
    }
}

/// Refuses what is not finite, or not in a range that `holds` tests and `range` names.
pub fn within(field: &str, value: f64, range: &'static str, holds: bool) -> Result<f64, StateError> {
    finite(field, value)?;
    if holds { Ok(value) } else { Err(StateError::OutOfRange { field: field.to_string(), value, range }) }
}

/// Refuses what is not finite and above zero.
pub fn positive(field: &str, value: f64) -> Result<f64, StateError> {
    within(field, value, "above 0", value > 0.0)
}

/// Refuses what is not finite or negative.
pub fn not_negative(field: &str, value: f64) -> Result<f64, StateError> {
    within(field, value, "0 or above", value >= 0.0)
}

/// Refuses what is not in [0, 1].
pub fn share(field: &str, value: f64) -> Result<f64, StateError> {
    within(field, value, "in [0, 1]", (0.0..=1.0).contains(&value))
}

/// Refuses a list that is longer than its bound.
pub fn bounded(field: &str, count: usize, bound: &'static str, limit: usize) -> Result<(), StateError> {
    if count <= limit {
        return Ok(());
    }
    Err(StateError::TooLong { field: field.to_string(), count: count as u64, bound, limit: limit as u64 })
}

/// A refusal that no other kind describes.
pub fn invalid(field: &str, problem: String) -> StateError {
    StateError::Invalid { field: field.to_string(), problem }
}

/// A place or displacement, m.
pub fn point(field: &str, values: &[f64; 3]) -> Result<Vector3<f64>, StateError> {
    let holds = |value: &f64| value.abs() <= MAX_COORDINATE_M;
    if let Some(index) = values.iter().position(|value| !holds(value)) {
        within(&format!("{field}[{index}]"), values[index], "in [-1e7, 1e7] m", false)?;
    }
    Ok(Vector3::from(*values))
}

/// A unit vector, normalised.
pub fn direction(field: &str, values: &[f64; 3]) -> Result<Vector3<f64>, StateError> {
    unit_norm(field, values)?;
    Ok(Vector3::from(*values).normalize())
}

/// A unit quaternion `[x, y, z, w]`, normalised.
pub fn rotation(field: &str, values: &[f64; 4]) -> Result<UnitQuaternion<f64>, StateError> {
    unit_norm(field, values)?;
    let [x, y, z, w] = *values;
    Ok(UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)))
}

/// A rigid transform.
pub fn pose(field: &str, pose: &WirePose) -> Result<Pose, StateError> {
    let translation = point(&format!("{field}.translation"), &pose.translation)?;
    let rotation = rotation(&format!("{field}.rotation"), &pose.rotation)?;
    Ok(Isometry3::from_parts(Translation3::from(translation), rotation))
}

/// A covariance given row by row: finite, symmetric, positive definite.
pub fn covariance<const D: usize>(field: &str, values: &[f64]) -> Result<SMatrix<f64, D, D>, StateError> {
    all_finite(field, values)?;
    let covariance = SMatrix::<f64, D, D>::from_row_slice(values);
    gaussian::validate(&covariance).map_err(|error| kernel(field, error))?;
    Ok(covariance)
}

/// A transform as it goes on the wire.
pub fn wire_pose(pose: &Pose) -> WirePose {
    WirePose { translation: pose.translation.vector.into(), rotation: pose.rotation.coords.into() }
}

/// A covariance as it goes on the wire, row by row.
pub fn wire_covariance(covariance: &Matrix6<f64>) -> Covariance6 {
    let mut values = [0.0; 36];
    for (index, value) in values.iter_mut().enumerate() {
        *value = covariance[(index / 6, index % 6)];
    }
    Covariance6(values)
}

fn unit_norm(field: &str, values: &[f64]) -> Result<(), StateError> {
    all_finite(field, values)?;
    let norm = values.iter().map(|value| value * value).sum::<f64>().sqrt();
    if (norm - 1.0).abs() > UNIT_TOLERANCE {
        return Err(StateError::NotUnit { field: field.to_string(), norm, tolerance: UNIT_TOLERANCE });
    }
    Ok(())
}
