//! The settings that decisions depend on: every field checked, degrees become radians.

use super::shapes::{finite, invalid, not_negative, positive, share, within};
use crate::error::StateError;
use nalgebra::Vector6;
use pdn_planning::Allowable;
use pdn_schemas::config::{self as wire, MissionConfig};

/// Proposals of one keyframe at most; more would only make decisions slow.
const MAX_LINKS: u32 = 1000;

/// The planner's settings, but for target and link model.
///
/// # Errors
/// The first field that has no meaning, with its path.
pub fn planner(config: &MissionConfig) -> Result<pdn_planning::Settings, StateError> {
    let wire::MissionConfig { planner, camera, attitude, depth, .. } = config;
    let optional = |field, value: Option<f64>| value.map(|value| positive(field, value)).transpose();
    let angle = |field, degrees| Ok::<f64, StateError>(positive(field, degrees)?.to_radians());
    let wire::Planner { min_baseline_m, max_baseline_m, max_view_angle_deg, .. } = *planner;
    positive("planner.min_baseline_m", min_baseline_m)?;
    finite("planner.max_baseline_m", max_baseline_m)?;
    if min_baseline_m >= max_baseline_m {
        let problem = format!("{max_baseline_m} m must exceed planner.min_baseline_m = {min_baseline_m} m");
        return Err(invalid("planner.max_baseline_m", problem));
    }
    let view_angle_holds = max_view_angle_deg > 0.0 && max_view_angle_deg <= 180.0;
    let points = f64::from(planner.min_points);
    let links = f64::from(planner.max_links);
    within("planner.min_points", points, "1 or above", planner.min_points >= 1)?;
    within("planner.max_links", links, "in [0, 1000]", planner.max_links <= MAX_LINKS)?;
    within("planner.max_view_angle_deg", max_view_angle_deg, "in (0, 180] degrees", view_angle_holds)?;
    Ok(pdn_planning::Settings {
        alpha: share("alpha", config.alpha)?,
        allowable: allowable(&config.allowable)?,
        waypoint_local_saliency: share("planner.waypoint_local_saliency", planner.waypoint_local_saliency)?,
        eps_m: positive("planner.eps_m", planner.eps_m)?,
        min_points: planner.min_points as usize,
        max_cluster_radius_m: optional("planner.max_cluster_radius_m", planner.max_cluster_radius_m)?,
        edge_radius_m: optional("planner.edge_radius_m", planner.edge_radius_m)?,
        sample_spacing_m: optional("planner.sample_spacing_m", planner.sample_spacing_m)?,
        min_revisit_m: not_negative("planner.min_revisit_m", planner.min_revisit_m)?,
        min_baseline_m,
        max_baseline_m,
        max_view_angle_rad: max_view_angle_deg.to_radians(),
        max_links: planner.max_links as usize,
        swath_m: not_negative("planner.swath_m", planner.swath_m)?,
        expect_absolute: planner.expect_absolute,
        odometry_sigmas_per_sqrt_m: sigmas(
            ("odometry.translation_sigma_m_per_sqrt_m", &config.odometry.translation_sigma_m_per_sqrt_m),
            ("odometry.rotation_sigma_deg_per_sqrt_m", &config.odometry.rotation_sigma_deg_per_sqrt_m),
        )?,
        tilt_sigma_rad: optional("attitude.tilt_sigma_deg", attitude.tilt_sigma_deg)?.map(f64::to_radians),
        heading_sigma_rad: optional("attitude.heading_sigma_deg", attitude.heading_sigma_deg)?
            .map(f64::to_radians),
        depth_sigma_m: optional("depth.sigma_m", depth.sigma_m)?,
        direction_sigma_rad: angle("camera.direction_sigma_deg", camera.direction_sigma_deg)?,
        rotation_sigma_rad: angle("camera.rotation_sigma_deg", camera.rotation_sigma_deg)?,
    })
}

/// Standard deviations `[m; rad]` from metres and degrees.
///
/// # Errors
/// [`StateError::NotFinite`], [`StateError::OutOfRange`] with the element's path.
pub fn sigmas(
    translation: (&str, &[f64; 3]),
    rotation_deg: (&str, &[f64; 3]),
) -> Result<Vector6<f64>, StateError> {
    let mut sigmas = Vector6::zeros();
    for index in 0..3 {
        sigmas[index] = positive(&format!("{}[{index}]", translation.0), translation.1[index])?;
        let degrees = positive(&format!("{}[{index}]", rotation_deg.0), rotation_deg.1[index])?;
        sigmas[index + 3] = degrees.to_radians();
    }
    Ok(sigmas)
}

fn allowable(wire: &wire::Allowable) -> Result<Allowable, StateError> {
    Ok(Allowable {
        x_m: positive("allowable.x_m", wire.x_m)?,
        y_m: positive("allowable.y_m", wire.y_m)?,
        depth_m: positive("allowable.depth_m", wire.depth_m)?,
        roll_rad: positive("allowable.roll_deg", wire.roll_deg)?.to_radians(),
        pitch_rad: positive("allowable.pitch_deg", wire.pitch_deg)?.to_radians(),
        heading_rad: positive("allowable.heading_deg", wire.heading_deg)?.to_radians(),
    })
}
