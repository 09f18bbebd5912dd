//! Registrations that a virtual node may expect [PDN12, eq. 3].

use crate::distance::nanometres;
use crate::snapshot::Snapshot;
use crate::view_angle::{AngleLimit, optical_axis};
use pdn_kernel::Node;
use pdn_kernel::se3::Pose;

/// Far above what rounding to the nanometre adds to a baseline, m.
const REACH_MORE_M: f64 = 1e-8;

/// A registration that a virtual node may expect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// The keyframe that the virtual node registers with.
    pub keyframe: Node,
    /// P_L.
    pub probability: f64,
}

/// L_i: the registrations that a virtual node proposes [PDN12, eq. 3]. `nearest` is the keyframe nearest to
/// it, whose saliency is S_Lc and whose `body_from_camera` it takes.
///
/// The baseline is the distance between the camera centres, as in the camera factor. It lies in
/// [`min_baseline_m`, `max_baseline_m`], the optical axes differ by `max_view_angle_rad` at most, and of what
/// remains at most `max_links` are taken by greatest P_L, then least baseline (to the nanometre), then lowest
/// id.
pub fn links(snapshot: &Snapshot, world_from_body: &Pose, nearest: Node) -> Vec<Link> {
    let settings = &snapshot.settings;
    let current = snapshot.keyframe(nearest);
    let world_from_camera = world_from_body * current.body_from_camera;
    let baselines = nanometres(settings.min_baseline_m)..=nanometres(settings.max_baseline_m);
    let (axis, angle) = (optical_axis(&world_from_camera), AngleLimit::new(settings.max_view_angle_rad));
    let mut proposals: Vec<(Link, i64, u64)> = Vec::new();
    let cameras = snapshot.cameras();
    let reach_m = settings.max_baseline_m + REACH_MORE_M;
    cameras.centres.visit(&world_from_camera.translation.vector, reach_m, |keyframe, baseline_m| {
        let baseline = nanometres(baseline_m);
        if baselines.contains(&baseline) && angle.admits(&axis, &cameras.axes[keyframe.index()]) {
            let target = snapshot.keyframe(keyframe);
            let probability = snapshot.link_model.probability(current.saliency.local, target.saliency.local);
            proposals.push((Link { keyframe, probability }, baseline, target.id));
        }
    });
    proposals.sort_by(|(link, baseline, id), (other, other_baseline, other_id)| {
        let by_probability = other.probability.total_cmp(&link.probability);
        by_probability.then(baseline.cmp(other_baseline)).then(id.cmp(other_id))
    });
    proposals.truncate(settings.max_links);
    proposals.into_iter().map(|(link, ..)| link).collect()
}
