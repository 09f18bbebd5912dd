//! What the robot would know of its pose after a round trip, or after one more step [PDN12, eqs. 1, 3, 4].

use crate::error::PlanningError;
use crate::expected_places::{ExpectedPlaces, by_places};
use crate::round_trip::RoundTrip;
use crate::snapshot::Snapshot;
use nalgebra::Matrix6;
use pdn_kernel::Node;
use pdn_kernel::elimination::{PathEvaluator, VirtualPath, Workspace};
use pdn_kernel::se3::adjoint;
use rayon::prelude::*;
use std::cell::Cell;

/// The robot's expected knowledge at the end of a round trip and on the way.
#[derive(Clone, Debug, PartialEq)]
pub struct Belief {
    /// Sigma_nn: the 6x6 block at node n of the inverse of Lambda_pdn [PDN12, eq. 4], each link weighted by
    /// P_L.
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

/// Fewest round trips that a thread takes at once, where there are several threads.
const SMALLEST_GROUP: usize = 8;

/// Paths that are made at a time, which bounds what a thread holds of trips that begin nothing alike.
const PATHS_AT_ONCE: usize = 8;

thread_local! {
    /// The memory in which a thread evaluates, kept for its next trips: making it anew takes a seventh of the
    /// time of 50. It is taken out meanwhile, so that a fault leaves nothing half done to later trips.
    static WORKSPACE: Cell<Workspace> = Cell::default();
}

/// Round trips that a thread takes at once: those with common beginnings cost less one after the other, so as
/// many as leave each thread two groups. The numbers do not depend on the groups.
pub fn group_size(trips: usize, threads: usize) -> usize {
    if threads <= 1 { trips.max(1) } else { trips.div_ceil(2 * threads).max(SMALLEST_GROUP) }
}

/// The beliefs of several round trips, in their order, spread over the pool's threads; none for those that
/// were still waiting when `stop` said so. `stop` is asked before each. The numbers do not depend on the
/// threads.
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
    let paths =
        |group: &[usize]| virtual_paths(snapshot, &group.iter().map(|&index| all[index]).collect::<Vec<_>>());
    evaluate_all(snapshot, &all, &paths, pool, stop, |evaluator, path, robot_covariance| {
        let expected = evaluator.covariances(path, robot_covariance)?;
        Ok(Belief {
            terminal: expected.terminal,
            terminal_all_links: expected.terminal_all_links,
            terminal_no_links: expected.terminal_no_links,
            along: expected.along,
            links: links_by_node(path),
        })
    })
}

/// Sigma_nn of several round trips and nothing else, else as [`expect_all`] and with the same bits; `trips`
/// come with their indices in `expected`. Cost: a quarter.
///
/// # Errors
/// As [`expect_all`].
pub fn terminals(
    snapshot: &Snapshot,
    expected: &ExpectedPlaces,
    trips: &[(usize, &RoundTrip)],
    pool: &rayon::ThreadPool,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Vec<Option<Matrix6<f64>>>, PlanningError> {
    let asked: Vec<&RoundTrip> = trips.iter().map(|&(_, trip)| trip).collect();
    let paths = |group: &[usize]| group.iter().map(|&index| expected.path(trips[index].0)).collect();
    evaluate_all(snapshot, &asked, &paths, pool, stop, |evaluator, path, _| Ok(evaluator.terminal(path)?))
}

/// What makes the paths of a group of trips, given their indices.
type Paths<'a> = dyn Fn(&[usize]) -> Result<Vec<VirtualPath>, PlanningError> + Sync + 'a;

/// What is evaluated of each trip, spread over the pool's threads.
fn evaluate_all<T: Clone + Send>(
    snapshot: &Snapshot,
    trips: &[&RoundTrip],
    paths: &Paths,
    pool: &rayon::ThreadPool,
    stop: &(dyn Fn() -> bool + Sync),
    evaluate: impl Fn(&mut PathEvaluator, &VirtualPath, &Matrix6<f64>) -> Result<T, PlanningError> + Sync,
) -> Result<Vec<Option<T>>, PlanningError> {
    let group_size = group_size(trips.len(), pool.current_num_threads());
    let mut order: Vec<usize> = (0..trips.len()).collect();
    order.sort_by(|&one, &other| by_places(trips[one], trips[other]).then(one.cmp(&other)));
    let expect_group = |group: &[usize]| {
        let mut workspace = WORKSPACE.take();
        let found = evaluate_group(snapshot, group, paths, &mut workspace, stop, &evaluate);
        WORKSPACE.set(workspace);
        found
    };
    let groups: Vec<Result<Vec<Option<T>>, PlanningError>> =
        pool.install(|| order.par_chunks(group_size).map(expect_group).collect());
    let mut all = vec![None; trips.len()];
    for (group, found) in order.chunks(group_size).zip(groups) {
        for (&index, evaluated) in group.iter().zip(found?) {
            all[index] = evaluated;
        }
    }
    Ok(all)
}

/// What is evaluated of a group of round trips, one after the other; none once `stop` says so, which is asked
/// before each.
fn evaluate_group<T: Clone>(
    snapshot: &Snapshot,
    group: &[usize],
    paths: &Paths,
    workspace: &mut Workspace,
    stop: &(dyn Fn() -> bool + Sync),
    evaluate: &(impl Fn(&mut PathEvaluator, &VirtualPath, &Matrix6<f64>) -> Result<T, PlanningError> + Sync),
) -> Result<Vec<Option<T>>, PlanningError> {
    let mut evaluator = PathEvaluator::new(&snapshot.elimination, workspace);
    let mut found = Vec::with_capacity(group.len());
    for made in group.chunks(PATHS_AT_ONCE) {
        if stop() {
            break;
        }
        let robot_covariance = snapshot.robot_covariance()?;
        for (index, path) in paths(made)?.iter().enumerate() {
            // For the first it has been asked.
            let is_stopped = index > 0 && stop();
            found.push(if is_stopped {
                None
            } else {
                Some(evaluate(&mut evaluator, path, &robot_covariance)?)
            });
        }
    }
    found.resize(group.len(), None);
    Ok(found)
}

/// Virtual node, keyframe and P_L of each expected registration, by node.
fn links_by_node(path: &VirtualPath) -> Vec<(u32, Node, f64)> {
    let links = path.node_links().map(|(node, link)| (node, link.keyframe, link.probability));
    let mut links: Vec<(u32, Node, f64)> = links.collect();
    links.sort_by_key(|&(node, ..)| node); // stable: of a node, the most probable first
    links
}

/// Lambda_odo, Lambda_cam and the absolute sensors' information of round trips [PDN12, eqs. 1, 3], with
/// virtual node 0 at the robot. What is expected at a place is found once for all trips that begin by it.
///
/// # Errors
/// [`PlanningError::NoKeyframe`]; the kernel's finding about a baseline.
pub fn virtual_paths(snapshot: &Snapshot, trips: &[&RoundTrip]) -> Result<Vec<VirtualPath>, PlanningError> {
    let expected = ExpectedPlaces::new(snapshot, trips)?;
    (0..trips.len()).map(|trip| expected.path(trip)).collect()
}
