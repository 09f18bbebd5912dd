//! Answers on their way out.

use super::question::question;
use super::shapes::{wire_covariance, wire_pose};
use crate::answer::{DecisionRequest, WhatIf};
use crate::error::StateError;
use crate::view::{RobotNow, Relinearized, View};
use nalgebra::Vector3;
use pdn_planning as domain;
use pdn_schemas::config::Allowable;
use pdn_schemas::reply::{
    Action, Candidate, CoverageReply, Decision, EvaluateReply, Exploration, FacetCoverage, GraphKeyframe,
    GraphReply, LinkBin, LinkModelReply, Phase, Policy, Robot, Timing, Waypoint, WaypointsReply,
};
use rayon::ThreadPool;
use std::sync::Arc;

/// What an answer rests on.
#[derive(Clone, Debug)]
pub struct Source {
    /// Id of the mission.
    pub mission: String,
    /// All events below are part of it.
    pub graph_seq: u64,
    /// The phase when it was asked.
    pub phase: Phase,
    /// The mission's allowance, as it was configured.
    pub allowable: Allowable,
    /// The state of the mission.
    pub view: Arc<View>,
}

/// `rpc/decision`; without its number.
///
/// # Errors
/// As [`View::decide`].
pub fn decide(
    source: &Source,
    request: &DecisionRequest,
    pool: &ThreadPool,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Decision, StateError> {
    let decided = source.view.decide(&question(request, &source.view.settings().allowable), pool, stop)?;
    Ok(Decision {
        mission: source.mission.clone(),
        decision: None,
        graph_seq: source.graph_seq,
        phase: source.phase,
        robot: Robot {
            keyframe: decided.robot.keyframe,
            pose: wire_pose(&decided.robot.pose),
            covariance: wire_covariance(&decided.robot.covariance),
        },
        alpha: decided.alpha,
        allowable: allowable(source.allowable, &request.what_if),
        policy: Policy::Pdn,
        action: match decided.action {
            domain::Action::Explore => Action::Explore {},
            domain::Action::Revisit { candidate, keyframe } => Action::Revisit { candidate, keyframe },
        },
        exploration: exploration(&decided.exploration),
        candidates: decided.candidates.iter().map(|known| candidate(known, request.full)).collect(),
        not_evaluated: decided.not_evaluated,
        target_m2: decided.target_m2,
        covered_m2: decided.covered_m2,
        complete: decided.complete,
        link_model: request.full.then(|| link_model_of(source)),
        timing: Timing::default(),
        reason: decided.reason,
    })
}

/// `rpc/evaluate`.
///
/// # Errors
/// As [`View::evaluate`]; [`StateError::Stopped`] if not every path was evaluated.
pub fn evaluate(
    source: &Source,
    request: &DecisionRequest,
    paths: &[Vec<[f64; 3]>],
    pool: &ThreadPool,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<EvaluateReply, StateError> {
    let assumed = question(request, &source.view.settings().allowable);
    let paths: Vec<Vec<Vector3<f64>>> =
        paths.iter().map(|path| path.iter().map(|point| Vector3::from(*point)).collect()).collect();
    let evaluated = source.view.evaluate(&assumed, &paths, pool, stop)?;
    if !evaluated.not_evaluated.is_empty() {
        return Err(StateError::Stopped);
    }
    Ok(EvaluateReply {
        mission: source.mission.clone(),
        graph_seq: source.graph_seq,
        exploration: exploration(&evaluated.exploration),
        candidates: evaluated.candidates.iter().map(|known| candidate(known, request.full)).collect(),
        timing: Timing::default(),
    })
}

/// `rpc/graph`.
///
/// # Errors
/// [`StateError::Singular`] if a marginal cannot be computed.
pub fn graph(source: &Source, from: u64, marginals: bool) -> Result<GraphReply, StateError> {
    let Relinearized { snapshot, smoother } = source.view.relinearized()?;
    let covariances = if marginals && !snapshot.keyframes.is_empty() {
        smoother.elimination().marginals()
    } else {
        Vec::new()
    };
    let nodes = snapshot.keyframes.iter().zip(0_u32..).filter(|(keyframe, _)| keyframe.id >= from);
    let mut keyframes: Vec<GraphKeyframe> = nodes
        .map(|(keyframe, node)| GraphKeyframe {
            id: keyframe.id,
            pose: wire_pose(&smoother.estimate(pdn_kernel::Node(node))),
            linearization: wire_pose(&keyframe.world_from_body),
            local_saliency: keyframe.saliency.local,
            global_saliency: keyframe.saliency.global,
            covariance: covariances.get(node as usize).map(wire_covariance),
        })
        .collect();
    keyframes.sort_by_key(|keyframe| keyframe.id);
    Ok(GraphReply {
        mission: source.mission.clone(),
        graph_seq: source.graph_seq,
        keyframes,
        factors: source.view.factors.iter().map(|(kind, count)| (kind.to_string(), *count)).collect(),
        chi2: smoother.chi2().map_err(|error| source.view.describe(error))?,
    })
}

/// `rpc/waypoints`.
///
/// # Errors
/// [`StateError::Singular`] if a marginal cannot be computed.
pub fn waypoints(source: &Source) -> Result<WaypointsReply, StateError> {
    let found =
        domain::waypoints(&source.view.relinearized()?.snapshot).map_err(|error| source.view.describe(error))?;
    let waypoints = found.iter().map(|waypoint| Waypoint {
        keyframe: waypoint.keyframe,
        pose: wire_pose(&waypoint.pose),
        marginal_uncertainty: waypoint.marginal_uncertainty,
        score: waypoint.score,
        members: waypoint.members.clone(),
        one_way_m: waypoint.route.as_ref().map(|route| route.one_way_m),
        candidate: waypoint.candidate,
    });
    Ok(WaypointsReply {
        mission: source.mission.clone(),
        graph_seq: source.graph_seq,
        waypoints: waypoints.collect(),
    })
}

/// `rpc/coverage`.
pub fn coverage(
    mission: String,
    graph_seq: u64,
    target_m2: f64,
    coverage: &domain::Coverage,
) -> CoverageReply {
    let facets = coverage.facets().into_iter().map(|facet| FacetCoverage {
        cells_u: facet.cells_u,
        cells_v: facet.cells_v,
        covered_cells: facet.covered_cells,
        runs: facet.runs,
    });
    CoverageReply {
        mission,
        graph_seq,
        covered_m2: coverage.covered_m2(),
        target_m2,
        cell_m: coverage.cell_m(),
        facets: facets.collect(),
    }
}

/// The table of P_L that an answer rests on.
pub fn link_model_of(source: &Source) -> LinkModelReply {
    link_model(source.mission.clone(), source.graph_seq, source.view.link_model())
}

/// `rpc/link_model`.
pub fn link_model(mission: String, graph_seq: u64, model: &domain::LinkModel) -> LinkModelReply {
    let cells = model.cells().into_iter().map(|bin| LinkBin {
        prior_registered: bin.prior_registered,
        prior_failed: bin.prior_failed,
        proposed: bin.proposed,
        registered: bin.registered,
        probability: bin.probability(),
    });
    LinkModelReply { mission, graph_seq, bins: model.bins() as u32, cells: cells.collect() }
}

/// The robot of a mission's state: at the estimate.
pub fn robot_now(robot: &RobotNow) -> Robot {
    Robot {
        keyframe: robot.keyframe,
        pose: wire_pose(&robot.pose),
        covariance: wire_covariance(&robot.covariance),
    }
}

/// The allowance that a question weighs by, to the digit as it was given.
fn allowable(configured: Allowable, what_if: &WhatIf) -> Allowable {
    Allowable {
        x_m: what_if.sigma_xy_m.unwrap_or(configured.x_m),
        y_m: what_if.sigma_xy_m.unwrap_or(configured.y_m),
        depth_m: what_if.sigma_depth_m.unwrap_or(configured.depth_m),
        roll_deg: what_if.sigma_tilt_deg.unwrap_or(configured.roll_deg),
        pitch_deg: what_if.sigma_tilt_deg.unwrap_or(configured.pitch_deg),
        heading_deg: what_if.sigma_heading_deg.unwrap_or(configured.heading_deg),
    }
}

fn exploration(known: &domain::Exploration) -> Exploration {
    Exploration {
        covariance: wire_covariance(&known.covariance),
        uncertainty: known.uncertainty,
        uncertainty_ratio: known.uncertainty_ratio,
        area: known.area,
        penalty: known.penalty,
        reward: known.reward,
    }
}

fn candidate(known: &domain::Candidate, full: bool) -> Candidate {
    Candidate {
        candidate: known.candidate,
        keyframe: known.keyframe,
        path: known.path.clone(),
        one_way_m: known.one_way_m,
        nodes: known.nodes,
        covariance: wire_covariance(&known.covariance),
        uncertainty: known.uncertainty,
        uncertainty_all_links: known.uncertainty_all_links,
        uncertainty_no_links: known.uncertainty_no_links,
        peak_uncertainty: known.peak_uncertainty,
        redundant_m2: known.redundant_m2,
        area: known.area,
        penalty: known.penalty,
        reward: known.reward,
        break_even_alpha: known.break_even_alpha,
        expected_links: known.expected_links,
        poses: full.then(|| known.poses.iter().map(wire_pose).collect()),
        links: full.then(|| known.links.clone()),
    }
}
