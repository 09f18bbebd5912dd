//! Waypoints: places that are worth revisiting [PDN12, III.B].

use crate::cluster;
use crate::distance::nanometres;
use crate::error::PlanningError;
use crate::memo::get_or_try_init;
use crate::revisit::{Route, Waypoint};
use crate::round_trip::SAME_PLACE_M;
use crate::route::routes;
use crate::settings::Settings;
use crate::snapshot::Snapshot;
use nalgebra::{Matrix6, Vector3};
use pdn_kernel::{Node, gaussian};
use std::collections::BTreeMap;

/// All waypoints, in the order of their keyframes' ids. Found once a snapshot.
///
/// # Errors
/// [`PlanningError::NoKeyframe`], or the kernel's finding about the graph.
pub fn waypoints(snapshot: &Snapshot) -> Result<&[Waypoint], PlanningError> {
    let found = get_or_try_init(&snapshot.derived.waypoints, || {
        let clusters = clusters(snapshot);
        let uncertainties = uncertainties(snapshot, clusters.iter().flatten().map(|&(_, node)| node))?;
        let chosen = clusters.iter().flat_map(|cluster| represent(snapshot, &uncertainties, cluster));
        let mut chosen: Vec<Waypoint> = chosen.collect();
        chosen.sort_by_key(|waypoint| waypoint.keyframe);
        let goals: Vec<Node> = chosen.iter().map(|waypoint| waypoint.node).collect();
        for (waypoint, route) in chosen.iter_mut().zip(routes(snapshot, &goals)?) {
            waypoint.candidate = route.as_ref().is_some_and(|route| is_worth_a_detour(snapshot, route));
            waypoint.route = route;
        }
        Ok(chosen)
    })?;
    Ok(found)
}

/// The waypoints that decisions consider, with their routes, in the order of their keyframes' ids.
///
/// # Errors
/// As [`waypoints`].
pub fn goals(snapshot: &Snapshot) -> Result<Vec<(&Waypoint, &Route)>, PlanningError> {
    let considered = waypoints(snapshot)?.iter().filter(|waypoint| waypoint.candidate);
    Ok(considered.filter_map(|waypoint| Some((waypoint, waypoint.route.as_ref()?))).collect())
}

/// Clusters of the salient set, each as sorted ids of keyframes with their nodes.
fn clusters(snapshot: &Snapshot) -> Vec<Vec<(u64, Node)>> {
    let Settings { eps_m, min_points, .. } = snapshot.settings;
    let lists = snapshot.salient_neighbours();
    let mut salient: Vec<(u64, Node)> =
        snapshot.salient().map(|node| (snapshot.keyframe(node).id, node)).collect();
    salient.sort_unstable();
    let mut ranks = vec![0; snapshot.keyframes.len()];
    salient.iter().enumerate().for_each(|(rank, (_, node))| ranks[node.index()] = rank);
    let near = |&(_, node): &(u64, Node)| {
        let near = lists.of(node).map(|other| (ranks[other.index()], snapshot.body(other)));
        cluster::within(near, &snapshot.body(node), eps_m)
    };
    let neighbours: Vec<Vec<(usize, i64)>> = salient.iter().map(near).collect();
    let clusters = cluster::dbscan(&neighbours, min_points);
    clusters.into_iter().map(|ranks| ranks.into_iter().map(|rank| salient[rank]).collect()).collect()
}

/// u = |Sigma|^(1/6) of each node's marginal, by node.
fn uncertainties(
    snapshot: &Snapshot,
    nodes: impl Iterator<Item = Node>,
) -> Result<BTreeMap<Node, f64>, PlanningError> {
    let mut nodes: Vec<Node> = nodes.collect();
    nodes.sort_unstable();
    let marginals = snapshot.elimination.marginals_of(&nodes)?;
    let known = nodes.into_iter().zip(&marginals);
    known.map(|(node, marginal)| Ok((node, sixth_root_determinant(marginal)?))).collect()
}

/// The keyframe with the greatest S_G * u_min / u, the rarest view and the surest pose, represents those
/// within `max_cluster_radius_m` of it; what is left of the cluster is represented in the same way. u_min is
/// always that of the whole cluster: a factor of all its scores alike, which so fall from each to the next.
fn represent(
    snapshot: &Snapshot,
    uncertainties: &BTreeMap<Node, f64>,
    cluster: &[(u64, Node)],
) -> Vec<Waypoint> {
    let least = cluster.iter().map(|(_, node)| uncertainties[node]).fold(f64::INFINITY, f64::min);
    let score = |node: Node| snapshot.keyframe(node).saliency.global * (least / uncertainties[&node]);
    let scores: Vec<f64> = cluster.iter().map(|&(_, node)| score(node)).collect();
    let places: Vec<Vector3<f64>> = cluster.iter().map(|&(_, node)| snapshot.body(node)).collect();
    let represented = cluster::representatives(&scores, &places, snapshot.max_cluster_radius_m());
    let waypoint = |(best, members): (usize, Vec<usize>)| {
        let (keyframe, node) = cluster[best];
        Waypoint {
            keyframe,
            node,
            pose: snapshot.keyframe(node).world_from_body,
            marginal_uncertainty: uncertainties[&node],
            score: scores[best],
            members: members.into_iter().map(|index| cluster[index].0).collect(),
            route: None,
            candidate: false,
        }
    };
    represented.into_iter().map(waypoint).collect()
}

/// |Sigma|^(1/6), from the logarithm of the determinant.
fn sixth_root_determinant(covariance: &Matrix6<f64>) -> Result<f64, PlanningError> {
    Ok((gaussian::log_determinant(covariance)? / 6.0).exp())
}

/// Long enough, and not all at the robot's place, whatever `min_revisit_m` says.
fn is_worth_a_detour(snapshot: &Snapshot, route: &Route) -> bool {
    let place = |node: Node| snapshot.keyframe(node).world_from_body.translation.vector;
    let away_m = |node: Node| (place(node) - place(route.keyframes[0])).norm();
    nanometres(route.one_way_m) >= nanometres(snapshot.settings.min_revisit_m)
        && route.keyframes.iter().any(|&node| away_m(node) >= SAME_PLACE_M)
}
