//! A mission's configuration on its way in: every field checked, degrees become radians.

use super::planner::{planner, sigmas};
use super::shapes::{bounded, direction, invalid, point, pose, positive, within};
use crate::error::StateError;
use crate::error::translate::planning;
use crate::limits::{Limits, UNIT_TOLERANCE};
use crate::settings::{Losses, Settings};
use crate::survey::Survey;
use nalgebra::{Matrix6, Vector3};
use pdn_kernel::Loss;
use pdn_planning::coverage::{Facet, FieldOfView};
use pdn_planning::{Coverage, LinkModel};
use pdn_schemas::config::{self as wire, MissionConfig};
use pdn_schemas::ids::MissionId;

/// Share of the facets' area that summing it in another order, or writing it with ten digits, may cost.
const AREA_ROUNDING: f64 = 1e-9;

/// Below it the gate would refuse what is true: of measurements in six dimensions whose noise is as they say,
/// 17 % lie beyond 3 standard deviations, beyond 6 three of a million.
const MIN_GATE_SIGMAS: f64 = 3.0;

/// The settings of a configuration.
///
/// # Errors
/// The first field that has no meaning, with its path.
pub fn settings(config: &MissionConfig, limits: &Limits) -> Result<Settings, StateError> {
    MissionId::new(config.mission.as_str()).map_err(|error| invalid("mission", error.to_string()))?;
    let facets = facets(&config.target, config.cell_m, limits)?;
    let planning = planner(config)?;
    planning.check().map_err(describe)?;
    let view = field_of_view(&config.camera)?;
    let coverage = Coverage::new(&facets, config.cell_m, view).map_err(describe)?;
    let area_m2 = config.target.area_m2.map(|area_m2| positive("target.area_m2", area_m2)).transpose()?;
    Ok(Settings {
        body_from_camera: pose("camera.body_from_camera", &config.camera.body_from_camera)?,
        losses: losses(&config.robust)?,
        gate_sigmas: config.gate_sigmas.map(gate_sigmas).transpose()?,
        first_keyframe_covariance: config.first_keyframe_sigmas.as_ref().map(first_covariance).transpose()?,
        target_m2: target_m2(area_m2, coverage.facets_m2()),
        facets,
        view,
        coverage,
        link_model: link_model(&config.link_model, limits)?,
        survey: config.survey.as_ref().map(|points| survey(points, planning.swath_m, limits)).transpose()?,
        planning,
    })
}

/// What a mission may not begin with. Missions of earlier versions may have, and go on.
///
/// # Errors
/// What does not fit, with both numbers.
pub fn check_new(settings: &Settings) -> Result<(), StateError> {
    let facets_m2 = settings.coverage.facets_m2();
    if settings.target_m2 < facets_m2 {
        let problem = format!(
            "{} m^2 are less than the {facets_m2} m^2 that the facets have, so that more than all would be \
             covered; leave it null for the facets' own area, or make the facets smaller (where two overlap, \
             each counts)",
            settings.target_m2
        );
        return Err(invalid("target.area_m2", problem));
    }
    Ok(())
}

/// A_target: what is given, but the facets' own area where only rounding tells the two apart.
fn target_m2(area_m2: Option<f64>, facets_m2: f64) -> f64 {
    let is_rounded = |area_m2: &f64| *area_m2 < facets_m2 && *area_m2 >= facets_m2 * (1.0 - AREA_ROUNDING);
    area_m2.filter(|area_m2| !is_rounded(area_m2)).unwrap_or(facets_m2)
}

fn gate_sigmas(sigmas: f64) -> Result<f64, StateError> {
    positive("gate_sigmas", sigmas)?;
    within("gate_sigmas", sigmas, "3 or above, or null for no gate", sigmas >= MIN_GATE_SIGMAS)
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
    if cosine.abs() > UNIT_TOLERANCE {
        let problem =
            format!("it is not orthogonal to u, their product is {cosine}; send two orthogonal edges");
        return Err(invalid(&field("v"), problem));
    }
    Ok(facet)
}

fn field_of_view(camera: &wire::Camera) -> Result<FieldOfView, StateError> {
    let angle =
        |field, degrees: f64| within(field, degrees, "in (0, 180) degrees", degrees > 0.0 && degrees < 180.0);
    Ok(FieldOfView {
        horizontal_rad: angle("camera.horizontal_fov_deg", camera.horizontal_fov_deg)?.to_radians(),
        vertical_rad: angle("camera.vertical_fov_deg", camera.vertical_fov_deg)?.to_radians(),
        max_range_m: positive("camera.max_range_m", camera.max_range_m)?,
    })
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
    within("link_model.bins", f64::from(wire.bins), "from 1 to max_link_bins", bins_hold)?;
    LinkModel::new(wire.bins as usize, &wire.prior).map_err(describe)
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

fn describe(error: pdn_planning::PlanningError) -> StateError {
    planning(|_| None, error)
}
