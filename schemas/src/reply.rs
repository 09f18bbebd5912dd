//! What the service answers and publishes.

use crate::config::{Allowable, MissionConfig};
use crate::shared::{Covariance6, Pose};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Where a mission stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// Known, not begun.
    Configured,
    /// Decisions are given.
    Running,
    /// The operator has stopped decisions for a while.
    Paused,
    /// The service has stopped decisions until someone resumes.
    Held,
    /// Ended as planned.
    Completed,
    /// Ended before its end.
    Aborted,
}

/// The newest keyframe of the graph.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Robot {
    /// Its id.
    pub keyframe: u64,
    /// `world_from_body`: in a decision the linearisation point, in a mission's state the estimate.
    pub pose: Pose,
    /// Its marginal covariance.
    pub covariance: Covariance6,
}

/// `rpc/mission`, `op/*`, `out/state`: a mission as it stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MissionState {
    /// Id of the mission.
    pub mission: String,
    /// Where it stands.
    pub phase: Phase,
    /// The newest keyframe of the graph; null before the first.
    pub robot: Option<Robot>,
    /// Why the phase is what it is, in a sentence.
    pub reason: String,
    /// When the phase began, ns since the Unix epoch on the daemon's clock.
    pub since_ns: u64,
    /// What the mission was configured with.
    pub config: MissionConfig,
    /// All events below are applied.
    pub next_seq: u64,
    /// Keyframes in the graph.
    pub keyframes: u64,
    /// Factors in the graph, the prior of `first_keyframe_sigmas` included.
    pub factors: u64,
    /// Area photographed, m^2, by the corrected trajectory.
    pub covered_m2: f64,
    /// Area that counts as the whole, m^2.
    pub target_m2: f64,
    /// (|Sigma_rr| / |Sigma_allow|)^(1/6) of the robot; null before the first keyframe.
    pub uncertainty: Option<f64>,
    /// Decisions given.
    pub decisions: u64,
    /// Those of them that chose a revisit.
    pub revisits: u64,
    /// Length of the survey still ahead, m; null without a survey.
    pub estimated_remaining_m: Option<f64>,
    /// What is wrong or wanting.
    pub health: Health,
}

/// What is wrong or wanting in a mission.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Health {
    /// Whether decisions can rest on the graph.
    pub ok: bool,
    /// One sentence for each finding.
    pub findings: Vec<String>,
}

/// `rpc/ingest`: which events have arrived.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct IngestStatus {
    /// Id of the mission.
    pub mission: String,
    /// All events below are applied.
    pub next_seq: u64,
    /// All events below survive a power cut.
    pub durable_seq: u64,
    /// Events that wait for a missing one.
    pub buffered: u64,
    /// Missing events, as `[first, last]`.
    pub missing: Vec<(u64, u64)>,
    /// Events refused so far.
    pub rejected: u64,
}

/// `out/ack`: progress of the events.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Ack {
    /// Id of the mission.
    pub mission: String,
    /// All events below are applied.
    pub next_seq: u64,
    /// All events below survive a power cut.
    pub durable_seq: u64,
}

/// `out/rejected` and every error reply: what was refused, why and what to do.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Problem {
    /// One of the codes of `schemas/errors.md`.
    pub code: String,
    /// What is wrong, where, and what to do.
    pub message: String,
    /// The event's number; null for a query or an event that could not be read.
    pub seq: Option<u64>,
}

/// What the vehicle should do next.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Action {
    /// Go on with the survey.
    Explore {},
    /// Go to the waypoint of a candidate, along its path, and come back.
    Revisit {
        /// Number of the candidate, from 1.
        candidate: u32,
        /// The waypoint's keyframe.
        keyframe: u64,
    },
}

/// Who chose the action.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Policy {
    /// The greatest reward [PDN12, eq. 9].
    Pdn,
    /// The operator.
    Operator,
}

/// `rpc/decision`, `out/decided`: explore or revisit, with every number behind it [PDN12, III].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Decision {
    /// Id of the mission.
    pub mission: String,
    /// Number of the decision, from 0; null for a what-if, which is not counted.
    pub decision: Option<u64>,
    /// The decision rests on all events below.
    pub graph_seq: u64,
    /// Phase of the mission.
    pub phase: Phase,
    /// The newest keyframe, virtual node 0; the pose is its linearisation point.
    pub robot: Robot,
    /// Weight of the uncertainty.
    pub alpha: f64,
    /// The allowance.
    pub allowable: Allowable,
    /// Who chose.
    pub policy: Policy,
    /// What to do.
    pub action: Action,
    /// Candidate 0.
    pub exploration: Exploration,
    /// Candidates from 1, in the order of their waypoints' keyframe ids.
    pub candidates: Vec<Candidate>,
    /// Keyframes of waypoints that the deadline left unevaluated.
    pub not_evaluated: Vec<u64>,
    /// A_target, m^2.
    pub target_m2: f64,
    /// A_covered, m^2.
    pub covered_m2: f64,
    /// Whether every candidate was evaluated.
    pub complete: bool,
    /// The table of P_L that the candidates rest on; null without `detail=full`.
    pub link_model: Option<LinkModelReply>,
    /// Where the time went; not part of what is decided.
    pub timing: Timing,
    /// Why, in one sentence for a person.
    pub reason: String,
}

/// Going on with the survey, candidate 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Exploration {
    /// Sigma_exp: the robot's marginal carried one step by the last odometry.
    pub covariance: Covariance6,
    /// U^0 [PDN12, eq. 5]: 0 below the allowance.
    pub uncertainty: f64,
    /// (|Sigma_exp| / |Sigma_allow|)^(1/6), also below the allowance.
    pub uncertainty_ratio: f64,
    /// A^0 [PDN12, eq. 6].
    pub area: f64,
    /// C^0 [PDN12, eq. 7].
    pub penalty: f64,
    /// R^0 [PDN12, eq. 8].
    pub reward: f64,
}

/// A revisit, candidate k > 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Candidate {
    /// k.
    pub candidate: u32,
    /// The waypoint; null for a path that a person drew.
    pub keyframe: Option<u64>,
    /// Keyframes from the robot to the waypoint, both included; empty for a path that a person drew.
    pub path: Vec<u64>,
    /// Length of the way out, m.
    pub one_way_m: f64,
    /// Virtual nodes of the round trip; the last one is at the robot's pose.
    pub nodes: u32,
    /// Sigma_nn: expected covariance at the last virtual node [PDN12, eq. 4].
    pub covariance: Covariance6,
    /// U^k [PDN12, eq. 5].
    pub uncertainty: f64,
    /// U^k with every link registered (P = 1).
    pub uncertainty_all_links: f64,
    /// U^k with none registered (P = 0).
    pub uncertainty_no_links: f64,
    /// Greatest (|Sigma_ii| / |Sigma_allow|)^(1/6) over the virtual nodes i = 1..n, each the block of the
    /// same inverse as Sigma_nn.
    pub peak_uncertainty: f64,
    /// A_redundant: twice `one_way_m` times the swath, m^2.
    pub redundant_m2: f64,
    /// A^k [PDN12, eq. 6].
    pub area: f64,
    /// C^k [PDN12, eq. 7].
    pub penalty: f64,
    /// R^k [PDN12, eq. 8].
    pub reward: f64,
    /// The alpha above which this beats exploring; null when U^k >= U^0.
    pub break_even_alpha: Option<f64>,
    /// Sum of P_L over the links.
    pub expected_links: f64,
    /// World poses of the virtual nodes 1..n; null without `detail=full`.
    pub poses: Option<Vec<Pose>>,
    /// `[node, keyframe, probability]` of each expected registration; null without `detail=full`.
    pub links: Option<Vec<(u32, u64, f64)>>,
}

/// Where the time of an answer went, on the daemon's clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Timing {
    /// Waiting for the event of `after=`, ms.
    pub wait_ms: f64,
    /// Waiting for a thread of the pool, ms.
    pub queue_ms: f64,
    /// Evaluating, ms.
    pub evaluate_ms: f64,
    /// From the query's arrival to its reply, ms.
    pub total_ms: f64,
}

/// `rpc/evaluate`: candidates as in a decision, numbered in the order of the paths.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EvaluateReply {
    /// Id of the mission.
    pub mission: String,
    /// The answer rests on all events below.
    pub graph_seq: u64,
    /// Candidate 0.
    pub exploration: Exploration,
    /// One for each path.
    pub candidates: Vec<Candidate>,
    /// Where the time went.
    pub timing: Timing,
}

/// `rpc/graph`: the pose graph.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GraphReply {
    /// Id of the mission.
    pub mission: String,
    /// The answer rests on all events below.
    pub graph_seq: u64,
    /// By id, from `from=` on.
    pub keyframes: Vec<GraphKeyframe>,
    /// Count of each kind of factor.
    pub factors: BTreeMap<String, u64>,
    /// Sum of w r' W r over the factors at the estimate, without 1/2, w being the robust weight.
    pub chi2: f64,
}

/// A keyframe of the pose graph.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GraphKeyframe {
    /// Its id.
    pub id: u64,
    /// Estimate of `world_from_body`.
    pub pose: Pose,
    /// The linearisation point, at which decisions are evaluated.
    pub linearization: Pose,
    /// S_L.
    pub local_saliency: f64,
    /// S_G.
    pub global_saliency: f64,
    /// Marginal covariance at the linearisation point; null without `marginals=true`.
    pub covariance: Option<Covariance6>,
}

/// `rpc/waypoints`: clusters of salient keyframes [PDN12, III.B].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WaypointsReply {
    /// Id of the mission.
    pub mission: String,
    /// The answer rests on all events below.
    pub graph_seq: u64,
    /// In the order of their waypoints' ids.
    pub waypoints: Vec<Waypoint>,
}

/// A cluster and its representative.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Waypoint {
    /// The representative keyframe.
    pub keyframe: u64,
    /// Its estimated pose.
    pub pose: Pose,
    /// Its marginal's |Sigma|^(1/6).
    pub marginal_uncertainty: f64,
    /// S_G * u_min / u, by which it was chosen.
    pub score: f64,
    /// The cluster's keyframes, by id.
    pub members: Vec<u64>,
    /// Length of the path from the robot, m; null if there is none.
    pub one_way_m: Option<f64>,
    /// Whether decisions consider it: it has a path no shorter than `min_revisit_m`.
    pub candidate: bool,
}

/// `rpc/coverage`: the rasters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CoverageReply {
    /// Id of the mission.
    pub mission: String,
    /// The answer rests on all events below.
    pub graph_seq: u64,
    /// A_covered, m^2.
    pub covered_m2: f64,
    /// A_target, m^2.
    pub target_m2: f64,
    /// Edge of a cell, m.
    pub cell_m: f64,
    /// In the order of the configuration.
    pub facets: Vec<FacetCoverage>,
}

/// The raster of a facet.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FacetCoverage {
    /// Cells along `u`.
    pub cells_u: u32,
    /// Cells along `v`.
    pub cells_v: u32,
    /// Covered cells.
    pub covered_cells: u64,
    /// Lengths of alternating runs of uncovered and covered cells, first uncovered, over the cells in the
    /// order `v * cells_u + u`.
    pub runs: Vec<u32>,
}

/// `rpc/link_model`: the table of P_L [PDN12, eq. 2].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LinkModelReply {
    /// Id of the mission.
    pub mission: String,
    /// The answer rests on all events below.
    pub graph_seq: u64,
    /// Bins of each saliency.
    pub bins: u32,
    /// Row-major, `bins * bins`, symmetric.
    pub cells: Vec<LinkBin>,
}

/// One bin of the table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LinkBin {
    /// Beta prior a.
    pub prior_registered: f64,
    /// Beta prior b.
    pub prior_failed: f64,
    /// Links proposed in the mission.
    pub proposed: u64,
    /// Those of them that registered.
    pub registered: u64,
    /// (registered + a) / (proposed + a + b).
    pub probability: f64,
}
