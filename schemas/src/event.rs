//! What a vehicle publishes on `in/`: keyframes, factors and the outcomes of link proposals.

use crate::shared::{Covariance6, Pose};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// `in/keyframe`: a place where the vehicle took an image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Keyframe {
    /// Id of the mission, `[a-z0-9_-]{1,64}`.
    pub mission: String,
    /// Number of the event: from 0, contiguous over the mission's events whatever their key.
    pub seq: u64,
    /// Nanoseconds since the Unix epoch on the sender's clock; no decision depends on it.
    pub stamp_ns: u64,
    /// Unique in the mission.
    pub id: u64,
    /// The sender's estimate of `world_from_body`; null to initialise it from the first factor that ties this
    /// keyframe to a known one.
    pub pose: Option<Pose>,
    /// `body_from_camera` at this keyframe, where it differs from the mission's.
    pub camera: Option<Pose>,
    /// What the image shows.
    pub appearance: Appearance,
}

/// What a keyframe's image shows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Appearance {
    /// Ready scores, each in [0, 1].
    Saliency {
        /// Texture richness S_L.
        local: f64,
        /// Rarity S_G.
        global: f64,
    },
    /// A histogram of visual words: pairs of word and count.
    Words(Vec<(u32, u32)>),
    /// Unit descriptors, `dim` values each.
    Descriptors {
        /// Length of one descriptor.
        dim: u32,
        /// The descriptors one after the other.
        values: Vec<f32>,
    },
    /// No usable image: both saliencies are 0.
    None,
}

/// `in/factor`: a measurement that ties one or two keyframes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Factor {
    /// Id of the mission.
    pub mission: String,
    /// Number of the event.
    pub seq: u64,
    /// Nanoseconds since the Unix epoch on the sender's clock.
    pub stamp_ns: u64,
    /// The measurement.
    pub factor: FactorKind,
}

/// The kinds of measurement. Every covariance must be finite, symmetric and positive definite.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum FactorKind {
    /// The pose of one keyframe. Residual `Log(Z^-1 X)`.
    Prior {
        /// The keyframe.
        keyframe: u64,
        /// Measured `world_from_body`.
        pose: Pose,
        /// 6x6, row-major, `[m; rad]`.
        covariance: Covariance6,
    },
    /// The step between two successive keyframes. Residual `Log(Z^-1 X_from^-1 X_to)`.
    Odometry {
        /// The earlier keyframe.
        from: u64,
        /// The later keyframe.
        to: u64,
        /// Measured pose of `to` in the body frame of `from`.
        relative: Pose,
        /// 6x6, row-major, `[m; rad]`.
        covariance: Covariance6,
    },
    /// A six-degree constraint between any two keyframes. Residual as for odometry.
    Relative {
        /// The keyframe in whose frame the other is measured.
        from: u64,
        /// The keyframe that is measured.
        to: u64,
        /// Measured pose of `to` in the body frame of `from`.
        relative: Pose,
        /// 6x6, row-major, `[m; rad]`.
        covariance: Covariance6,
    },
    /// A monocular registration: direction of the baseline and relative rotation, five degrees of freedom.
    Camera {
        /// The keyframe in whose camera frame the other is measured.
        from: u64,
        /// The keyframe whose camera is measured.
        to: u64,
        /// Unit vector from the camera of `from` to that of `to`, in the camera frame of `from`.
        direction: [f64; 3],
        /// Unit quaternion `[x, y, z, w]`: the camera of `to` seen from the camera of `from`.
        rotation: [f64; 4],
        /// 5x5, row-major, rad: two direction components, then rotation.
        covariance: [f64; 25],
    },
    /// Attitude in world axes. Residual `Log(R Z^T)`: tilt about x, tilt about y, heading.
    Attitude {
        /// The keyframe.
        keyframe: u64,
        /// Measured rotation of `world_from_body`, `[x, y, z, w]`. Where the heading is not observed, put in
        /// the one that the vehicle believes: one that is far off distorts the two tilt rows.
        rotation: [f64; 4],
        /// Variance of each tilt, rad^2.
        tilt_variance_rad2: f64,
        /// Variance of the heading, rad^2; null if the heading is not observed (then only the tilts count).
        heading_variance_rad2: Option<f64>,
    },
    /// Depth. Residual `t_z - z`.
    Depth {
        /// The keyframe.
        keyframe: u64,
        /// Metres, positive down.
        depth_m: f64,
        /// Variance, m^2.
        variance_m2: f64,
    },
    /// Position in the world (USBL, or GPS at the surface). Residual `t - z`.
    Position {
        /// The keyframe.
        keyframe: u64,
        /// `[x, y, z]`, m.
        position: [f64; 3],
        /// 3x3, row-major, m^2. Where the depth is not observed its row and column are zero.
        covariance: [f64; 9],
    },
}

/// `in/link`: whether a registration that the vehicle tried has succeeded. The factor of a success comes as
/// well.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LinkOutcome {
    /// Id of the mission.
    pub mission: String,
    /// Number of the event.
    pub seq: u64,
    /// Nanoseconds since the Unix epoch on the sender's clock.
    pub stamp_ns: u64,
    /// One keyframe of the pair.
    pub from: u64,
    /// The other.
    pub to: u64,
    /// Whether the images could be registered.
    pub registered: bool,
}
