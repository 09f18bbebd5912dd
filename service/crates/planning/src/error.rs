//! What can be wrong with a question or with what it rests on.

use pdn_kernel::KernelError;
use thiserror::Error;

/// Why there is no answer.
#[derive(Debug, Error)]
pub enum PlanningError {
    /// The snapshot holds no keyframe, so there is no robot to plan for.
    #[error("the pose graph has no keyframe yet; send one with a prior before asking for a decision")]
    NoKeyframe,
    /// A setting or a parameter of a question is outside of what has a meaning.
    #[error("{name} is {value}, but must be {wanted}")]
    OutOfRange {
        /// Name of the setting, as in the mission's configuration.
        name: &'static str,
        /// What was given.
        value: f64,
        /// What would do.
        wanted: &'static str,
    },
    /// The table of registration probabilities has another number of prior pairs than bins ask for.
    #[error("link_model has {pairs} prior pairs, but {bins} bins need {bins} x {bins}")]
    LinkModelShape {
        /// Bins of each saliency.
        bins: usize,
        /// Pairs given.
        pairs: usize,
    },
    /// The prior of a registration bin differs from that of its mirror image, or is no Beta prior.
    #[error(
        "link_model prior of bin ({row}, {column}) is [{registered}, {failed}]; it must be finite, not \
         negative, not both zero, and equal to that of ({column}, {row})"
    )]
    LinkModelPrior {
        /// Bin of the first saliency.
        row: usize,
        /// Bin of the second.
        column: usize,
        /// a.
        registered: f64,
        /// b.
        failed: f64,
    },
    /// A facet is no rectangle with a raster.
    #[error("facet {facet}: {problem}")]
    Facet {
        /// Its index in the target.
        facet: usize,
        /// What is wrong and what would do.
        problem: &'static str,
    },
    /// The rasters would have too many cells.
    #[error("the target has more than {limit} cells; take a larger cell_m than {cell_m}")]
    TooManyCells {
        /// Greatest number of cells over all facets.
        limit: usize,
        /// Edge of a cell, m.
        cell_m: f64,
    },
    /// A path that a person drew holds a coordinate that is no number.
    #[error("path {path} has a point that is not finite")]
    PathNotFinite {
        /// Its index in the question.
        path: usize,
    },
    /// A path does not leave the robot's place.
    #[error("path {path} does not leave the robot's place; give points that lead away from it")]
    PathEmpty {
        /// Its index in the question.
        path: usize,
    },
    /// A path needs too many virtual nodes.
    #[error("path {path} is {one_way_m} m long one way and needs more than {limit} virtual nodes")]
    PathTooLong {
        /// Its index in the question, or the candidate's number less one.
        path: usize,
        /// Length of the way out, m.
        one_way_m: f64,
        /// Greatest number of virtual nodes.
        limit: usize,
    },
    /// The graph's information or a covariance is not positive definite, or another fact of the mathematics.
    #[error(transparent)]
    Kernel(#[from] KernelError),
}
