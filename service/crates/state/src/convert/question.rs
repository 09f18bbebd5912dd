//! Questions on their way in: assumptions, and paths that a person drew.

use super::shapes::{bounded, invalid, point, positive, share};
use crate::error::StateError;
use crate::limits::Limits;
use crate::request::{DecisionRequest, WhatIf};
use nalgebra::Vector3;
use pdn_planning::{Allowable, Question, Settings};

/// Refuses assumptions that have no meaning.
///
/// # Errors
/// [`StateError::NotFinite`], [`StateError::OutOfRange`] with the parameter's name.
pub fn check_what_if(what_if: &WhatIf) -> Result<(), StateError> {
    what_if.alpha.map_or(Ok(0.0), |alpha| share("alpha", alpha))?;
    let sigmas = [
        ("sigma_xy_m", what_if.sigma_xy_m),
        ("sigma_depth_m", what_if.sigma_depth_m),
        ("sigma_tilt_deg", what_if.sigma_tilt_deg),
        ("sigma_heading_deg", what_if.sigma_heading_deg),
    ];
    sigmas
        .into_iter()
        .try_for_each(|(name, sigma)| sigma.map_or(Ok(0.0), |sigma| positive(name, sigma)).map(drop))
}

/// What is asked for, and what to assume instead of the mission's settings.
pub fn question(request: &DecisionRequest, settings: &Settings) -> Question {
    let (what_if, allowable) = (&request.what_if, &settings.allowable);
    let sigma_tilt_rad = what_if.sigma_tilt_deg.map(f64::to_radians);
    let assumed = Allowable {
        x_m: what_if.sigma_xy_m.unwrap_or(allowable.x_m),
        y_m: what_if.sigma_xy_m.unwrap_or(allowable.y_m),
        depth_m: what_if.sigma_depth_m.unwrap_or(allowable.depth_m),
        roll_rad: sigma_tilt_rad.unwrap_or(allowable.roll_rad),
        pitch_rad: sigma_tilt_rad.unwrap_or(allowable.pitch_rad),
        heading_rad: what_if.sigma_heading_deg.map_or(allowable.heading_rad, f64::to_radians),
    };
    let allowable = (assumed != *allowable).then_some(assumed);
    Question { alpha: what_if.alpha, allowable, choice_only: request.choice_only }
}

/// Refuses paths that are none, or too many.
///
/// # Errors
/// [`StateError::Invalid`], [`StateError::TooLong`], or a point's fault with its place.
pub fn check_paths(paths: &[Vec<[f64; 3]>], limits: &Limits) -> Result<(), StateError> {
    if paths.is_empty() {
        return Err(invalid("paths", "there is none; send at least one path of world points".to_string()));
    }
    bounded("paths", paths.len(), "max_paths", limits.max_paths)?;
    for (index, path) in paths.iter().enumerate() {
        let field = format!("paths[{index}]");
        if path.is_empty() {
            return Err(invalid(
                &field,
                "it has no points; send world points from the robot's place on".to_string(),
            ));
        }
        bounded(&field, path.len(), "max_path_points", limits.max_path_points)?;
        for (place, values) in path.iter().enumerate() {
            point(&format!("{field}[{place}]"), values)?;
        }
    }
    Ok(())
}

/// Paths as world points, m.
pub fn paths(paths: &[Vec<[f64; 3]>]) -> Vec<Vec<Vector3<f64>>> {
    paths.iter().map(|path| path.iter().map(|point| Vector3::from(*point)).collect()).collect()
}
