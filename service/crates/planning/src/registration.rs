//! Registrations that a virtual node may expect, and how probable each is [PDN12, eq. 2].

use crate::distance::nanometres;
use crate::error::PlanningError;
use crate::snapshot::Snapshot;
use nalgebra::Vector3;
use pdn_kernel::Node;
use pdn_kernel::se3::Pose;

/// The empirical table of P_L over the two local saliencies: `bins` x `bins`, equal widths on [0, 1], symmetric.
///
/// A link between saliencies of bins i and j is the same event as one between j and i: it counts once, in a cell
/// that (i, j) and (j, i) share.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkModel {
    bins: usize,
    cells: Vec<LinkBin>,
}

/// One cell of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkBin {
    /// Beta prior a: registered links known beforehand.
    pub prior_registered: f64,
    /// Beta prior b: failed links known beforehand.
    pub prior_failed: f64,
    /// Links proposed in the mission.
    pub proposed: u64,
    /// Those of them that registered.
    pub registered: u64,
}

impl LinkBin {
    /// P_L = (registered + a) / (proposed + a + b), the mean of the Beta posterior.
    pub fn probability(&self) -> f64 {
        (self.registered as f64 + self.prior_registered)
            / (self.proposed as f64 + self.prior_registered + self.prior_failed)
    }
}

impl LinkModel {
    /// A table without outcomes; `prior` holds `[a, b]` of each bin, row-major.
    ///
    /// # Errors
    /// [`PlanningError::LinkModelShape`] unless there are `bins * bins` pairs and at least one bin;
    /// [`PlanningError::LinkModelPrior`] for a pair that is not finite, negative, zero twice, or not symmetric.
    pub fn new(bins: usize, prior: &[[f64; 2]]) -> Result<LinkModel, PlanningError> {
        if bins == 0 || bins.checked_mul(bins) != Some(prior.len()) {
            return Err(PlanningError::LinkModelShape { bins, pairs: prior.len() });
        }
        for (index, &[registered, failed]) in prior.iter().enumerate() {
            let (row, column) = (index / bins, index % bins);
            let beta = registered.is_finite() && failed.is_finite() && registered >= 0.0 && failed >= 0.0;
            if !beta || registered + failed <= 0.0 || prior[column * bins + row] != prior[index] {
                return Err(PlanningError::LinkModelPrior { row, column, registered, failed });
            }
        }
        let cells = prior.iter().map(|&[prior_registered, prior_failed]| LinkBin {
            prior_registered,
            prior_failed,
            proposed: 0,
            registered: 0,
        });
        Ok(LinkModel { bins, cells: cells.collect() })
    }

    /// Counts a registration that was tried between images of these local saliencies.
    pub fn record(&mut self, saliency: f64, other_saliency: f64, registered: bool) {
        let index = self.index(saliency, other_saliency);
        let cell = &mut self.cells[index];
        cell.proposed += 1;
        cell.registered += u64::from(registered);
    }

    /// P_L(l = 1; S_Lc, S_Lt) [PDN12, eq. 2], symmetric in its arguments.
    ///
    /// ```
    /// let mut model = pdn_planning::LinkModel::new(1, &[[170.0, 30.0]]).unwrap();
    /// assert_eq!(model.probability(0.98, 0.98), 0.85);
    /// model.record(0.98, 0.15, false);
    /// assert_eq!(model.probability(0.15, 0.98), 170.0 / 201.0);
    /// ```
    pub fn probability(&self, current_saliency: f64, target_saliency: f64) -> f64 {
        self.cells[self.index(current_saliency, target_saliency)].probability()
    }

    /// Bins of each saliency.
    pub fn bins(&self) -> usize {
        self.bins
    }

    /// The table row by row, `bins * bins` cells; mirrored cells are equal.
    pub fn cells(&self) -> Vec<LinkBin> {
        let bins = self.bins;
        (0..bins * bins).map(|index| self.cells[self.shared(index / bins, index % bins)]).collect()
    }

    fn index(&self, saliency: f64, other_saliency: f64) -> usize {
        let bin =
            |saliency: f64| ((saliency * self.bins as f64).floor().max(0.0) as usize).min(self.bins - 1);
        self.shared(bin(saliency), bin(other_saliency))
    }

    fn shared(&self, row: usize, column: usize) -> usize {
        row.min(column) * self.bins + row.max(column)
    }
}

/// Far above what rounding does to a cosine.
const COSINE_ROUNDING: f64 = 1e-9;

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

/// L_i: the registrations that a virtual node proposes [PDN12, eq. 3]. `nearest` is the keyframe nearest to it,
/// whose saliency is S_Lc and whose `body_from_camera` it takes.
///
/// The baseline is the distance between the camera centres, as in the camera factor. It lies in
/// [`min_baseline_m`, `max_baseline_m`], the optical axes differ by `max_view_angle_rad` at most, and of what
/// remains at most `max_links` are taken by greatest P_L, then least baseline (to the nanometre), then lowest id.
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

/// Angle between the optical axes of two cameras, rad in [0, pi]; exact also for small angles.
pub fn view_angle_rad(world_from_camera: &Pose, world_from_other_camera: &Pose) -> f64 {
    angle_rad(&optical_axis(world_from_camera), &optical_axis(world_from_other_camera))
}

/// Optical axis of a camera in the world, a unit vector.
pub(crate) fn optical_axis(world_from_camera: &Pose) -> Vector3<f64> {
    world_from_camera.rotation * Vector3::z()
}

/// By how much optical axes may differ.
pub(crate) struct AngleLimit {
    limit_rad: f64,
    cosine: f64,
}

impl AngleLimit {
    pub(crate) fn new(limit_rad: f64) -> AngleLimit {
        AngleLimit { limit_rad, cosine: limit_rad.min(std::f64::consts::PI).cos() }
    }

    /// Whether two unit vectors differ by it at most. The cosine tells without the angle, unless it is near the limit's.
    pub(crate) fn admits(&self, axis: &Vector3<f64>, other: &Vector3<f64>) -> bool {
        let inside = axis.dot(other) - self.cosine;
        if inside.abs() > COSINE_ROUNDING { inside > 0.0 } else { angle_rad(axis, other) <= self.limit_rad }
    }
}

/// Angle between two unit vectors, rad in [0, pi]; exact also for small angles.
fn angle_rad(axis: &Vector3<f64>, other: &Vector3<f64>) -> f64 {
    axis.cross(other).norm().atan2(axis.dot(other))
}
