//! The numbers of a checkpoint in bincode.

use super::{Checkpoint, Unusable};
use crate::fold::SolvedState;
use crate::survey::Progress;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3, Vector6};
use pdn_kernel::elimination::{FrontState, Ordered, TreeState};
use pdn_kernel::se3::Pose;
use pdn_kernel::smoother::SmootherState;
use serde::{Deserialize, Serialize};

/// Bytes that a reader takes at most: a million keyframes have fewer.
const MAX_BYTES: usize = 1 << 30;

/// Translation, m, and quaternion [x, y, z, w].
type PoseNumbers = ([f64; 3], [f64; 4]);

#[derive(Serialize, Deserialize)]
struct Content {
    software: String,
    identity: u64,
    record: u64,
    crc_before: u32,
    rejected: u64,

    linearizations: Vec<PoseNumbers>,
    steps: Vec<[f64; 6]>,
    untold: Vec<f64>,
    restless: Vec<u32>,
    factors: u64,

    fronts: Vec<Option<[Vec<u32>; 3]>>,
    unused: Vec<u32>,
    flops: f64,
    ordered: (u64, f64, u32),

    converged: bool,
    progress_m: f64,
    progress_at: Option<[f64; 3]>,
    world_from_camera: Vec<Option<PoseNumbers>>,
}

/// The bytes of a checkpoint with what it belongs to.
pub(super) fn encode(checkpoint: &Checkpoint, software: &str, identity: u64, crc_before: u32) -> Vec<u8> {
    let SolvedState { smoother, converged, progress, world_from_camera } = &checkpoint.solved;
    let tree = &smoother.tree;
    let front = |front: &FrontState| [&front.frontal, &front.separator, &front.children].map(Clone::clone);
    let content = Content {
        software: software.to_owned(),
        identity,
        record: checkpoint.record,
        crc_before,
        rejected: checkpoint.rejected,
        linearizations: smoother.linearizations.iter().map(numbers).collect(),
        steps: smoother.steps.iter().map(|step| (*step).into()).collect(),
        untold: smoother.unpropagated.clone(),
        restless: smoother.to_relinearize.clone(),
        factors: smoother.factors,
        fronts: tree.fronts.iter().map(|place| place.as_ref().map(front)).collect(),
        unused: tree.unused.clone(),
        flops: tree.flops,
        ordered: (tree.ordered.nodes, tree.ordered.flops, tree.ordered.height),
        converged: *converged,
        progress_m: progress.done_m,
        progress_at: progress.last.map(Into::into),
        world_from_camera: world_from_camera.iter().map(|pose| pose.as_ref().map(numbers)).collect(),
    };
    // Vectors of numbers can always be written to memory.
    bincode::serde::encode_to_vec(&content, bincode::config::standard()).unwrap_or_default()
}

/// The checkpoint of these bytes, the software that wrote them, the journal's identity and the CRC before the
/// record.
pub(super) fn decode(bytes: &[u8]) -> Result<(Checkpoint, String, u64, u32), Unusable> {
    let config = bincode::config::standard().with_limit::<MAX_BYTES>();
    let (content, read): (Content, usize) =
        bincode::serde::decode_from_slice(bytes, config).map_err(|_| Unusable::Damaged)?;
    if read != bytes.len() {
        return Err(Unusable::Damaged);
    }
    let (nodes, flops, height) = content.ordered;
    let front = |[frontal, separator, children]: [Vec<u32>; 3]| FrontState { frontal, separator, children };
    let tree = TreeState {
        fronts: content.fronts.into_iter().map(|place| place.map(front)).collect(),
        unused: content.unused,
        flops: content.flops,
        ordered: Ordered { nodes, flops, height },
    };
    let smoother = SmootherState {
        linearizations: content.linearizations.iter().map(pose).collect(),
        steps: content.steps.into_iter().map(Vector6::from).collect(),
        unpropagated: content.untold,
        to_relinearize: content.restless,
        factors: content.factors,
        tree,
    };
    let solved = SolvedState {
        smoother,
        converged: content.converged,
        progress: Progress { done_m: content.progress_m, last: content.progress_at.map(Vector3::from) },
        world_from_camera: content.world_from_camera.iter().map(|place| place.as_ref().map(pose)).collect(),
    };
    let checkpoint = Checkpoint { record: content.record, rejected: content.rejected, solved };
    Ok((checkpoint, content.software, content.identity, content.crc_before))
}

fn numbers(pose: &Pose) -> PoseNumbers {
    (pose.translation.vector.into(), pose.rotation.coords.into())
}

/// The pose with the very bits that were kept: nothing is normalised.
fn pose((translation, rotation): &PoseNumbers) -> Pose {
    let rotation = UnitQuaternion::new_unchecked(Quaternion::from_vector((*rotation).into()));
    Isometry3::from_parts(Translation3::from(*translation), rotation)
}
