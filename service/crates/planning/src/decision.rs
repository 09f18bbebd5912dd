//! What is asked and what is answered.

use crate::settings::Allowable;
use nalgebra::Matrix6;
use pdn_kernel::se3::Pose;

/// How a decision is asked for; the default is the mission's own, with every number.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Question {
    /// Weight of the uncertainty, in [0, 1], instead of the mission's.
    pub alpha: Option<f64>,
    /// The allowance instead of the mission's.
    pub allowable: Option<Allowable>,
    /// Tell only the best candidate. Evaluate none where the choice is certain without: below the allowance
    /// U^0 is 0, so no reward can exceed that of exploring [PDN12, eqs. 5 to 9].
    pub choice_only: bool,
}

/// Explore or revisit, with every number behind it [PDN12, III].
#[derive(Clone, Debug, PartialEq)]
pub struct Decision {
    /// The newest keyframe, virtual node 0.
    pub robot: Robot,
    /// Weight of the uncertainty.
    pub alpha: f64,
    /// The allowance.
    pub allowable: Allowable,
    /// What to do [PDN12, eq. 9].
    pub action: Action,
    /// Candidate 0.
    pub exploration: Exploration,
    /// Candidates that were evaluated, numbered from 1 in the order of their waypoints' keyframe ids.
    pub candidates: Vec<Candidate>,
    /// Keyframes of the waypoints that were not evaluated because the question was stopped.
    pub not_evaluated: Vec<u64>,
    /// A_target, m^2.
    pub target_m2: f64,
    /// A_covered, m^2.
    pub covered_m2: f64,
    /// Whether every candidate was evaluated.
    pub complete: bool,
    /// Why, in one sentence for a person.
    pub reason: String,
}

/// Candidates for paths that a person drew.
#[derive(Clone, Debug, PartialEq)]
pub struct Evaluation {
    /// Candidate 0.
    pub exploration: Exploration,
    /// One for each path, numbered from 1 in the order of the paths.
    pub candidates: Vec<Candidate>,
    /// Indices of the paths that were not evaluated because the question was stopped.
    pub not_evaluated: Vec<usize>,
}

/// The newest keyframe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Robot {
    /// Its id.
    pub keyframe: u64,
    /// `world_from_body`, its linearisation point.
    pub pose: Pose,
    /// Sigma_rr, its marginal covariance.
    pub covariance: Matrix6<f64>,
}

/// What the vehicle should do next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    /// Go on with the survey.
    Explore,
    /// Go to a candidate's waypoint along its path, and come back.
    Revisit {
        /// Number of the candidate, from 1.
        candidate: u32,
        /// The waypoint's keyframe.
        keyframe: u64,
    },
}

/// Going on with the survey, candidate 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exploration {
    /// Sigma_exp: the robot's marginal carried one step by the last odometry.
    pub covariance: Matrix6<f64>,
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
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// k.
    pub candidate: u32,
    /// The waypoint; none for a path that a person drew.
    pub keyframe: Option<u64>,
    /// Keyframes from the robot to the waypoint, both included; empty for a path that a person drew.
    pub path: Vec<u64>,
    /// Length of the way out, m.
    pub one_way_m: f64,
    /// Virtual nodes of the round trip; the last one is at the robot's pose.
    pub nodes: u32,
    /// Sigma_nn: expected covariance at the last virtual node [PDN12, eq. 4].
    pub covariance: Matrix6<f64>,
    /// U^k [PDN12, eq. 5].
    pub uncertainty: f64,
    /// U^k with every link registered (P = 1).
    pub uncertainty_all_links: f64,
    /// U^k with none registered (P = 0).
    pub uncertainty_no_links: f64,
    /// Greatest (|Sigma_ii| / |Sigma_allow|)^(1/6) over the virtual nodes i = 1..n of the same inverse as
    /// Sigma_nn.
    pub peak_uncertainty: f64,
    /// A_redundant: twice `one_way_m` times the swath, m^2.
    pub redundant_m2: f64,
    /// A^k [PDN12, eq. 6].
    pub area: f64,
    /// C^k [PDN12, eq. 7].
    pub penalty: f64,
    /// R^k [PDN12, eq. 8].
    pub reward: f64,
    /// The alpha above which this beats exploring; none when U^k >= U^0.
    pub break_even_alpha: Option<f64>,
    /// Sum of P_L over the links.
    pub expected_links: f64,
    /// World poses of the virtual nodes 1..n.
    pub poses: Vec<Pose>,
    /// Node, keyframe and probability of each expected registration.
    pub links: Vec<(u32, u64, f64)>,
}
