//! A survey like that of the paper's hull, as long as one likes: a boustrophedon over a plane with salient
//! patches, and what the vehicle measures on the way.

use nalgebra::{UnitQuaternion, Vector3, Vector6};
use pdn_kernel::se3::{self, Pose};
use pdn_kernel::so3;

use crate::draw::Draw;

/// Distance of keyframes along a track, m.
pub const SPACING_M: f64 = 0.5;
/// Distance of tracks, m: neighbours across tracks are within reach of a registration.
pub const TRACK_SPACING_M: f64 = 0.7;
/// Keyframes on a track of 40 m.
pub const KEYFRAMES_PER_TRACK: usize = 80;
/// Baselines of registrations, m.
pub const BASELINES_M: [f64; 2] = [0.3, 0.9];
/// Registrations that a keyframe proposes at most.
pub const MAX_LINKS: usize = 4;
/// S_L inside and outside of salient patches.
pub const SALIENCY: [f64; 2] = [0.98, 0.15];
/// Registration rates: both keyframes salient, one, none.
pub const RATES: [f64; 3] = [0.85, 0.05, 0.005];

/// Odometry: m and rad per square root of metre.
pub const ODOMETRY_SIGMAS: [f64; 2] = [0.012, 0.05 * DEGREE];
/// Attitude, each axis, rad.
pub const ATTITUDE_SIGMA_RAD: f64 = 0.25 * DEGREE;
/// Depth, m.
pub const DEPTH_SIGMA_M: f64 = 0.02;
/// Camera: direction of the baseline and relative rotation, each component, rad.
pub const CAMERA_SIGMAS_RAD: [f64; 2] = [DEGREE, 0.1 * DEGREE];
/// The first keyframe: m and rad.
pub const PRIOR_SIGMAS: [f64; 2] = [0.02, 0.1 * DEGREE];

const DEGREE: f64 = std::f64::consts::PI / 180.0;
const SEED: u64 = 1;

/// What a keyframe is worth, and what was measured when it was made.
pub struct Keyframe {
    /// S_L.
    pub local_saliency: f64,
    /// S_G.
    pub global_saliency: f64,
    /// How it was reached: odometry from the keyframe before, or the prior of the first.
    pub arrival: Measured,
    /// What else was measured there.
    pub sensed: Vec<Measured>,
}

impl Keyframe {
    /// All measurements, the arrival first.
    pub fn measured(&self) -> impl Iterator<Item = &Measured> {
        std::iter::once(&self.arrival).chain(&self.sensed)
    }
}

/// A measurement of the newest keyframe.
pub enum Measured {
    /// Where the survey begins.
    Prior { world_from_body: Pose, sigmas: Vector6<f64> },
    /// The motion from the keyframe before.
    Odometry { earlier_from_later: Pose, sigmas: Vector6<f64> },
    /// The orientation in the world.
    Attitude { rotation: UnitQuaternion<f64> },
    /// Depth, m.
    Depth { depth_m: f64 },
    /// A registration with an earlier keyframe. The length of the translation between the cameras is that of
    /// the truth, of which a camera knows nothing.
    Camera { earlier: usize, earlier_from_later: Pose },
}

/// Camera in the body frame: it looks down, the top of its image ahead.
pub fn body_from_camera() -> Pose {
    let quarter = Vector3::z() * std::f64::consts::FRAC_PI_2;
    Pose::from_parts(nalgebra::Translation3::identity(), so3::exp(&quarter))
}

/// Deviations of odometry over a distance, `[m; rad]`.
pub fn odometry_sigmas(distance_m: f64) -> Vector6<f64> {
    spread(ODOMETRY_SIGMAS.map(|sigma| sigma * distance_m.sqrt()))
}

/// The keyframes of a survey of which a share is salient, in the order in which they are made.
pub fn keyframes(count: usize, salient_share: f64) -> Vec<Keyframe> {
    let mut draw = Draw(SEED);
    let truth: Vec<Pose> = (0..count).map(|index| true_pose(index, &mut draw)).collect();
    let richness: Vec<f64> = truth.iter().map(richness).collect();
    let limit = quantile(&richness, 1.0 - salient_share);
    let is_salient = |index: usize| richness[index] > limit;
    let mut keyframes = Vec::with_capacity(count);
    for (index, pose) in truth.iter().enumerate() {
        let arrival = arrival(&truth, index, &mut draw);
        let rotation = so3::exp(&draw.normals_of(ATTITUDE_SIGMA_RAD)) * pose.rotation;
        let depth_m = pose.translation.z + DEPTH_SIGMA_M * draw.normal();
        let mut sensed = vec![Measured::Attitude { rotation }, Measured::Depth { depth_m }];
        let mut proposals: Vec<(usize, f64, usize)> = neighbours(&truth, index)
            .into_iter()
            .map(|(earlier, baseline_m)| {
                (2 - usize::from(is_salient(index)) - usize::from(is_salient(earlier)), baseline_m, earlier)
            })
            .collect();
        proposals.sort_by(|one, other| one.partial_cmp(other).expect("distances are numbers"));
        for &(bare, _, earlier) in proposals.iter().take(MAX_LINKS) {
            if draw.share() < RATES[bare] {
                sensed.push(registration(&truth, earlier, index, &mut draw));
            }
        }
        let local_saliency = if is_salient(index) { SALIENCY[0] } else { SALIENCY[1] };
        let global_saliency = if is_salient(index) { 0.5 + 0.5 * richness[index].abs() } else { 0.1 };
        keyframes.push(Keyframe { local_saliency, global_saliency, arrival, sensed });
    }
    keyframes
}

/// On the grid of the survey, but for the swell.
fn true_pose(index: usize, draw: &mut Draw) -> Pose {
    let (track, along) = (index / KEYFRAMES_PER_TRACK, index % KEYFRAMES_PER_TRACK);
    let forward = track % 2 == 0;
    let x = if forward { along } else { KEYFRAMES_PER_TRACK - 1 - along } as f64 * SPACING_M;
    let heading = if forward { 0.0 } else { std::f64::consts::PI };
    let place = Vector3::new(x, track as f64 * TRACK_SPACING_M, 8.5) + draw.normals_of(0.02);
    let turn = so3::exp(&draw.normals_of(0.5 * DEGREE)) * so3::exp(&Vector3::new(0.0, 0.0, heading));
    Pose::from_parts(place.into(), turn)
}

/// In [-1, 1], in patches of a few metres.
fn richness(pose: &Pose) -> f64 {
    let turns = |metres: f64, period_m: f64| (std::f64::consts::TAU * metres / period_m).sin();
    turns(pose.translation.x, 18.0) * turns(pose.translation.y, 14.0)
}

fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[((share * sorted.len() as f64) as usize).min(sorted.len() - 1)]
}

fn arrival(truth: &[Pose], index: usize, draw: &mut Draw) -> Measured {
    let Some(before) = index.checked_sub(1) else {
        return Measured::Prior { world_from_body: truth[0], sigmas: spread(PRIOR_SIGMAS) };
    };
    let step = truth[before].inverse() * truth[index];
    let sigmas = odometry_sigmas(step.translation.vector.norm());
    Measured::Odometry { earlier_from_later: step * se3::exp(&draw.normals(&sigmas)), sigmas }
}

/// Earlier keyframes at a distance that registers, with their distances.
fn neighbours(truth: &[Pose], index: usize) -> Vec<(usize, f64)> {
    let track_start = index - index % KEYFRAMES_PER_TRACK;
    let mirrored = (2 * track_start).checked_sub(index + 1);
    let beside = mirrored.map_or(0..0, |mirrored| mirrored.saturating_sub(3)..(mirrored + 4).min(index));
    let behind = index.saturating_sub(3)..index;
    let mut all: Vec<usize> = beside.chain(behind).collect();
    all.sort_unstable();
    all.dedup();
    let baseline_m =
        |earlier: usize| (truth[earlier].translation.vector - truth[index].translation.vector).norm();
    let [least_m, greatest_m] = BASELINES_M;
    let with_baseline = all.into_iter().map(|earlier| (earlier, baseline_m(earlier)));
    with_baseline.filter(|(_, baseline_m)| (least_m..=greatest_m).contains(baseline_m)).collect()
}

/// Noise turns the baseline, and the later camera.
fn registration(truth: &[Pose], earlier: usize, later: usize, draw: &mut Draw) -> Measured {
    let relative = (truth[earlier] * body_from_camera()).inverse() * truth[later] * body_from_camera();
    let [direction_sigma, rotation_sigma] = CAMERA_SIGMAS_RAD;
    let translation = so3::exp(&draw.normals_of(direction_sigma)) * relative.translation.vector;
    let rotation = relative.rotation * so3::exp(&draw.normals_of(rotation_sigma));
    Measured::Camera { earlier, earlier_from_later: Pose::from_parts(translation.into(), rotation) }
}

fn spread([translation, rotation]: [f64; 2]) -> Vector6<f64> {
    Vector6::new(translation, translation, translation, rotation, rotation, rotation)
}
