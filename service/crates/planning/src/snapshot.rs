//! A mission as it stands, immutable, so that any number of questions can be asked of it at once.

use crate::distance::{median, nanometres};
use crate::error::PlanningError;
use crate::registration::LinkModel;
use crate::saliency::Saliency;
use crate::settings::Settings;
use crate::waypoint::Waypoint;
use nalgebra::{Matrix6, Vector3};
use pdn_kernel::Node;
use pdn_kernel::elimination::Elimination;
use pdn_kernel::se3::Pose;
use rstar::RTree;
use rstar::primitives::GeomWithData;
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
    bodies: OnceLock<RTree<Place>>,
    cameras: OnceLock<RTree<Place>>,
    spacing_m: OnceLock<Option<f64>>,
    pub(crate) robot_covariance: OnceLock<Matrix6<f64>>,
    pub(crate) waypoints: OnceLock<Vec<Waypoint>>,
}

type Place = GeomWithData<[f64; 3], u32>;

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
    /// of nodes, each with its distance in metres. Cost: logarithmic in the keyframes, linear in the answer.
    pub fn bodies_within(&self, point_in_world: &Vector3<f64>, radius_m: f64) -> Vec<(Node, f64)> {
        let bodies = self.derived.bodies.get_or_init(|| tree(self.keyframes.iter().map(body_in_world)));
        within(bodies, point_in_world, radius_m)
    }

    /// Keyframes whose camera's centre is within `radius_m` of a point in the world, as for the bodies.
    pub fn cameras_within(&self, point_in_world: &Vector3<f64>, radius_m: f64) -> Vec<(Node, f64)> {
        let centre = |keyframe: &SnapshotKeyframe| keyframe.world_from_camera().translation.vector;
        let cameras = self.derived.cameras.get_or_init(|| tree(self.keyframes.iter().map(centre)));
        within(cameras, point_in_world, radius_m)
    }

    /// The keyframe whose body is nearest to a point in the world; ties, to the nanometre, to the lower id.
    ///
    /// # Errors
    /// [`PlanningError::NoKeyframe`].
    pub fn nearest(&self, point_in_world: &Vector3<f64>) -> Result<Node, PlanningError> {
        let bodies = self.derived.bodies.get_or_init(|| tree(self.keyframes.iter().map(body_in_world)));
        let first = bodies.nearest_neighbor((*point_in_world).into()).ok_or(PlanningError::NoKeyframe)?;
        let least_m = distance_m(first, point_in_world);
        let near = within(bodies, point_in_world, least_m).into_iter().map(|(node, _)| node);
        Ok(near.min_by_key(|&node| self.keyframe(node).id).unwrap_or(Node(first.data)))
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

fn tree(points: impl Iterator<Item = Vector3<f64>>) -> RTree<Place> {
    RTree::bulk_load(points.zip(0_u32..).map(|(point, node)| Place::new(point.into(), node)).collect())
}

fn within(tree: &RTree<Place>, point_in_world: &Vector3<f64>, radius_m: f64) -> Vec<(Node, f64)> {
    let reach_m = radius_m + 1e-8;
    let mut near: Vec<(Node, f64)> = tree
        .locate_within_distance((*point_in_world).into(), reach_m * reach_m)
        .map(|place| (Node(place.data), distance_m(place, point_in_world)))
        .filter(|&(_, distance_m)| nanometres(distance_m) <= nanometres(radius_m))
        .collect();
    near.sort_by_key(|&(node, _)| node);
    near
}

fn distance_m(place: &Place, point_in_world: &Vector3<f64>) -> f64 {
    (Vector3::from(*place.geom()) - point_in_world).norm()
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
