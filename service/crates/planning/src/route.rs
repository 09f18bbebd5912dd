//! Ways from the robot to the waypoints over the keyframes of the graph [PDN12, III.C].
//!
//! The paper weights A*'s heuristic by 2 - S_L, which has local minima, and perturbs the search out of them. Here
//! the weight stands in the cost of an edge, where the same criterion has a global optimum, and one search from
//! the robot finds it for all waypoints.

use crate::distance::nanometres;
use crate::error::PlanningError;
use crate::registration::view_angle_rad;
use crate::snapshot::Snapshot;
use pathfinding::directed::dijkstra::dijkstra_partial;
use pdn_kernel::Node;
use std::collections::BTreeSet;

/// Edge radius in medians of the distance of consecutive keyframes, where the mission names none.
const EDGE_RADIUS_IN_SPACINGS: f64 = 2.6;

/// A way from the robot to a waypoint.
#[derive(Clone, Debug, PartialEq)]
pub struct Route {
    /// Keyframes from the robot to the waypoint, both included.
    pub keyframes: Vec<Node>,
    /// Length of the polyline through their positions, m.
    pub one_way_m: f64,
}

/// The cheapest route from the robot to each goal, in their order; none for a goal out of reach.
///
/// Two keyframes are connected if they are closer than `edge_radius_m` (2.6 times the median distance of
/// consecutive keyframes) and either their optical axes differ by `max_view_angle_rad` at most or the vehicle
/// itself went from one to the other: a plate has two sides. An edge costs (2 - S_L(target)) * distance. Where
/// routes of equal cost meet, the one from the keyframe of lower id is taken.
///
/// Cost: one search with n log n over the keyframes nearer than the goals.
///
/// # Errors
/// [`PlanningError::NoKeyframe`].
pub fn routes(snapshot: &Snapshot, goals: &[Node]) -> Result<Vec<Option<Route>>, PlanningError> {
    let robot = snapshot.robot()?;
    let network = Network::new(snapshot);
    let mut wanted: BTreeSet<Node> = goals.iter().copied().collect();
    let (reached, _) = dijkstra_partial(
        &robot,
        |&node| network.edges_from(node),
        |node| {
            wanted.remove(node);
            wanted.is_empty()
        },
    );
    let cost = |node: Node| match reached.get(&node) {
        Some(&(_, cost)) => Some(cost),
        None => (node == robot).then_some(0),
    };
    let predecessor = |node: Node| {
        let arrived = cost(node)?;
        let is_tied = |other: Node| {
            cost(other).is_some_and(|there| there < arrived && there + network.cost(other, node) == arrived)
        };
        let tied = network.connected_to(node).into_iter().find(|&other| is_tied(other));
        tied.or_else(|| reached.get(&node).map(|&(parent, _)| parent))
    };
    let route = |goal: Node| {
        let mut keyframes = vec![goal];
        while *keyframes.last().expect("the goal is in the list") != robot {
            keyframes.push(predecessor(*keyframes.last().expect("the goal is in the list"))?);
        }
        keyframes.reverse();
        let one_way_m = keyframes.windows(2).map(|pair| network.distance_m(pair[0], pair[1])).sum();
        Some(Route { keyframes, one_way_m })
    };
    Ok(goals.iter().map(|&goal| route(goal)).collect())
}

/// The keyframes and the edges between them.
struct Network<'a> {
    snapshot: &'a Snapshot,
    radius_m: f64,
    went: BTreeSet<(Node, Node)>,
}

impl Network<'_> {
    fn new(snapshot: &Snapshot) -> Network<'_> {
        let by_spacing = || EDGE_RADIUS_IN_SPACINGS * snapshot.spacing_m().unwrap_or(0.0);
        let both_ways = snapshot.went.iter().flat_map(|&(from, to)| [(from, to), (to, from)]);
        Network {
            snapshot,
            radius_m: snapshot.settings.edge_radius_m.unwrap_or_else(by_spacing),
            went: both_ways.collect(),
        }
    }

    /// Keyframes that a keyframe is connected to, in the order of their ids.
    fn connected_to(&self, node: Node) -> Vec<Node> {
        let here = self.snapshot.keyframe(node);
        let camera = here.world_from_camera();
        let near = self.snapshot.bodies_within(&here.world_from_body.translation.vector, self.radius_m);
        let mut connected: Vec<Node> = near
            .into_iter()
            .filter(|&(other, distance_m)| {
                let other_camera = || self.snapshot.keyframe(other).world_from_camera();
                let limit_rad = self.snapshot.settings.max_view_angle_rad;
                other != node
                    && nanometres(distance_m) < nanometres(self.radius_m)
                    && (view_angle_rad(&camera, &other_camera()) <= limit_rad
                        || self.went.contains(&(node, other)))
            })
            .map(|(other, _)| other)
            .collect();
        connected.sort_by_key(|&other| self.snapshot.keyframe(other).id);
        connected
    }

    fn edges_from(&self, node: Node) -> Vec<(Node, i128)> {
        self.connected_to(node).into_iter().map(|target| (target, self.cost(node, target))).collect()
    }

    /// In whole picometres: sums of integers are exact, so routes tie or do not, whatever the order of addition.
    fn cost(&self, node: Node, target: Node) -> i128 {
        let cost_m = (2.0 - self.snapshot.keyframe(target).saliency.local) * self.distance_m(node, target);
        (cost_m * 1e12).round() as i128
    }

    fn distance_m(&self, node: Node, other: Node) -> f64 {
        let place = |node| self.snapshot.keyframe(node).world_from_body.translation.vector;
        (place(other) - place(node)).norm()
    }
}
