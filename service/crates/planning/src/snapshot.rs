//! A mission as it stands, immutable, so that any number of questions can be asked of it at once.

use crate::distance::median;
use crate::error::PlanningError;
use crate::grid::Grid;
use crate::registration::LinkModel;
use crate::saliency::Saliency;
use crate::settings::Settings;
use crate::waypoint::Waypoint;
use nalgebra::{Matrix6, Vector3};
use pdn_kernel::Node;
use pdn_kernel::elimination::Elimination;
use pdn_kernel::se3::Pose;
use std::sync::OnceLock;

/// A mission as it stands. Every pose is a linearisation point, so that an outsider can recompute a decision.
///
/// Make it field by field with `derived: Derived::default()`, share it behind an `Arc`, and change nothing
/// afterwards: what has been derived from the fields is kept.
pub struct Snapshot {
    /// Keyframes of the pose graph; the index is the kernel's [`Node`].
    pub keyframes: Vec<SnapshotKeyframe>,
    /// The newest keyframe, which is where the robot is; none before the first. It need not be the last in the list: an
    /// older one can be tied to the graph later.
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
    /// What questions share; `Derived::default()` in a new snapshot.
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

/// What is derived from a snapshot once and serves all questions asked of it.
#[derive(Default)]
pub struct Derived {
    bodies: OnceLock<Grid>,
    cameras: OnceLock<Grid>,
    spacing_m: OnceLock<Option<f64>>,
    pub(crate) robot_covariance: OnceLock<Matrix6<f64>>,
    pub(crate) waypoints: OnceLock<Vec<Waypoint>>,
}

/// Edge radius in medians of the distance of consecutive keyframes, where the mission names none.
const EDGE_RADIUS_IN_SPACINGS: f64 = 2.6;

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
        keep(&self.derived.robot_covariance, || Ok(self.elimination.marginal(self.robot()?)?)).copied()
    }

    /// The keyframe of a node of this snapshot.
    pub fn keyframe(&self, node: Node) -> &SnapshotKeyframe {
        &self.keyframes[node.index()]
    }

    /// Keyframes whose body is within `radius_m` of a point in the world (compared to the nanometre), in the order
    /// of nodes, each with its distance in metres. Cost: for radii of about an edge's that of the keyframes near it.
    pub fn bodies_within(&self, point_in_world: &Vector3<f64>, radius_m: f64) -> Vec<(Node, f64)> {
        self.bodies().within(point_in_world, radius_m)
    }

    /// Keyframes whose camera's centre is within `radius_m` of a point in the world, as for the bodies, for radii of about
    /// a baseline's.
    pub fn cameras_within(&self, point_in_world: &Vector3<f64>, radius_m: f64) -> Vec<(Node, f64)> {
        let cameras = self.derived.cameras.get_or_init(|| {
            let centre = |keyframe: &SnapshotKeyframe| keyframe.world_from_camera().translation.vector;
            Grid::new(self.keyframes.iter().map(centre), self.settings.max_baseline_m)
        });
        cameras.within(point_in_world, radius_m)
    }

    /// The keyframe whose body is nearest to a point in the world; ties, to the nanometre, to the lower id.
    ///
    /// # Errors
    /// [`PlanningError::NoKeyframe`].
    pub fn nearest(&self, point_in_world: &Vector3<f64>) -> Result<Node, PlanningError> {
        let bodies = self.bodies();
        let least_m = bodies.least_distance_m(point_in_world).ok_or(PlanningError::NoKeyframe)?;
        let near = bodies.within(point_in_world, least_m).into_iter().map(|(node, _)| node);
        near.min_by_key(|&node| self.keyframe(node).id).ok_or(PlanningError::NoKeyframe)
    }

    /// Greatest distance of two keyframes that a route connects, m: the mission's, or 2.6 times the median distance of
    /// consecutive keyframes.
    pub fn edge_radius_m(&self) -> f64 {
        let by_spacing = || EDGE_RADIUS_IN_SPACINGS * self.spacing_m().unwrap_or(0.0);
        self.settings.edge_radius_m.unwrap_or_else(by_spacing)
    }

    fn bodies(&self) -> &Grid {
        let grid = || Grid::new(self.keyframes.iter().map(body_in_world), self.edge_radius_m());
        self.derived.bodies.get_or_init(grid)
    }

    /// Median distance of consecutive keyframes, m: of those between which the vehicle itself went, or, if no
    /// odometry has come at all, of those that follow one another in the order of addition. None with fewer than
    /// two keyframes.
    pub fn spacing_m(&self) -> Option<f64> {
        *self.derived.spacing_m.get_or_init(|| {
            let step_m = |(from, to): (Vector3<f64>, Vector3<f64>)| (to - from).norm();
            let places: Vec<Vector3<f64>> = self.keyframes.iter().map(body_in_world).collect();
            let went = self.went.iter().map(|&(from, to)| (places[from.index()], places[to.index()]));
            let added = places.iter().copied().zip(places.iter().copied().skip(1));
            median(if self.went.is_empty() {
                added.map(step_m).collect()
            } else {
                went.map(step_m).collect()
            })
        })
    }
}

fn body_in_world(keyframe: &SnapshotKeyframe) -> Vector3<f64> {
    keyframe.world_from_body.translation.vector
}

/// Fills a cell once; a failure leaves it empty, so that it is found again by the next question.
pub(crate) fn keep<T>(
    cell: &OnceLock<T>,
    make: impl FnOnce() -> Result<T, PlanningError>,
) -> Result<&T, PlanningError> {
    match cell.get() {
        Some(kept) => Ok(kept),
        None => {
            let made = make()?;
            Ok(cell.get_or_init(|| made))
        }
    }
}
