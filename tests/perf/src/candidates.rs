//! A mission's snapshot of a survey, and the round trips that a decision would weigh.

use nalgebra::{Matrix6, Vector6};
use pdn_planning::Route;
use pdn_planning::belief::virtual_paths;
use pdn_planning::round_trip::{RoundTrip, along_route};
use pdn_planning::route::routes;
use pdn_planning::waypoint::goals;
use pdn_planning::{
    Allowable, Derived, LinkModel, OdometryStep, PlanningError, Saliency, Settings, Snapshot,
    SnapshotKeyframe,
};

use crate::kernel::{Elimination, Node, Pose, VirtualPath};
use crate::survey::{self, Keyframe, Measured};

/// Where the candidates' goals come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Goals {
    /// The waypoints of the method, if there are enough: spread evenly over them.
    Waypoints,
    /// Too few clusters: keyframes spread evenly over the salient ones.
    SalientKeyframes,
}

impl Goals {
    pub fn name(self) -> &'static str {
        match self {
            Goals::Waypoints => "waypoints",
            Goals::SalientKeyframes => "salient keyframes",
        }
    }
}

/// A snapshot at the end of a survey, its poses being these.
pub fn snapshot(
    keyframes: &[Keyframe],
    poses: &[Pose],
    elimination: Elimination,
) -> Result<Snapshot, PlanningError> {
    let mut of_snapshot = Vec::with_capacity(keyframes.len());
    for (id, (keyframe, pose)) in (0..).zip(keyframes.iter().zip(poses)) {
        of_snapshot.push(SnapshotKeyframe {
            id,
            world_from_body: *pose,
            body_from_camera: survey::body_from_camera(),
            saliency: Saliency::ready(keyframe.local_saliency, keyframe.global_saliency)?,
        });
    }
    let last_odometry = keyframes.last().and_then(|last| match &last.arrival {
        Measured::Odometry { earlier_from_later, sigmas } => Some(OdometryStep {
            earlier_from_later: *earlier_from_later,
            covariance: Matrix6::from_diagonal(&sigmas.component_mul(sigmas)),
        }),
        _ => None,
    });
    let covered_m2 = keyframes.len() as f64 * survey::SPACING_M * survey::TRACK_SPACING_M;
    Ok(Snapshot {
        newest: (keyframes.len() as u32).checked_sub(1).map(Node),
        keyframes: of_snapshot,
        went: (1..keyframes.len() as u32).map(|node| (Node(node - 1), Node(node))).collect(),
        elimination,
        last_odometry,
        covered_m2,
        target_m2: 2.0 * covered_m2,
        link_model: link_model()?,
        settings: settings(),
        derived: Derived::default(),
    })
}

/// At most `count` round trips from the robot, ordered as planning does: those with common beginnings are
/// neighbours.
pub fn round_trips(snapshot: &Snapshot, count: usize) -> Result<(Goals, Vec<RoundTrip>), PlanningError> {
    let waypoints = goals(snapshot)?;
    let (goals, chosen): (Goals, Vec<Route>) = if waypoints.len() >= count {
        (Goals::Waypoints, spread(&waypoints, count).map(|(_, route)| (*route).clone()).collect())
    } else {
        let distant = distant_salient(snapshot)?;
        let wanted: Vec<Node> = spread(&distant, count.min(distant.len())).copied().collect();
        (Goals::SalientKeyframes, routes(snapshot, &wanted)?.into_iter().flatten().collect())
    };
    let trips = chosen.iter().enumerate().map(|(index, route)| along_route(snapshot, route, index));
    let mut trips = trips.collect::<Result<Vec<RoundTrip>, _>>()?;
    let places = |trip: &RoundTrip| -> Vec<[f64; 3]> {
        trip.poses.iter().map(|pose| pose.translation.vector.into()).collect()
    };
    trips.sort_by(|one, other| places(one).partial_cmp(&places(other)).expect("places are numbers"));
    Ok((goals, trips))
}

/// What each round trip adds to the information.
pub fn paths(snapshot: &Snapshot, trips: &[RoundTrip]) -> Result<Vec<VirtualPath>, PlanningError> {
    virtual_paths(snapshot, &trips.iter().collect::<Vec<_>>())
}

fn spread<T>(items: &[T], count: usize) -> impl Iterator<Item = &T> {
    (0..count).map(move |index| &items[(2 * index + 1) * items.len() / (2 * count)])
}

/// Salient keyframes farther from the robot than the shortest revisit.
fn distant_salient(snapshot: &Snapshot) -> Result<Vec<Node>, PlanningError> {
    let place = |node: Node| snapshot.keyframe(node).world_from_body.translation.vector;
    let robot = place(snapshot.robot()?);
    let settings = &snapshot.settings;
    let nodes = (0..snapshot.keyframes.len() as u32).map(Node);
    let salient =
        nodes.filter(|&node| snapshot.keyframe(node).saliency.is_salient(settings.waypoint_local_saliency));
    Ok(salient.filter(|&node| (place(node) - robot).norm() > settings.min_revisit_m).collect())
}

/// The paper's hull.
fn settings() -> Settings {
    let tenth = 0.1_f64.to_radians();
    let [moved, turned] = survey::ODOMETRY_SIGMAS;
    Settings {
        alpha: 0.75,
        allowable: Allowable {
            x_m: 0.25,
            y_m: 0.25,
            depth_m: 0.01,
            roll_rad: tenth,
            pitch_rad: tenth,
            heading_rad: tenth,
        },
        waypoint_local_saliency: 0.5,
        eps_m: 1.5,
        min_points: 4,
        max_cluster_radius_m: None,
        edge_radius_m: None,
        sample_spacing_m: None,
        min_revisit_m: 3.0,
        min_baseline_m: survey::BASELINES_M[0],
        max_baseline_m: survey::BASELINES_M[1],
        max_view_angle_rad: 30.0_f64.to_radians(),
        max_links: survey::MAX_LINKS,
        swath_m: 1.6,
        expect_absolute: true,
        odometry_sigmas_per_sqrt_m: Vector6::new(moved, moved, moved, turned, turned, turned),
        tilt_sigma_rad: Some(survey::ATTITUDE_SIGMA_RAD),
        heading_sigma_rad: Some(survey::ATTITUDE_SIGMA_RAD),
        depth_sigma_m: Some(survey::DEPTH_SIGMA_M),
        direction_sigma_rad: survey::CAMERA_SIGMAS_RAD[0],
        rotation_sigma_rad: survey::CAMERA_SIGMAS_RAD[1],
    }
}

/// The true rates with the weight of 200 earlier proposals a bin.
fn link_model() -> Result<LinkModel, PlanningError> {
    const BINS: usize = 5;
    let bare = |bin: usize| usize::from((bin as f64 + 0.5) / (BINS as f64) < 0.5);
    let prior = (0..BINS * BINS).map(|at| {
        let rate = survey::RATES[bare(at / BINS) + bare(at % BINS)];
        [200.0 * rate, 200.0 * (1.0 - rate)]
    });
    LinkModel::new(BINS, &prior.collect::<Vec<_>>())
}
