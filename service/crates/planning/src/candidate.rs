//! The numbers of a revisit, from the belief at its end [PDN12, eqs. 5 to 8].

use crate::belief::Belief;
use crate::decision::{Candidate, Exploration};
use crate::error::PlanningError;
use crate::revisit::Waypoint;
use crate::reward::Scale;
use crate::round_trip::RoundTrip;
use crate::snapshot::Snapshot;

/// The candidates of round trips that have been evaluated, numbered from 1 in the order of all trips. Each
/// trip comes with its waypoint (none for a path that a person drew) and its belief (none if it was not
/// evaluated).
///
/// # Errors
/// The kernel's, if an expected covariance is not positive definite.
pub fn candidates<'a>(
    snapshot: &Snapshot,
    scale: &Scale,
    exploration: &Exploration,
    trips: impl Iterator<Item = ((Option<&'a Waypoint>, &'a RoundTrip), &'a Option<Belief>)>,
) -> Result<Vec<Candidate>, PlanningError> {
    let numbered = trips.zip(1_u32..);
    numbered
        .filter_map(|(((goal, trip), belief), number)| Some((number, goal, trip, belief.as_ref()?)))
        .map(|(number, goal, trip, belief)| {
            candidate(snapshot, scale, exploration, number, goal, trip, belief)
        })
        .collect()
}

fn candidate(
    snapshot: &Snapshot,
    scale: &Scale,
    exploration: &Exploration,
    number: u32,
    goal: Option<&Waypoint>,
    trip: &RoundTrip,
    belief: &Belief,
) -> Result<Candidate, PlanningError> {
    let id = |node| snapshot.keyframe(node).id;
    let route = goal.and_then(|waypoint| waypoint.route.as_ref());
    let uncertainty = scale.uncertainty_ratio(&belief.terminal)?; // eq. 5
    let detour = scale.detour(trip.one_way_m); // eq. 6
    let penalty = scale.penalty(uncertainty, detour.area); // eq. 7
    let mut peak_uncertainty = uncertainty; // the end is on the way, whatever the rounding of the other sweep
    for covariance in &belief.along {
        peak_uncertainty = peak_uncertainty.max(scale.uncertainty_ratio(covariance)?);
    }
    Ok(Candidate {
        candidate: number,
        keyframe: goal.map(|waypoint| waypoint.keyframe),
        path: route.map(|route| route.keyframes.iter().map(|&node| id(node)).collect()).unwrap_or_default(),
        one_way_m: trip.one_way_m,
        nodes: u32::try_from(trip.poses.len()).expect("a round trip has at most MAX_NODES virtual nodes"),
        covariance: belief.terminal,
        uncertainty,
        uncertainty_all_links: scale.uncertainty_ratio(&belief.terminal_all_links)?,
        uncertainty_no_links: scale.uncertainty_ratio(&belief.terminal_no_links)?,
        peak_uncertainty,
        redundant_m2: detour.redundant_m2,
        area: detour.area,
        penalty,
        reward: -penalty, // eq. 8
        break_even_alpha: scale.break_even_alpha(exploration.uncertainty, uncertainty, detour.redundant_m2),
        expected_links: belief.links.iter().map(|&(_, _, probability)| probability).sum(),
        poses: trip.poses.clone(),
        links: belief.links.iter().map(|&(node, keyframe, p)| (node, id(keyframe), p)).collect(),
    })
}
