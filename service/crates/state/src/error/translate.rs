//! Findings of the kernel and the planner, named by the field or keyframe that the sender knows.

use crate::change::Measurement;
use crate::error::StateError;
use crate::limits::UNIT_TOLERANCE;
use pdn_kernel::{KernelError, Node};
use pdn_planning::PlanningError;

/// What the kernel finds wrong with the value of a field.
pub fn kernel(field: &str, error: KernelError) -> StateError {
    let field = field.to_string();
    match error {
        KernelError::NotFinite { value, .. } => StateError::NotFinite { field, value },
        KernelError::NotSymmetric { .. } | KernelError::CovarianceNotPositiveDefinite { .. } => {
            StateError::NotPositiveDefinite { field, evidence: error.to_string() }
        }
        KernelError::NotUnit { norm, .. } => StateError::NotUnit { field, norm, tolerance: UNIT_TOLERANCE },
        KernelError::NotPositive { value, .. } => StateError::OutOfRange { field, value, range: "above 0" },
        other => StateError::Invalid { field, problem: other.to_string() },
    }
}

/// What the kernel finds wrong with a measurement.
pub fn measurement(measurement: &Measurement, error: KernelError) -> StateError {
    match (measurement.keyframes(), error) {
        ((from, Some(to)), KernelError::DegenerateBaseline { baseline_m, min_baseline_m }) => {
            StateError::DegenerateBaseline { from, to, baseline_m, min_baseline_m }
        }
        (_, error) => kernel(&format!("factor.{}", measurement.kind().name()), error),
    }
}

/// Why the graph cannot be solved; `ids` are the keyframes of its nodes.
pub fn unsolvable(ids: &[u64], error: KernelError) -> StateError {
    singular(|node| ids.get(node.index()).copied(), error)
}

/// Why there is no answer; `id` gives a node's keyframe.
pub fn planning(id: impl Fn(Node) -> Option<u64>, error: impl Into<PlanningError>) -> StateError {
    match error.into() {
        PlanningError::NoKeyframe => StateError::NotReady,
        PlanningError::OutOfRange { name, value, wanted } => {
            StateError::OutOfRange { field: name.to_string(), value, range: wanted }
        }
        PlanningError::Kernel(error) => singular(id, error),
        PlanningError::TooManyCells { limit, .. } => StateError::Limit {
            what: "cells of the coverage raster",
            bound: "max_cells",
            limit: limit as u64,
            advice: "choose a larger cell_m or a smaller target",
        },
        error => {
            let field = match &error {
                PlanningError::LinkModelShape { .. } | PlanningError::LinkModelPrior { .. } => {
                    "link_model.prior"
                }
                PlanningError::Facet { .. } => "target.facets",
                _ => "paths",
            };
            StateError::Invalid { field: field.to_string(), problem: error.to_string() }
        }
    }
}

fn singular(id: impl Fn(Node) -> Option<u64>, error: KernelError) -> StateError {
    match error {
        KernelError::NotPositiveDefinite { node, pivot } => StateError::Singular {
            keyframe: id(node),
            evidence: format!("the pivot at a keyframe is {pivot:e}"),
        },
        error => StateError::Singular { keyframe: None, evidence: error.to_string() },
    }
}
