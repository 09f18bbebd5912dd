//! What a round trip that has not been driven adds to the pose graph: virtual nodes and their expected
//! information.

use std::sync::Arc;

use nalgebra::Matrix6;

use crate::Node;
use crate::information::PairInformation;

/// A round trip from the robot over places 1 to m and back over the same ones to where it began, place 0.
///
/// Its virtual nodes are 1 to n = 2m: node i <= m stands at place i on the way out, node n - i at place i on
/// the way back; node n, the terminal one, ends at place 0. The robot itself is node 0. What is expected at a
/// place, its sensors and its possible registrations, is expected each time it is passed. All information is
/// at the linearisation points of the elimination it is added to, tangent order `[rho (m); phi (rad)]`.
#[derive(Clone, Debug, PartialEq)]
pub struct VirtualPath {
    /// The keyframe at which the path begins: virtual node 0.
    pub robot: Node,
    /// Places 0 to m, m at least 1. Paths that begin alike do best to share them.
    pub places: Vec<Arc<VirtualPlace>>,
}

/// A place of a round trip, as it is come to from the place before.
#[derive(Clone, Debug, PartialEq)]
pub struct VirtualPlace {
    /// Information of a node on its own (expected attitude and depth; may be zero). At place 0 it is the
    /// terminal node's.
    pub unary: Matrix6<f64>,
    /// Odometry between the place before and this one; none at place 0, and only there.
    pub steps: Option<VirtualSteps>,
    /// Possible registrations with keyframes, in any order.
    pub links: Vec<VirtualLink>,
}

/// Odometry information between a place and the place before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VirtualSteps {
    /// Of the way out: the place before is `first`, this one `second`.
    pub out: PairInformation,
    /// Of the way back: this place is `first`, the one before `second`.
    pub back: PairInformation,
}

/// A possible registration between a node at a place and a keyframe.
#[derive(Clone, Debug, PartialEq)]
pub struct VirtualLink {
    /// The keyframe it would register with.
    pub keyframe: Node,
    /// Information of a registration that succeeds (`first` = keyframe, `second` = virtual node).
    pub information: PairInformation,
    /// Probability P_L that it succeeds, 0 to 1.
    pub probability: f64,
}

impl VirtualPath {
    /// m, the number of places besides the robot's.
    pub fn last_place(&self) -> u32 {
        self.places.len() as u32 - 1
    }

    /// n, the number of virtual nodes besides the robot.
    pub fn nodes(&self) -> u32 {
        2 * self.last_place()
    }

    /// The place of a virtual node 1 to n.
    pub fn place_of(&self, node: u32) -> u32 {
        node.min(self.nodes() - node)
    }

    /// The virtual nodes at a place, on the way out and on the way back; place 0 has the terminal node, place
    /// m one node.
    pub fn nodes_at(&self, place: u32) -> [Option<u32>; 2] {
        let out = (place > 0).then_some(place);
        [out, (place < self.last_place()).then_some(self.nodes() - place)]
    }

    /// Possible registrations with their places, in the order of places.
    pub fn links(&self) -> impl Iterator<Item = (u32, &VirtualLink)> {
        (0..).zip(&self.places).flat_map(|(number, place)| place.links.iter().map(move |link| (number, link)))
    }

    /// Possible registrations with their virtual nodes: what is expected at a place is expected at each of
    /// its nodes. In the order of places.
    pub fn node_links(&self) -> impl Iterator<Item = (u32, &VirtualLink)> {
        let at_nodes =
            |(place, link)| self.nodes_at(place).into_iter().flatten().map(move |node| (node, link));
        self.links().flat_map(at_nodes)
    }

    /// Odometry information between virtual nodes i (`first`) and i + 1 (`second`), i = 0 to n - 1. The path
    /// must have a step to each place but 0.
    pub fn step(&self, node: u32) -> &PairInformation {
        if node < self.last_place() {
            &self.steps_to(node + 1).out
        } else {
            &self.steps_to(self.nodes() - node).back
        }
    }

    /// Information of a virtual node 1 to n on its own.
    pub fn unary(&self, node: u32) -> &Matrix6<f64> {
        &self.places[self.place_of(node) as usize].unary
    }

    pub(super) fn steps_to(&self, place: u32) -> &VirtualSteps {
        self.places[place as usize].steps.as_ref().expect("there is a step to each place but the robot's")
    }

    /// The greatest place up to which, neither path's last one included, another path is the same; 0 unless
    /// both begin at the same robot and end alike at place 0.
    pub(super) fn shared_places(&self, other: &VirtualPath) -> u32 {
        let is_same = |&place: &u32| {
            let (one, other) = (&self.places[place as usize], &other.places[place as usize]);
            Arc::ptr_eq(one, other) || one == other
        };
        if self.robot != other.robot || !is_same(&0) {
            return 0;
        }
        let last = self.last_place().min(other.last_place());
        (1..last).find(|place| !is_same(place)).unwrap_or(last) - 1
    }
}

/// How links count.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum LinkWeight {
    /// Each link by its probability: expected information, \[PDN12, eq. 3\].
    Expected,
    /// Each link as if it succeeded.
    All,
}

impl LinkWeight {
    /// The factor by which this link's information is scaled.
    pub(super) fn of(self, link: &VirtualLink) -> f64 {
        match self {
            LinkWeight::Expected => link.probability,
            LinkWeight::All => 1.0,
        }
    }
}

/// Covariances at the end of a path for each way in which its links may count, and along it.
#[derive(Clone, Debug, PartialEq)]
pub struct ExpectedCovariances {
    /// Sigma_nn, the covariance of the last virtual node, `[rho; phi]`, with each link weighed by its
    /// probability.
    pub terminal: Matrix6<f64>,
    /// Sigma_nn with every link registered.
    pub terminal_all_links: Matrix6<f64>,
    /// Sigma_nn with none registered.
    pub terminal_no_links: Matrix6<f64>,
    /// Covariance of each virtual node 1 to n, in the inverse of `terminal`.
    pub along: Vec<Matrix6<f64>>,
}
