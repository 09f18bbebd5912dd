//! What an event says, checked and in the types of the method: what the fold is made of; and what it adds to
//! the graph.

use crate::settings::Losses;
use nalgebra::{Matrix3, Matrix5, Matrix6, UnitQuaternion, Vector3};
use pdn_kernel::se3::Pose;
use pdn_kernel::{Factor, FactorKind, KernelError, Node};
use pdn_planning::Saliency;

/// The content of an event whose every field is valid by itself.
#[derive(Clone, Debug)]
pub enum Change {
    /// A place where the vehicle took an image.
    Keyframe(NewKeyframe),
    /// A measurement of one or two keyframes.
    Measurement(Box<Measurement>),
    /// The outcome of a registration that was tried.
    Link {
        /// One keyframe of the pair.
        from: u64,
        /// The other.
        to: u64,
        /// Whether it succeeded.
        registered: bool,
    },
}

/// A keyframe before it is in the graph.
#[derive(Clone, Debug)]
pub struct NewKeyframe {
    /// Its id.
    pub id: u64,
    /// The sender's estimate.
    pub world_from_body: Option<Pose>,
    /// Its camera, where it differs from the mission's.
    pub body_from_camera: Option<Pose>,
    /// What its image is worth.
    pub saliency: Saliency,
}

/// A measurement that names keyframes by id, with the meanings of the contract's `FactorKind`. Rotations and
/// directions are normalised, covariances have been checked.
#[allow(missing_docs)]
#[derive(Clone, Debug)]
pub enum Measurement {
    Prior {
        keyframe: u64,
        world_from_body: Pose,
        covariance: Matrix6<f64>,
    },
    Odometry {
        from: u64,
        to: u64,
        relative: Pose,
        covariance: Matrix6<f64>,
    },
    Relative {
        from: u64,
        to: u64,
        relative: Pose,
        covariance: Matrix6<f64>,
    },
    Camera {
        from: u64,
        to: u64,
        direction: Vector3<f64>,
        rotation: UnitQuaternion<f64>,
        covariance: Matrix5<f64>,
    },
    Attitude {
        keyframe: u64,
        rotation: UnitQuaternion<f64>,
        tilt_variance_rad2: f64,
        heading_variance_rad2: Option<f64>,
    },
    Depth {
        keyframe: u64,
        depth_m: f64,
        variance_m2: f64,
    },
    Position {
        keyframe: u64,
        position: Vector3<f64>,
        covariance: Matrix3<f64>,
    },
}

/// What enters the graph, in order.
#[derive(Clone, Debug)]
pub enum Addition {
    /// The next node, with its first estimate.
    Keyframe(Pose),
    /// A factor between nodes.
    Factor(Box<Factor>),
}

impl Measurement {
    /// The keyframes it names.
    pub fn keyframes(&self) -> (u64, Option<u64>) {
        match *self {
            Measurement::Prior { keyframe, .. }
            | Measurement::Attitude { keyframe, .. }
            | Measurement::Depth { keyframe, .. }
            | Measurement::Position { keyframe, .. } => (keyframe, None),
            Measurement::Odometry { from, to, .. }
            | Measurement::Relative { from, to, .. }
            | Measurement::Camera { from, to, .. } => (from, Some(to)),
        }
    }

    /// Which kind it is.
    pub fn kind(&self) -> FactorKind {
        match self {
            Measurement::Prior { .. } => FactorKind::Prior,
            Measurement::Odometry { .. } => FactorKind::Odometry,
            Measurement::Relative { .. } => FactorKind::Relative,
            Measurement::Camera { .. } => FactorKind::Camera,
            Measurement::Attitude { .. } => FactorKind::Attitude,
            Measurement::Depth { .. } => FactorKind::Depth,
            Measurement::Position { .. } => FactorKind::Position,
        }
    }

    /// Whether it ties a keyframe to the graph in all six degrees of freedom.
    pub fn ties_fully(&self) -> bool {
        matches!(self.kind(), FactorKind::Prior | FactorKind::Odometry | FactorKind::Relative)
    }

    /// The kernel's factor between nodes. `cameras` are the `body_from_camera` of the two keyframes.
    ///
    /// # Errors
    /// The kernel's finding about the measurement.
    pub fn factor(
        &self,
        first: Node,
        second: Node,
        cameras: [&Pose; 2],
        min_baseline_m: f64,
        losses: &Losses,
    ) -> Result<Factor, KernelError> {
        let factor = match self {
            Measurement::Prior { world_from_body, covariance, .. } => {
                Factor::prior(first, *world_from_body, covariance)?
            }
            Measurement::Odometry { relative, covariance, .. } => {
                Factor::odometry(first, second, *relative, covariance)?
            }
            Measurement::Relative { relative, covariance, .. } => {
                Factor::relative(first, second, *relative, covariance)?
            }
            Measurement::Camera { direction, rotation, covariance, .. } => Factor::camera(
                first,
                second,
                *cameras[0],
                *cameras[1],
                *direction,
                *rotation,
                covariance,
                min_baseline_m,
            )?,
            Measurement::Attitude { rotation, tilt_variance_rad2, heading_variance_rad2, .. } => {
                Factor::attitude(first, *rotation, *tilt_variance_rad2, *heading_variance_rad2)?
            }
            Measurement::Depth { depth_m, variance_m2, .. } => Factor::depth(first, *depth_m, *variance_m2)?,
            Measurement::Position { position, covariance, .. } => {
                Factor::position(first, *position, covariance)?
            }
        };
        Ok(factor.with_loss(losses.of(self.kind())))
    }
}
