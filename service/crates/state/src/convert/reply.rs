//! Answers on their way out.

use super::shapes::{wire_covariance, wire_pose};
use crate::request::{DecisionRequest, Source, WhatIf};
use crate::view::Graph;
use nalgebra::Matrix6;
use pdn_kernel::se3::Pose;
use pdn_planning as domain;
use pdn_schemas::config::Allowable;
use pdn_schemas::reply::{
    Action, Candidate, CoverageReply, Decision, EvaluateReply, Exploration, FacetCoverage, GraphKeyframe,
    GraphReply, LinkBin, LinkModelReply, Policy, Robot, Timing, Waypoint, WaypointsReply,
};

/// `rpc/decision`; without its number. `link_model` comes with it if it was asked for.
pub fn decision(
    source: &Source,
    request: &DecisionRequest,
    decided: domain::Decision,
    link_model: Option<LinkModelReply>,
) -> Decision {
    Decision {
        mission: source.mission.clone(),
        decision: None,
        graph_seq: source.graph_seq,
        phase: source.phase,
        robot: robot(decided.robot.keyframe, &decided.robot.pose, &decided.robot.covariance),
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
        link_model,
        timing: Timing::default(),
        reason: decided.reason,
    }
}

/// `rpc/evaluate`.
pub fn evaluation(
    source: &Source,
    request: &DecisionRequest,
    evaluated: &domain::Evaluation,
) -> EvaluateReply {
    EvaluateReply {
        mission: source.mission.clone(),
        graph_seq: source.graph_seq,
        exploration: exploration(&evaluated.exploration),
        candidates: evaluated.candidates.iter().map(|known| candidate(known, request.full)).collect(),
        timing: Timing::default(),
    }
}

/// `rpc/graph`.
pub fn graph(source: &Source, graph: Graph) -> GraphReply {
    let keyframes = graph.keyframes.iter().map(|keyframe| GraphKeyframe {
        id: keyframe.id,
        pose: wire_pose(&keyframe.estimate),
        linearization: wire_pose(&keyframe.linearization),
        local_saliency: keyframe.saliency.local,
        global_saliency: keyframe.saliency.global,
        covariance: keyframe.covariance.as_ref().map(wire_covariance),
    });
    GraphReply {
        mission: source.mission.clone(),
        graph_seq: source.graph_seq,
        keyframes: keyframes.collect(),
        factors: graph.factors.into_iter().map(|(kind, count)| (kind.to_string(), count)).collect(),
        chi2: graph.chi2,
    }
}

/// `rpc/waypoints`.
pub fn waypoints(source: &Source, found: &[domain::Waypoint]) -> WaypointsReply {
    let waypoints = found.iter().map(|waypoint| Waypoint {
        keyframe: waypoint.keyframe,
        pose: wire_pose(&waypoint.pose),
        marginal_uncertainty: waypoint.marginal_uncertainty,
        score: waypoint.score,
        one_way_m: waypoint.route.as_ref().map(|route| route.one_way_m),
        members: waypoint.members.clone(),
        candidate: waypoint.candidate,
    });
    WaypointsReply {
        mission: source.mission.clone(),
        graph_seq: source.graph_seq,
        waypoints: waypoints.collect(),
    }
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

/// The newest keyframe.
pub fn robot(keyframe: u64, pose: &Pose, covariance: &Matrix6<f64>) -> Robot {
    Robot { keyframe, pose: wire_pose(pose), covariance: wire_covariance(covariance) }
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
