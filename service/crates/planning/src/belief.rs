//! What the robot would know of its pose after a round trip, or after one more step [PDN12, eqs. 1, 3, 4].

use crate::error::PlanningError;
use crate::registration::{Link, links};
use crate::round_trip::RoundTrip;
use crate::snapshot::{Snapshot, SnapshotKeyframe};
use nalgebra::{Matrix5, Matrix6, Vector5};
use pdn_kernel::elimination::{Candidates, VirtualLink, VirtualPath, VirtualPlace, VirtualSteps, Workspace};
use pdn_kernel::information::PairInformation;
use pdn_kernel::se3::{Pose, adjoint};
use pdn_kernel::{Node, information};
use rayon::prelude::*;
use std::cmp::Ordering;
use std::sync::Arc;
use std::sync::Mutex;

/// The robot's expected knowledge at the end of a round trip and on the way.
#[derive(Clone, Debug, PartialEq)]
pub struct Belief {
    /// Sigma_nn: the 6x6 block at node n of the inverse of Lambda_pdn [PDN12, eq. 4], each link weighted by P_L.
    pub terminal: Matrix6<f64>,
    /// Sigma_nn with every link registered (P = 1).
    pub terminal_all_links: Matrix6<f64>,
    /// Sigma_nn with none registered (P = 0).
    pub terminal_no_links: Matrix6<f64>,
    /// Covariance of each virtual node 1..n, of the same inverse as `terminal`.
    pub along: Vec<Matrix6<f64>>,
    /// Virtual node, keyframe and P_L of each expected registration, by node.
    pub links: Vec<(u32, Node, f64)>,
}

/// Sigma_exp: the robot's marginal carried one step by the last odometry measurement Z with its covariance Q,
/// Ad(Z^-1) Sigma_rr Ad(Z^-1)^T + Q. Before the first odometry it is the robot's marginal itself.
///
/// # Errors
/// [`PlanningError::NoKeyframe`], or the kernel's finding about the graph.
pub fn expect_exploration(snapshot: &Snapshot) -> Result<Matrix6<f64>, PlanningError> {
    let robot = snapshot.robot_covariance()?;
    Ok(match &snapshot.last_odometry {
        Some(step) => {
            let carry = adjoint(&step.earlier_from_later.inverse());
            let carried = carry * robot * carry.transpose() + step.covariance;
            0.5 * (carried + carried.transpose())
        }
        None => robot,
    })
}

/// Round trips that a thread takes at once: those with common beginnings cost less one after the other.
const GROUP: usize = 8;

/// The beliefs of several round trips, in their order, spread over the pool's threads; none for those that were
/// still waiting when `stop` said so. `stop` is asked before each. The numbers do not depend on the threads.
///
/// # Errors
/// The kernel's finding about a trip that has no answer.
pub fn expect_all(
    snapshot: &Snapshot,
    trips: &[RoundTrip],
    pool: &rayon::ThreadPool,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Vec<Option<Belief>>, PlanningError> {
    let all: Vec<&RoundTrip> = trips.iter().collect();
    evaluate_all(snapshot, &all, pool, stop, |candidates, path, robot_covariance| {
        let expected = candidates.covariances(path, robot_covariance)?;
        Ok(Belief {
            terminal: expected.terminal,
            terminal_all_links: expected.terminal_all_links,
            terminal_no_links: expected.terminal_no_links,
            along: expected.along,
            links: links_by_node(path),
        })
    })
}

/// Sigma_nn of several round trips and nothing else, else as [`expect_all`] and with the same bits. Cost: a quarter.
///
/// # Errors
/// As [`expect_all`].
pub fn terminals(
    snapshot: &Snapshot,
    trips: &[&RoundTrip],
    pool: &rayon::ThreadPool,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Vec<Option<Matrix6<f64>>>, PlanningError> {
    evaluate_all(snapshot, trips, pool, stop, |candidates, path, _| Ok(candidates.terminal(path)?))
}

/// What is evaluated of each trip, spread over the pool's threads.
fn evaluate_all<T: Clone + Send>(
    snapshot: &Snapshot,
    trips: &[&RoundTrip],
    pool: &rayon::ThreadPool,
    stop: &(dyn Fn() -> bool + Sync),
    evaluate: impl for<'a> Fn(&mut Candidates<'a>, &'a VirtualPath, &Matrix6<f64>) -> Result<T, PlanningError>
    + Sync,
) -> Result<Vec<Option<T>>, PlanningError> {
    let workspaces: Vec<Mutex<Workspace>> =
        (0..pool.current_num_threads()).map(|_| Mutex::new(Workspace::default())).collect();
    let mut order: Vec<usize> = (0..trips.len()).collect();
    order.sort_by(|&one, &other| by_places(trips[one], trips[other]).then(one.cmp(&other)));
    let expect_group = |group: &[usize]| {
        let thread = rayon::current_thread_index().unwrap_or(0);
        let mut workspace = workspaces[thread].lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let trips: Vec<&RoundTrip> = group.iter().map(|&index| trips[index]).collect();
        evaluate_group(snapshot, &trips, &mut workspace, stop, &evaluate)
    };
    let groups: Vec<Result<Vec<Option<T>>, PlanningError>> =
        pool.install(|| order.par_chunks(GROUP).map(expect_group).collect());
    let mut all = vec![None; trips.len()];
    for (group, found) in order.chunks(GROUP).zip(groups) {
        for (&index, evaluated) in group.iter().zip(found?) {
            all[index] = evaluated;
        }
    }
    Ok(all)
}

/// An order in which trips with common beginnings are neighbours.
fn by_places(one: &RoundTrip, other: &RoundTrip) -> Ordering {
    let coordinates = |trip: &RoundTrip| {
        trip.poses.iter().flat_map(|pose| <[f64; 3]>::from(pose.translation.vector)).collect::<Vec<f64>>()
    };
    let (one, other) = (coordinates(one), coordinates(other));
    let differing = one.iter().zip(&other).map(|(one, other)| one.total_cmp(other));
    differing.into_iter().find(|order| order.is_ne()).unwrap_or(one.len().cmp(&other.len()))
}

/// What is evaluated of round trips, one after the other; none once `stop` says so, which is asked before each.
fn evaluate_group<T: Clone>(
    snapshot: &Snapshot,
    trips: &[&RoundTrip],
    workspace: &mut Workspace,
    stop: &(dyn Fn() -> bool + Sync),
    evaluate: &(
         impl for<'a> Fn(&mut Candidates<'a>, &'a VirtualPath, &Matrix6<f64>) -> Result<T, PlanningError> + Sync
     ),
) -> Result<Vec<Option<T>>, PlanningError> {
    if stop() {
        return Ok(vec![None; trips.len()]);
    }
    let robot_covariance = snapshot.robot_covariance()?;
    let paths = virtual_paths(snapshot, trips)?;
    let mut candidates = Candidates::new(&snapshot.elimination, workspace);
    let evaluated = paths.iter().enumerate().map(|(index, path)| {
        // For the first it has been asked.
        if index > 0 && stop() {
            return Ok(None);
        }
        evaluate(&mut candidates, path, &robot_covariance).map(Some)
    });
    evaluated.collect()
}

/// Virtual node, keyframe and P_L of each expected registration, by node: what is expected at a place, at each of its nodes.
fn links_by_node(path: &VirtualPath) -> Vec<(u32, Node, f64)> {
    let at_nodes = |(place, link): (u32, &VirtualLink)| {
        let (keyframe, probability) = (link.keyframe, link.probability);
        path.nodes_at(place).into_iter().flatten().map(move |node| (node, keyframe, probability))
    };
    let mut links: Vec<(u32, Node, f64)> = path.links().flat_map(at_nodes).collect();
    links.sort_by_key(|&(node, ..)| node); // stable: of a node, the most probable first
    links
}

/// Lambda_odo, Lambda_cam and the absolute sensors' information of round trips [PDN12, eqs. 1, 3], with virtual
/// node 0 at the robot. What is expected at a place is found once for all trips that begin by it.
///
/// # Errors
/// [`PlanningError::NoKeyframe`]; the kernel's finding about a baseline.
pub fn virtual_paths(snapshot: &Snapshot, trips: &[&RoundTrip]) -> Result<Vec<VirtualPath>, PlanningError> {
    let robot = snapshot.robot()?;
    let at_robot = snapshot.keyframe(robot).world_from_body;
    let mut paths = Vec::with_capacity(trips.len());
    let mut before: &[Pose] = &[];
    let mut places = vec![expected_place(snapshot, None, &at_robot)?];
    for trip in trips {
        let outbound = &trip.poses[..trip.poses.len() / 2];
        let shared = before.iter().zip(outbound).take_while(|(one, other)| one == other).count();
        places.truncate(1 + shared);
        for (index, pose) in outbound.iter().enumerate().skip(shared) {
            let from = if index == 0 { &at_robot } else { &outbound[index - 1] };
            places.push(expected_place(snapshot, Some(from), pose)?);
        }
        paths.push(VirtualPath { robot, places: places.clone() });
        before = outbound;
    }
    Ok(paths)
}

/// What is expected at a place, and of the way there from the place before.
fn expected_place(
    snapshot: &Snapshot,
    from: Option<&Pose>,
    pose: &Pose,
) -> Result<Arc<VirtualPlace>, PlanningError> {
    let steps = |from| VirtualSteps {
        out: expected_odometry(snapshot, from, pose),
        back: expected_odometry(snapshot, pose, from),
    };
    Ok(Arc::new(VirtualPlace {
        unary: absolute_information(snapshot, pose),
        steps: from.map(steps),
        links: expected_registrations(snapshot, pose)?,
    }))
}

/// H^T Q^-1 H with Q = diag(sigma^2) d, d the distance between the nodes [PDN12, eq. 1].
fn expected_odometry(snapshot: &Snapshot, from: &Pose, to: &Pose) -> PairInformation {
    let distance_m = (to.translation.vector - from.translation.vector).norm();
    let sigmas = snapshot.settings.odometry_sigmas_per_sqrt_m * distance_m.sqrt();
    information::odometry(from, to, &Matrix6::from_diagonal(&sigmas.map(|sigma| 1.0 / sigma)))
}

/// Attitude: rows R on phi, in world axes; depth: third row of R on rho. Zero with `expect_absolute` off.
fn absolute_information(snapshot: &Snapshot, pose: &Pose) -> Matrix6<f64> {
    let settings = &snapshot.settings;
    let mut sum = Matrix6::zeros();
    if !settings.expect_absolute {
        return sum;
    }
    if let Some(tilt_sigma_rad) = settings.tilt_sigma_rad {
        sum += information::attitude(pose, tilt_sigma_rad, settings.heading_sigma_rad);
    }
    if let Some(sigma_m) = settings.depth_sigma_m {
        sum += information::depth(pose, sigma_m);
    }
    sum
}

/// H^T R^-1 H of each registration that a virtual node may expect [PDN12, eq. 3].
fn expected_registrations(snapshot: &Snapshot, pose: &Pose) -> Result<Vec<VirtualLink>, PlanningError> {
    let settings = &snapshot.settings;
    let [direction, rotation] = [settings.direction_sigma_rad, settings.rotation_sigma_rad].map(f64::recip);
    let weight = Matrix5::from_diagonal(&Vector5::new(direction, direction, rotation, rotation, rotation));
    let nearest = snapshot.nearest(&pose.translation.vector)?;
    let body_from_camera = &snapshot.keyframe(nearest).body_from_camera;
    let with_information = |Link { keyframe, probability }: Link| {
        let SnapshotKeyframe { world_from_body, body_from_camera: target_from_camera, .. } =
            snapshot.keyframe(keyframe);
        let information =
            information::camera(world_from_body, target_from_camera, pose, body_from_camera, &weight)?;
        Ok(VirtualLink { keyframe, information, probability })
    };
    links(snapshot, pose, nearest).into_iter().map(with_information).collect()
}
