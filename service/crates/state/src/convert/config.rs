//! A mission's configuration on its way in: every field checked, degrees become radians.

use super::error::planning;
use super::shapes::{direction, finite, not_negative, point, pose, positive, share, within};
use crate::answer::WhatIf;
use crate::error::StateError;
use crate::limits::Limits;
use crate::settings::{Losses, Settings};
use crate::survey::Survey;
use nalgebra::{Matrix6, Vector3, Vector6};
use pdn_kernel::Loss;
use pdn_planning::coverage::{Facet, FieldOfView};
use pdn_planning::{Allowable, Coverage, LinkModel, Question};
use pdn_schemas::config::{self as wire, MissionConfig};
use pdn_schemas::ids::MissionId;

/// Proposals of one keyframe at most; more would only make decisions slow.
const MAX_LINKS: u32 = 1000;

/// The settings of a configuration.
///
/// # Errors
/// The first field that has no meaning, with its path.
pub fn settings(config: &MissionConfig, limits: &Limits) -> Result<Settings, StateError> {
    MissionId::new(config.mission.as_str()).map_err(|error| invalid("mission", error.to_string()))?;
    let facets = facets(&config.target, config.cell_m, limits)?;
    let planning = planner(config)?;
    planning.check().map_err(told)?;
    let coverage = Coverage::new(&facets, config.cell_m, field_of_view(&config.camera)?).map_err(told)?;
    let area_m2 = config.target.area_m2.map(|area_m2| positive("target.area_m2", area_m2)).transpose()?;
    Ok(Settings {
        body_from_camera: pose("camera.body_from_camera", &config.camera.body_from_camera)?,
        losses: losses(&config.robust)?,
        first_keyframe_covariance: config.first_keyframe_sigmas.as_ref().map(first_covariance).transpose()?,
        target_m2: area_m2.unwrap_or_else(|| coverage.facets_m2()),
        coverage,
        link_model: link_model(&config.link_model, limits)?,
        survey: config.survey.as_ref().map(|points| survey(points, planning.swath_m, limits)).transpose()?,
        planning,
    })
}

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

/// What to assume instead of the mission's settings.
pub fn question(what_if: &WhatIf, allowable: &Allowable) -> Question {
    let sigma_tilt_rad = what_if.sigma_tilt_deg.map(f64::to_radians);
    let assumed = Allowable {
        x_m: what_if.sigma_xy_m.unwrap_or(allowable.x_m),
        y_m: what_if.sigma_xy_m.unwrap_or(allowable.y_m),
        depth_m: what_if.sigma_depth_m.unwrap_or(allowable.depth_m),
        roll_rad: sigma_tilt_rad.unwrap_or(allowable.roll_rad),
        pitch_rad: sigma_tilt_rad.unwrap_or(allowable.pitch_rad),
        heading_rad: what_if.sigma_heading_deg.map_or(allowable.heading_rad, f64::to_radians),
    };
    Question { alpha: what_if.alpha, allowable: (assumed != *allowable).then_some(assumed) }
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

fn facets(target: &wire::Target, cell_m: f64, limits: &Limits) -> Result<Vec<Facet>, StateError> {
    positive("cell_m", cell_m)?;
    if target.facets.is_empty() {
        return Err(invalid(
            "target.facets",
            "there is none; describe the surface by at least one facet".to_string(),
        ));
    }
    bounded("target.facets", target.facets.len(), "max_facets", limits.max_facets)?;
    let facets: Vec<Facet> =
        target.facets.iter().enumerate().map(|(index, wire)| facet(index, wire)).collect::<Result<_, _>>()?;
    let cells = |facet: &Facet| (facet.length_u_m / cell_m).ceil() * (facet.length_v_m / cell_m).ceil();
    if facets.iter().map(cells).sum::<f64>() > limits.max_cells as f64 {
        return Err(StateError::Limit {
            what: "cells of the coverage raster",
            bound: "max_cells",
            limit: limits.max_cells,
            advice: "choose a larger cell_m or a smaller target",
        });
    }
    Ok(facets)
}

fn facet(index: usize, wire: &wire::Facet) -> Result<Facet, StateError> {
    let field = |name: &str| format!("target.facets[{index}].{name}");
    let facet = Facet {
        origin: point(&field("origin"), &wire.origin)?,
        u: direction(&field("u"), &wire.u)?,
        v: direction(&field("v"), &wire.v)?,
        length_u_m: positive(&field("length_u_m"), wire.length_u_m)?,
        length_v_m: positive(&field("length_v_m"), wire.length_v_m)?,
    };
    let cosine = facet.u.dot(&facet.v);
    if cosine.abs() > super::shapes::UNIT_TOLERANCE {
        let problem =
            format!("it is not orthogonal to u, their product is {cosine}; send two orthogonal edges");
        return Err(invalid(&field("v"), problem));
    }
    Ok(facet)
}

fn field_of_view(camera: &wire::Camera) -> Result<FieldOfView, StateError> {
    let angle =
        |field, degrees: f64| within(field, degrees, "(0, 180) degrees", degrees > 0.0 && degrees < 180.0);
    Ok(FieldOfView {
        horizontal_rad: angle("camera.horizontal_fov_deg", camera.horizontal_fov_deg)?.to_radians(),
        vertical_rad: angle("camera.vertical_fov_deg", camera.vertical_fov_deg)?.to_radians(),
        max_range_m: positive("camera.max_range_m", camera.max_range_m)?,
    })
}

fn planner(config: &MissionConfig) -> Result<pdn_planning::Settings, StateError> {
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
    within("planner.max_links", links, "[0, 1000]", planner.max_links <= MAX_LINKS)?;
    within("planner.max_view_angle_deg", max_view_angle_deg, "(0, 180] degrees", view_angle_holds)?;
    Ok(pdn_planning::Settings {
        alpha: share("alpha", config.alpha)?,
        allowable: allowable(&config.allowable)?,
        waypoint_local_saliency: share("planner.waypoint_local_saliency", planner.waypoint_local_saliency)?,
        eps_m: positive("planner.eps_m", planner.eps_m)?,
        min_points: planner.min_points as usize,
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

fn sigmas(
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

fn first_covariance(wire: &wire::FirstKeyframeSigmas) -> Result<Matrix6<f64>, StateError> {
    let sigmas = sigmas(
        ("first_keyframe_sigmas.translation_m", &wire.translation_m),
        ("first_keyframe_sigmas.rotation_deg", &wire.rotation_deg),
    )?;
    Ok(Matrix6::from_diagonal(&sigmas.component_mul(&sigmas)))
}

fn losses(robust: &wire::Robust) -> Result<Losses, StateError> {
    let by_kind = [
        loss("robust.prior", robust.prior)?,
        loss("robust.odometry", robust.odometry)?,
        loss("robust.relative", robust.relative)?,
        loss("robust.camera", robust.camera)?,
        loss("robust.attitude", robust.attitude)?,
        loss("robust.depth", robust.depth)?,
        loss("robust.position", robust.position)?,
    ];
    Ok(Losses { by_kind })
}

fn loss(field: &str, loss: wire::Loss) -> Result<Loss, StateError> {
    Ok(match loss {
        wire::Loss::None => Loss::None,
        wire::Loss::Huber(c) => Loss::Huber(positive(&format!("{field}.huber"), c)?),
        wire::Loss::Cauchy(c) => Loss::Cauchy(positive(&format!("{field}.cauchy"), c)?),
    })
}

fn link_model(wire: &wire::LinkModel, limits: &Limits) -> Result<LinkModel, StateError> {
    let bins_hold = (1..=limits.max_link_bins).contains(&wire.bins);
    within("link_model.bins", f64::from(wire.bins), "1 to max_link_bins", bins_hold)?;
    LinkModel::new(wire.bins as usize, &wire.prior).map_err(told)
}

fn survey(points: &[[f64; 3]], corridor_m: f64, limits: &Limits) -> Result<Survey, StateError> {
    bounded("survey", points.len(), "max_survey_points", limits.max_survey_points)?;
    let checked = points.iter().enumerate().map(|(index, values)| point(&format!("survey[{index}]"), values));
    let survey = Survey::new(checked.collect::<Result<Vec<Vector3<f64>>, _>>()?, corridor_m);
    if survey.length_m() <= 0.0 {
        return Err(invalid(
            "survey",
            "it has no length; send two different points at least, or null".to_string(),
        ));
    }
    Ok(survey)
}

fn bounded(field: &str, count: usize, bound: &'static str, limit: usize) -> Result<(), StateError> {
    if count <= limit {
        return Ok(());
    }
    Err(StateError::TooLong { field: field.to_string(), count: count as u64, bound, limit: limit as u64 })
}

fn invalid(field: &str, problem: String) -> StateError {
    StateError::Invalid { field: field.to_string(), problem }
}

fn told(error: pdn_planning::PlanningError) -> StateError {
    planning(|_| None, error)
}
