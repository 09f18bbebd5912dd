//! What a mission is: the payload of `op/configure`, as JSON, bincode or a TOML file.
//!
//! In JSON and TOML every field but `mission` and `target` may be left out; it then has the default that
//! stands in its doc, which is the paper's figure where the paper gives one.

use crate::shared::Pose;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Everything that a decision depends on besides the events.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MissionConfig {
    /// Id of the mission, `[a-z0-9_-]{1,64}`; never used twice by one vehicle.
    pub mission: String,
    /// The surface to photograph.
    pub target: Target,
    /// The navigation uncertainty that the operator allows, one standard deviation each.
    #[serde(default)]
    pub allowable: Allowable,
    /// Weight of the uncertainty against the area, in [0, 1]; default 1 [PDN12, eq. 7].
    #[serde(default = "one")]
    pub alpha: f64,
    /// The camera.
    #[serde(default)]
    pub camera: Camera,
    /// Dead reckoning, expected of the way ahead.
    #[serde(default)]
    pub odometry: Odometry,
    /// Attitude sensor.
    #[serde(default)]
    pub attitude: Attitude,
    /// Depth sensor.
    #[serde(default)]
    pub depth: Depth,
    /// Waypoints, paths and registrations.
    #[serde(default)]
    pub planner: Planner,
    /// What is known beforehand of the probability that a registration succeeds.
    #[serde(default)]
    pub link_model: LinkModel,
    /// Robust loss of each kind of factor.
    #[serde(default)]
    pub robust: Robust,
    /// Edge of a cell of the coverage raster, m; default 0.1.
    #[serde(default = "cell_m")]
    pub cell_m: f64,
    /// The planned way over the target, world points in m, of which the remaining length is told; default
    /// null.
    #[serde(default)]
    pub survey: Option<Vec<[f64; 3]>>,
    /// Prior on the first keyframe at the pose that its event carries; null if a `prior` factor will come.
    #[serde(default = "FirstKeyframeSigmas::some_default")]
    pub first_keyframe_sigmas: Option<FirstKeyframeSigmas>,
    /// A measurement of a kind without a robust loss that lies farther than this from what is believed of its
    /// keyframes is refused as `contradiction`, in standard deviations (Mahalanobis); default 20, null for no
    /// gate.
    #[serde(default = "gate_sigmas")]
    pub gate_sigmas: Option<f64>,
}

/// The surface to photograph.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Target {
    /// Planar rectangles; at least one.
    pub facets: Vec<Facet>,
    /// Area that counts as the whole, m^2; null for the sum of the facets.
    #[serde(default)]
    pub area_m2: Option<f64>,
}

/// A planar rectangle in the world, seen from the side to which `u x v` points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Facet {
    /// The corner from which the raster counts, `[x, y, z]`, m.
    pub origin: [f64; 3],
    /// Unit direction of the first edge.
    pub u: [f64; 3],
    /// Unit direction of the second edge, orthogonal to `u`.
    pub v: [f64; 3],
    /// Length along `u`, m.
    pub length_u_m: f64,
    /// Length along `v`, m.
    pub length_v_m: f64,
}

/// Standard deviations whose product is the sixth-root determinant that uncertainty is measured by
/// [PDN12, IV.A].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Allowable {
    /// North, m; default 0.25.
    pub x_m: f64,
    /// East, m; default 0.25.
    pub y_m: f64,
    /// Down, m; default 0.01.
    pub depth_m: f64,
    /// Degrees; default 0.1.
    pub roll_deg: f64,
    /// Degrees; default 0.1.
    pub pitch_deg: f64,
    /// Degrees; default 0.1.
    pub heading_deg: f64,
}

impl Default for Allowable {
    fn default() -> Self {
        Allowable { x_m: 0.25, y_m: 0.25, depth_m: 0.01, roll_deg: 0.1, pitch_deg: 0.1, heading_deg: 0.1 }
    }
}

/// The camera and what a registration of two of its images measures.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Camera {
    /// Pose of the camera (x right, y down, z along the optical axis) in the body frame (x forward, y right,
    /// z down); default looks straight down, image top forward.
    pub body_from_camera: Pose,
    /// Full angle along the camera's x axis, deg; default 56.
    pub horizontal_fov_deg: f64,
    /// Full angle along the camera's y axis, deg; default 44.
    pub vertical_fov_deg: f64,
    /// Farthest distance along the optical axis at which a surface counts as photographed, m; default 3.
    pub max_range_m: f64,
    /// Standard deviation of each component of the baseline direction, deg; default 1 [PDN12, III.D].
    pub direction_sigma_deg: f64,
    /// Standard deviation of each component of the relative rotation, deg; default 0.1 [PDN12, III.D].
    pub rotation_sigma_deg: f64,
}

impl Default for Camera {
    fn default() -> Self {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        Camera {
            body_from_camera: Pose { translation: [0.0; 3], rotation: [0.0, 0.0, half, half] },
            horizontal_fov_deg: 56.0,
            vertical_fov_deg: 44.0,
            max_range_m: 3.0,
            direction_sigma_deg: 1.0,
            rotation_sigma_deg: 0.1,
        }
    }
}

/// Noise of dead reckoning, growing with the square root of the distance, in body axes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Odometry {
    /// m per square root of metre; default 0.012 each.
    pub translation_sigma_m_per_sqrt_m: [f64; 3],
    /// deg per square root of metre; default 0.05 each.
    pub rotation_sigma_deg_per_sqrt_m: [f64; 3],
}

impl Default for Odometry {
    fn default() -> Self {
        Odometry { translation_sigma_m_per_sqrt_m: [0.012; 3], rotation_sigma_deg_per_sqrt_m: [0.05; 3] }
    }
}

/// Noise of the attitude sensor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Attitude {
    /// Standard deviation of each tilt, deg; default 0.25; null if there is no attitude sensor.
    pub tilt_sigma_deg: Option<f64>,
    /// Standard deviation of the heading, deg; default 0.25; null if the heading is not observed.
    pub heading_sigma_deg: Option<f64>,
}

impl Default for Attitude {
    fn default() -> Self {
        Attitude { tilt_sigma_deg: Some(0.25), heading_sigma_deg: Some(0.25) }
    }
}

/// Noise of the depth sensor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Depth {
    /// Standard deviation, m; default 0.02; null if there is no depth sensor.
    pub sigma_m: Option<f64>,
}

impl Default for Depth {
    fn default() -> Self {
        Depth { sigma_m: Some(0.02) }
    }
}

/// Waypoints, paths and registrations.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Planner {
    /// Local saliency from which a keyframe may be clustered; default 0.5 [PDN12, III.B].
    pub waypoint_local_saliency: f64,
    /// Radius of DBSCAN, m; default 1.5.
    pub eps_m: f64,
    /// Keyframes within that radius, itself included, that make a core point; default 4.
    pub min_points: u32,
    /// Greatest distance of a cluster's keyframes from the one that represents it, m; what is farther is
    /// represented by another. Default null: 24 times the median distance of consecutive keyframes.
    pub max_cluster_radius_m: Option<f64>,
    /// Greatest distance of two keyframes that the search connects, m; default null: 2.6 times the median
    /// distance of consecutive keyframes. It must exceed the distance of neighbouring tracklines, or paths
    /// can only go back the way that the vehicle came.
    pub edge_radius_m: Option<f64>,
    /// Greatest distance of successive virtual nodes, m; default null: the median distance of consecutive
    /// keyframes.
    pub sample_spacing_m: Option<f64>,
    /// A waypoint whose path is shorter is no candidate, m; default 3.
    pub min_revisit_m: f64,
    /// Shortest baseline of a registration, m; default 0.3.
    pub min_baseline_m: f64,
    /// Longest baseline of a registration, m; default 0.9.
    pub max_baseline_m: f64,
    /// Greatest angle between the optical axes of a registration, deg; default 30.
    pub max_view_angle_deg: f64,
    /// Registrations that a keyframe proposes at most; default 4.
    pub max_links: u32,
    /// Width that a pass photographs, m; default 1.6.
    pub swath_m: f64,
    /// Whether virtual nodes get the information of attitude and depth sensors; default true. False gives
    /// eq. (4) of the paper to the letter.
    pub expect_absolute: bool,
    /// The scalar of a covariance that uncertainty is; default `determinant` [PDN12, eq. 5].
    pub criterion: Criterion,
}

impl Default for Planner {
    fn default() -> Self {
        Planner {
            waypoint_local_saliency: 0.5,
            eps_m: 1.5,
            min_points: 4,
            max_cluster_radius_m: None,
            edge_radius_m: None,
            sample_spacing_m: None,
            min_revisit_m: 3.0,
            min_baseline_m: 0.3,
            max_baseline_m: 0.9,
            max_view_angle_deg: 30.0,
            max_links: 4,
            swath_m: 1.6,
            expect_absolute: true,
            criterion: Criterion::Determinant,
        }
    }
}

/// The scalar of a covariance that uncertainty is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Criterion {
    /// The sixth root of the determinant's ratio to the allowable one [PDN12, eq. 5].
    Determinant,
}

/// What is known beforehand of the probability that a registration succeeds [PDN12, eq. 2].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LinkModel {
    /// Bins of each of the two saliencies, of equal width on [0, 1]; default 5.
    pub bins: u32,
    /// Beta prior `[a, b]` of each bin, row-major, symmetric, `bins * bins` pairs; default: 200 earlier
    /// proposals a bin, of which 85 % were registered where both saliencies are at least 0.5 (by the bin's
    /// centre), 5 % where one is, 0.5 % where none is.
    pub prior: Vec<[f64; 2]>,
}

impl Default for LinkModel {
    fn default() -> Self {
        let bins = 5;
        let salient = |bin: u32| (f64::from(bin) + 0.5) / f64::from(bins) >= 0.5;
        let pairs = (0..bins).flat_map(|row| (0..bins).map(move |column| (row, column)));
        let rate = |(row, column)| match (salient(row), salient(column)) {
            (true, true) => 0.85,
            (false, false) => 0.005,
            _ => 0.05,
        };
        LinkModel {
            bins,
            prior: pairs.map(|pair| [200.0 * rate(pair), 200.0 * (1.0 - rate(pair))]).collect(),
        }
    }
}

/// Robust loss of each kind of factor.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Robust {
    /// Default none.
    pub prior: Loss,
    /// Default none.
    pub odometry: Loss,
    /// Default none.
    pub relative: Loss,
    /// Default Cauchy with 2.385.
    pub camera: Loss,
    /// Default none.
    pub attitude: Loss,
    /// Default none.
    pub depth: Loss,
    /// Default none.
    pub position: Loss,
}

impl Default for Robust {
    fn default() -> Self {
        Robust {
            prior: Loss::None,
            odometry: Loss::None,
            relative: Loss::None,
            camera: Loss::Cauchy(2.385),
            attitude: Loss::None,
            depth: Loss::None,
            position: Loss::None,
        }
    }
}

/// How the information of a factor shrinks with its whitened residual norm r.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Loss {
    /// w = 1.
    None,
    /// w = min(1, c/r) with this c > 0.
    Huber(f64),
    /// w = 1 / (1 + r^2/c^2) with this c > 0.
    Cauchy(f64),
}

/// Prior on the first keyframe.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct FirstKeyframeSigmas {
    /// Standard deviations in body axes, m; default 0.02 each.
    pub translation_m: [f64; 3],
    /// Standard deviations in body axes, deg; default 0.1 each.
    pub rotation_deg: [f64; 3],
}

impl FirstKeyframeSigmas {
    fn some_default() -> Option<Self> {
        Some(Self::default())
    }
}

impl Default for FirstKeyframeSigmas {
    fn default() -> Self {
        FirstKeyframeSigmas { translation_m: [0.02; 3], rotation_deg: [0.1; 3] }
    }
}

fn one() -> f64 {
    1.0
}

fn gate_sigmas() -> Option<f64> {
    Some(20.0)
}

fn cell_m() -> f64 {
    0.1
}
