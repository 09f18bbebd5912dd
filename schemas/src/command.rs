//! What an operator or a vehicle sends with a query.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Payload of `op/{start,pause,resume,hold,complete,abort}`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Command {
    /// Why, in a sentence for whoever reads the record; may be empty.
    pub reason: String,
}

/// Payload of `rpc/evaluate`: paths that a person drew.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EvaluateRequest {
    /// Each path is a list of world points `[x, y, z]`, m, from the robot's position on; the way back follows
    /// the same points.
    pub paths: Vec<Vec<[f64; 3]>>,
}
