//! What is asked, and what the answer rests on.

use crate::view::View;
use pdn_schemas::config::Allowable;
use pdn_schemas::reply::Phase;
use std::sync::Arc;

/// What a decision, or the evaluation of paths, is asked with.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DecisionRequest {
    /// What to assume instead of the mission's settings; the default asks for the mission's own decision.
    pub what_if: WhatIf,
    /// Whether poses, links and the table of P_L come with it (`detail=full`).
    pub full: bool,
    /// Whether only the best candidate is told, and none where exploring is certain (`detail=choice`).
    pub choice_only: bool,
}

/// Assumptions of a question that changes nothing and is not counted: the weight and standard deviations of
/// the allowance. What is not set stays as the mission has it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct WhatIf {
    /// Weight of the uncertainty, in [0, 1].
    pub alpha: Option<f64>,
    /// North and east, m.
    pub sigma_xy_m: Option<f64>,
    /// Down, m.
    pub sigma_depth_m: Option<f64>,
    /// Roll and pitch, deg.
    pub sigma_tilt_deg: Option<f64>,
    /// Heading, deg.
    pub sigma_heading_deg: Option<f64>,
}

impl WhatIf {
    /// Whether anything is assumed.
    pub fn is_any(&self) -> bool {
        *self != WhatIf::default()
    }
}

/// What an answer rests on, and what it says of that.
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
