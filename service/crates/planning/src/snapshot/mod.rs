//! A mission as it stands, immutable, so that any number of questions can be asked of it at once.

mod derived;

use crate::error::PlanningError;
use crate::link_model::LinkModel;
use crate::memo::get_or_try_init;
use crate::saliency::Saliency;
use crate::settings::Settings;
use nalgebra::{Matrix6, Vector3};
use pdn_kernel::Node;
use pdn_kernel::elimination::Elimination;
use pdn_kernel::se3::Pose;

pub use derived::{Derived, DerivedCache};

/// A mission as it stands. Every pose is a linearisation point, so that an outsider can recompute a decision.
///
/// Make it field by field with `derived: Derived::default()` or the mission's cache
/// ([`Derived::with_cache`]), share it behind an `Arc`, and change nothing afterwards: what has been derived
/// from the fields is cached.
pub struct Snapshot {
    /// Keyframes of the pose graph; the index is the kernel's [`Node`].
    pub keyframes: Vec<SnapshotKeyframe>,
    /// The newest keyframe, which is where the robot is; none before the first. It need not be the last in
    /// the list: an older one can be tied to the graph later.
    pub newest: Option<Node>,
    /// Pairs of keyframes between which the vehicle itself went (odometry), in the order of addition.
    pub went: Vec<(Node, Node)>,
    /// Lambda_0, eliminated, over all keyframes.
    pub elimination: Elimination,
    /// The last odometry measurement; none before the first.
    pub last_odometry: Option<OdometryStep>,
    /// A_covered, m^2.
    pub covered_m2: f64,
    /// A_target, m^2, above zero.
    pub target_m2: f64,
    /// The table of P_L with its counts.
    pub link_model: LinkModel,
    /// The mission's settings.
    pub settings: Settings,
    /// What questions share.
    pub derived: Derived,
}

/// A keyframe of a snapshot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SnapshotKeyframe {
    /// Its id in the mission; every tie goes to the lower one.
    pub id: u64,
    /// Its linearisation point.
    pub world_from_body: Pose,
    /// Pose of the camera in the body frame when the image was taken.
    pub body_from_camera: Pose,
    /// What its image is worth.
    pub saliency: Saliency,
}

impl SnapshotKeyframe {
    /// Pose of the camera in the world.
    pub fn world_from_camera(&self) -> Pose {
        self.world_from_body * self.body_from_camera
    }
}

/// A measured step of the vehicle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OdometryStep {
    /// Z: pose of the later keyframe in the body frame of the earlier one.
    pub earlier_from_later: Pose,
    /// Its covariance, `[m; rad]` in the body frame of the later keyframe.
    pub covariance: Matrix6<f64>,
}

/// Edge radius in medians of the distance of consecutive keyframes, where the mission names none.
const EDGE_RADIUS_IN_SPACINGS: f64 = 2.6;

/// Radius of a waypoint's members in medians of the distance of consecutive keyframes, where the mission
/// names none: 12 m on the paper's hull, whose largest salient ellipse is 10 m long.
const CLUSTER_RADIUS_IN_SPACINGS: f64 = 24.0;

impl Snapshot {
    /// The newest keyframe: the robot, virtual node 0 [PDN12, III.D].
    ///
    /// # Errors
    /// [`PlanningError::NoKeyframe`].
    pub fn robot(&self) -> Result<Node, PlanningError> {
        self.newest.ok_or(PlanningError::NoKeyframe)
    }

    /// Sigma_rr, the robot's marginal covariance at the linearisation points.
    ///
    /// # Errors
    /// [`PlanningError::NoKeyframe`], or the kernel's finding about the graph.
    pub fn robot_covariance(&self) -> Result<Matrix6<f64>, PlanningError> {
        get_or_try_init(&self.derived.robot_covariance, || Ok(self.elimination.marginal(self.robot()?)?))
            .copied()
    }

    /// The keyframe of a node of this snapshot.
    pub fn keyframe(&self, node: Node) -> &SnapshotKeyframe {
        &self.keyframes[node.index()]
    }

    /// Where a node's body is in the world, m.
    pub(crate) fn body(&self, node: Node) -> Vector3<f64> {
        self.keyframe(node).world_from_body.translation.vector
    }

    /// The salient set [PDN12, III.B], ascending.
    pub(crate) fn salient(&self) -> impl Iterator<Item = Node> {
        let limit = self.settings.waypoint_local_saliency;
        let salient =
            self.keyframes.iter().zip(0..).filter(move |(known, _)| known.saliency.is_salient(limit));
        salient.map(|(_, node)| Node(node))
    }

    /// The keyframe whose body is nearest to a point in the world; ties, to the nanometre, to the lower id.
    ///
    /// # Errors
    /// [`PlanningError::NoKeyframe`].
    pub fn nearest(&self, point_in_world: &Vector3<f64>) -> Result<Node, PlanningError> {
        let id = |node: Node| self.keyframe(node).id;
        self.bodies().nearest(point_in_world, id).ok_or(PlanningError::NoKeyframe)
    }

    /// Greatest distance of two keyframes that a route connects, m: the mission's, or 2.6 times the median
    /// distance of consecutive keyframes.
    pub fn edge_radius_m(&self) -> f64 {
        let by_spacing = || EDGE_RADIUS_IN_SPACINGS * self.spacing_m().unwrap_or(0.0);
        self.settings.edge_radius_m.unwrap_or_else(by_spacing)
    }

    /// Greatest distance of a waypoint's members from its representative, m: the mission's, or 24 times the
    /// median distance of consecutive keyframes.
    pub fn max_cluster_radius_m(&self) -> f64 {
        let by_spacing = || CLUSTER_RADIUS_IN_SPACINGS * self.spacing_m().unwrap_or(0.0);
        self.settings.max_cluster_radius_m.unwrap_or_else(by_spacing)
    }
}
