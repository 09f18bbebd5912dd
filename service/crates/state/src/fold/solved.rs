//! What a checkpoint keeps of a fold.

use crate::survey::Progress;
use pdn_kernel::se3::Pose;
use pdn_kernel::smoother::SmootherState;

/// What of a fold is solved for and so does not follow from its events at once; a checkpoint keeps it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct SolvedState {
    pub smoother: SmootherState,
    pub converged: bool,
    pub progress: Progress,
    /// By node, where its photograph lies in the rasters; none before the first.
    pub world_from_camera: Vec<Option<Pose>>,
}
