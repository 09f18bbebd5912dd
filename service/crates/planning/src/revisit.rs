//! What there is to revisit: waypoints, and the routes to them.

use pdn_kernel::Node;
use pdn_kernel::se3::Pose;

/// A keyframe that represents a cluster of salient keyframes, or what of a large cluster is near it.
#[derive(Clone, Debug, PartialEq)]
pub struct Waypoint {
    /// Id of the representative keyframe.
    pub keyframe: u64,
    /// Its node.
    pub node: Node,
    /// Its linearisation point.
    pub pose: Pose,
    /// u = |Sigma|^(1/6) of its marginal.
    pub marginal_uncertainty: f64,
    /// S_G * u_min / u, by which it was chosen; u_min is the least in the whole cluster.
    pub score: f64,
    /// Ids of the keyframes that it represents, its own among them, sorted.
    pub members: Vec<u64>,
    /// The way from the robot; none if there is none.
    pub route: Option<Route>,
    /// Whether decisions consider it: its route is no shorter than `min_revisit_m`.
    pub candidate: bool,
}

/// A route from the robot to a waypoint.
#[derive(Clone, Debug, PartialEq)]
pub struct Route {
    /// Keyframes from the robot to the waypoint, both included.
    pub keyframes: Vec<Node>,
    /// Length of the polyline through their positions, m.
    pub one_way_m: f64,
}
