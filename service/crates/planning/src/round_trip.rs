//! The trajectory that a robot would follow to a waypoint and back: virtual nodes along a polyline that is
//! bisected repeatedly [PDN12, III.C].

use crate::distance::nanometres;
use crate::error::PlanningError;
use crate::revisit::Route;
use crate::snapshot::Snapshot;
use nalgebra::Vector3;
use pdn_kernel::se3::Pose;
use pdn_kernel::so3;

/// Virtual nodes of a round trip at most.
pub const MAX_NODES: usize = 20_000;

/// Places closer than this are one place, m. An odometry step of no length would have a covariance of zero,
/// and no vehicle knows its place to a millimetre.
pub const SAME_PLACE_M: f64 = 1e-3;

/// The virtual nodes of a way out and back.
#[derive(Clone, Debug, PartialEq)]
pub struct RoundTrip {
    /// Length of the way out, m.
    pub one_way_m: f64,
    /// `world_from_body` of the virtual nodes 1..n: outbound, then the same places inbound; the last one is
    /// the robot's pose. n is even and at least 2, and nodes i and n - i are the same place.
    pub poses: Vec<Pose>,
}

/// The round trip along a route. `path` is what an error calls it.
///
/// Each piece between two successive keyframes is halved until its parts are no longer than
/// `sample_spacing_m` (the median distance of consecutive keyframes), and the orientation turns evenly from
/// one keyframe's to the other's. A keyframe within [`SAME_PLACE_M`] of the one before it is left out.
///
/// # Errors
/// [`PlanningError::PathEmpty`] if the route does not leave the robot's place, [`PlanningError::PathTooLong`]
/// if it needs more than [`MAX_NODES`] virtual nodes, [`PlanningError::NoKeyframe`].
pub fn along_route(snapshot: &Snapshot, route: &Route, path: usize) -> Result<RoundTrip, PlanningError> {
    let stops = route.keyframes.iter().map(|&node| snapshot.keyframe(node).world_from_body).collect();
    there_and_back(snapshot, stops, route.one_way_m, path)
}

/// The round trip along world points that a person drew, from the robot's place on; a first point within
/// [`SAME_PLACE_M`] of it is the robot's place. At each point the vehicle is oriented as at the keyframe
/// nearest to it, at the start as the robot is. Sampling and errors as in [`along_route`].
///
/// # Errors
/// Also [`PlanningError::PathNotFinite`].
pub fn along_points(
    snapshot: &Snapshot,
    points_in_world: &[Vector3<f64>],
    path: usize,
) -> Result<RoundTrip, PlanningError> {
    if points_in_world.iter().any(|point| point.iter().any(|value| !value.is_finite())) {
        return Err(PlanningError::PathNotFinite { path });
    }
    let mut stops = vec![snapshot.keyframe(snapshot.robot()?).world_from_body];
    for point in points_in_world {
        let rotation = snapshot.keyframe(snapshot.nearest(point)?).world_from_body.rotation;
        stops.push(Pose::from_parts((*point).into(), rotation));
    }
    let one_way_m = stops.windows(2).map(|pair| distance_m(&pair[0], &pair[1])).sum();
    there_and_back(snapshot, stops, one_way_m, path)
}

fn there_and_back(
    snapshot: &Snapshot,
    mut stops: Vec<Pose>,
    one_way_m: f64,
    path: usize,
) -> Result<RoundTrip, PlanningError> {
    stops.dedup_by(|later, earlier| distance_m(earlier, later) < SAME_PLACE_M);
    let longest_m = snapshot.settings.sample_spacing_m.or(snapshot.spacing_m()).unwrap_or(f64::INFINITY);
    let mut places = Vec::new();
    for piece in stops.windows(2) {
        places.push(piece[0]);
        let parts = parts_by_bisection(distance_m(&piece[0], &piece[1]), longest_m);
        if places.len().saturating_add(parts) > MAX_NODES / 2 {
            return Err(PlanningError::PathTooLong { path, one_way_m, limit: MAX_NODES });
        }
        places.extend((1..parts).map(|part| between(&piece[0], &piece[1], part as f64 / parts as f64)));
    }
    if places.is_empty() {
        return Err(PlanningError::PathEmpty { path });
    }
    places.extend(stops.last());
    let outbound = places.iter().skip(1);
    let inbound = places.iter().rev().skip(1);
    Ok(RoundTrip { one_way_m, poses: outbound.chain(inbound).copied().collect() })
}

/// The least power of two that divides a length into parts no longer than `longest_m`.
fn parts_by_bisection(length_m: f64, longest_m: f64) -> usize {
    let mut parts = 1;
    while nanometres(length_m / parts as f64) > nanometres(longest_m) && parts <= MAX_NODES {
        parts *= 2;
    }
    parts
}

/// The pose at a share of the way from one pose to another: straight, turning evenly.
fn between(from: &Pose, to: &Pose, share: f64) -> Pose {
    let place = from.translation.vector.lerp(&to.translation.vector, share);
    let turn = so3::log(&(from.rotation.inverse() * to.rotation));
    Pose::from_parts(place.into(), from.rotation * so3::exp(&(turn * share)))
}

fn distance_m(from: &Pose, to: &Pose) -> f64 {
    (to.translation.vector - from.translation.vector).norm()
}
