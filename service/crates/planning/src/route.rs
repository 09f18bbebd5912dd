//! Ways from the robot to the waypoints over the keyframes of the graph [PDN12, III.C].
//!
//! The paper weights A*'s heuristic by 2 - S_L, which has local minima, and perturbs the search out of them.
//! Here the weight stands in the cost of an edge, where the same criterion has a global optimum, and one
//! search from the robot finds it for all waypoints.

use crate::distance::is_less;
use crate::error::PlanningError;
use crate::revisit::Route;
use crate::snapshot::Snapshot;
use crate::spatial::VerletLists;
use crate::view_angle::AngleLimit;
use nalgebra::Vector3;
use pathfinding::directed::dijkstra::dijkstra_partial;
use pdn_kernel::Node;
use std::cell::OnceCell;
use std::collections::{BTreeMap, BTreeSet};

/// The cheapest route from the robot to each goal, in their order; none for a goal out of reach.
///
/// Two keyframes are connected if they are closer than [`Snapshot::edge_radius_m`] and either their optical
/// axes differ by `max_view_angle_rad` at most or the vehicle itself went from one to the other: a plate has
/// two sides. An edge costs (2 - S_L(target)) * distance. Where routes of equal cost meet, the one from the
/// keyframe of lower id is taken.
///
/// Cost: one search with n log n over the keyframes nearer than the goals.
///
/// # Errors
/// [`PlanningError::NoKeyframe`].
pub fn routes(snapshot: &Snapshot, goals: &[Node]) -> Result<Vec<Option<Route>>, PlanningError> {
    let robot = snapshot.robot()?;
    let graph = RouteGraph::new(snapshot);
    let mut wanted: BTreeSet<Node> = goals.iter().copied().collect();
    let (reached, _) = dijkstra_partial(
        &robot,
        |&node| graph.edges_from(node),
        |node| {
            wanted.remove(node);
            wanted.is_empty()
        },
    );
    let cost = |node: Node| match reached.get(&node) {
        Some(&(_, cost)) => Some(cost),
        None => (node == robot).then_some(0),
    };
    let find_predecessor = |node: Node| {
        let arrived = cost(node)?;
        let is_tied = |edge: &Edge| {
            cost(edge.to)
                .is_some_and(|there| there < arrived && there + graph.cost(node, edge.distance_m) == arrived)
        };
        let tied = graph.edges(node).into_iter().find(is_tied).map(|edge| edge.to);
        tied.or_else(|| reached.get(&node).map(|&(parent, _)| parent))
    };
    // Routes share their beginnings.
    let mut predecessors: BTreeMap<Node, Option<Node>> = BTreeMap::new();
    let mut route = |goal: Node| {
        let (mut keyframes, mut at) = (vec![goal], goal);
        while at != robot {
            at = (*predecessors.entry(at).or_insert_with(|| find_predecessor(at)))?;
            keyframes.push(at);
        }
        keyframes.reverse();
        let one_way_m = keyframes.windows(2).map(|pair| graph.distance_m(pair[0], pair[1])).sum();
        Some(Route { keyframes, one_way_m })
    };
    Ok(goals.iter().map(|&goal| route(goal)).collect())
}

/// The graph that is searched: the keyframes and the edges between them.
struct RouteGraph<'a> {
    snapshot: &'a Snapshot,
    neighbours: &'a VerletLists,
    places: &'a [Vector3<f64>],
    radius_m: f64,
    angle: AngleLimit,
    /// Whether the order of nodes is that of ids.
    is_in_order: bool,
    /// 2 - S_L.
    weights: Vec<f64>,
    /// Optical axis of each keyframe's camera, in the world.
    axes: &'a [Vector3<f64>],
    /// Pairs, the lower node first, ascending.
    went: OnceCell<Vec<(Node, Node)>>,
}

/// One end of an edge.
#[derive(Clone, Copy, Debug)]
struct Edge {
    to: Node,
    distance_m: f64,
}

impl RouteGraph<'_> {
    fn new(snapshot: &Snapshot) -> RouteGraph<'_> {
        RouteGraph {
            snapshot,
            neighbours: snapshot.neighbours(),
            places: snapshot.bodies().positions(),
            radius_m: snapshot.edge_radius_m(),
            angle: AngleLimit::new(snapshot.settings.max_view_angle_rad),
            is_in_order: snapshot.keyframes.is_sorted_by_key(|keyframe| keyframe.id),
            weights: snapshot.keyframes.iter().map(|keyframe| 2.0 - keyframe.saliency.local).collect(),
            axes: &snapshot.cameras().axes,
            went: OnceCell::new(),
        }
    }

    /// The edges of a keyframe, in the order of the other keyframes' ids.
    fn edges(&self, node: Node) -> Vec<Edge> {
        let axis = &self.axes[node.index()];
        let is_edge = |&Edge { to, distance_m }: &Edge| {
            is_less(distance_m, self.radius_m)
                && (self.angle.admits(axis, &self.axes[to.index()]) || self.went_between(node, to))
        };
        let near = self.neighbours.of(node);
        let mut edges: Vec<Edge> = Vec::with_capacity(near.len());
        let near = near.map(|to| Edge { to, distance_m: self.distance_m(node, to) });
        edges.extend(near.filter(is_edge));
        if !self.is_in_order {
            edges.sort_unstable_by_key(|edge| self.snapshot.keyframe(edge.to).id);
        }
        edges
    }

    fn went_between(&self, one: Node, other: Node) -> bool {
        let ascending = |(from, to): (Node, Node)| (from.min(to), from.max(to));
        let went = self.went.get_or_init(|| {
            let mut went: Vec<(Node, Node)> = self.snapshot.went.iter().copied().map(ascending).collect();
            went.sort_unstable();
            went
        });
        went.binary_search(&ascending((one, other))).is_ok()
    }

    fn edges_from(&self, node: Node) -> impl Iterator<Item = (Node, i128)> {
        self.edges(node).into_iter().map(|edge| (edge.to, self.cost(edge.to, edge.distance_m)))
    }

    /// Of an edge to `target`. In whole picometres: sums of integers are exact, so routes tie or do not,
    /// whatever the order of addition.
    fn cost(&self, target: Node, distance_m: f64) -> i128 {
        (self.weights[target.index()] * distance_m * 1e12).round() as i128
    }

    fn distance_m(&self, node: Node, other: Node) -> f64 {
        (self.places[other.index()] - self.places[node.index()]).norm()
    }
}
