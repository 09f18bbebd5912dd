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

/// Why the graph cannot be solved with an event; `ids` are the keyframes of its nodes.
pub fn unsolvable(ids: &[u64], error: KernelError) -> StateError {
    let (keyframe, evidence) = singular(|node| ids.get(node.index()).copied(), error);
    StateError::Singular { keyframe, evidence }
}

/// Why a covariance that is asked for cannot be computed; `id` gives a node's keyframe.
pub fn uncomputable(id: impl Fn(Node) -> Option<u64>, error: KernelError) -> StateError {
    let (keyframe, evidence) = singular(id, error);
    StateError::SingularAnswer { keyframe, evidence }
}

/// Why there is no answer; `id` gives a node's keyframe.
pub fn planning(id: impl Fn(Node) -> Option<u64>, error: impl Into<PlanningError>) -> StateError {
    match error.into() {
        PlanningError::NoKeyframe => StateError::NotReady,
        PlanningError::OutOfRange { name, value, wanted } => {
            StateError::OutOfRange { field: name.to_string(), value, range: wanted }
        }
        PlanningError::Kernel(error) => uncomputable(id, error),
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

/// The keyframe at which elimination failed, where that is known, and what was found.
fn singular(id: impl Fn(Node) -> Option<u64>, error: KernelError) -> (Option<u64>, String) {
    match error {
        KernelError::NotPositiveDefinite { node, pivot } => {
            (id(node), format!("the pivot at a keyframe is {pivot:e}"))
        }
        error => (None, error.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FAILED: KernelError = KernelError::NotPositiveDefinite { node: Node(1), pivot: -0.5 };

    /// An event is undone and a question is not, and each names the keyframe, not the node.
    #[test]
    fn events_and_questions_are_told_in_their_own_words() {
        let event = unsolvable(&[70, 71], FAILED).to_string();
        assert!(event.contains("undone") && event.contains("it and keyframe 71 carry"), "{event}");
        for question in [uncomputable(|_| Some(71), FAILED), planning(|_| Some(71), FAILED)] {
            let question = question.to_string();
            assert!(
                question.contains("there is no answer") && question.contains("of keyframe 71"),
                "{question}"
            );
            assert!(!question.contains("event") && !question.contains("undone"), "{question}");
        }
    }

    #[test]
    fn a_keyframe_that_is_not_known_is_not_spoken_of() {
        let other = || KernelError::VirtualNotPositiveDefinite { node: 3, pivot: 0.0 };
        for error in [unsolvable(&[], FAILED), uncomputable(|_| None, FAILED), planning(|_| None, other())] {
            assert!(!error.to_string().contains("(unknown)"), "{error}");
        }
    }
}
