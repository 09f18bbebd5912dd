//! What a round trip that has not been driven adds to the pose graph: virtual nodes and their expected information.

use nalgebra::Matrix6;

use crate::Node;
use crate::information::PairInformation;

/// A round trip from the robot over places 1 to m and back over the same ones to where it began, place 0.
///
/// Its virtual nodes are 1 to n = 2m: node i <= m stands at place i on the way out, node n - i at place i on the
/// way back; node n, the terminal one, ends at place 0. The robot itself is node 0. What is expected at a place, its
/// sensors and its possible registrations, is expected each time it is passed. All information is at the
/// linearisation points of the elimination it is added to, tangent order `[rho (m); phi (rad)]`.
#[derive(Clone, Debug)]
pub struct VirtualPath {
    /// The keyframe at which the path begins: virtual node 0.
    pub robot: Node,
    /// Information of a node on its own (expected attitude and depth; may be zero) at each place 0 to m, m at least 1.
    /// At place 0 it is the terminal node's.
    pub unary: Vec<Matrix6<f64>>,
    /// Odometry information of the way out: entry i joins place i (`first`) and place i + 1 (`second`), i = 0 to m - 1.
    pub out: Vec<PairInformation>,
    /// Odometry information of the way back: entry i joins place i + 1 (`first`) and place i (`second`).
    pub back: Vec<PairInformation>,
    /// Possible registrations at the places with keyframes, in any order.
    pub links: Vec<VirtualLink>,
}

/// A possible registration between a node at a place and a keyframe.
#[derive(Clone, Debug, PartialEq)]
pub struct VirtualLink {
    /// Place, 0 to m.
    pub place: u32,
    /// The keyframe it would register with.
    pub keyframe: Node,
    /// Information of a registration that succeeds (`first` = keyframe, `second` = virtual node).
    pub information: PairInformation,
    /// Probability P_L that it succeeds, 0 to 1.
    pub probability: f64,
}

impl VirtualPath {
    /// m, the number of places besides the robot's.
    pub fn places(&self) -> u32 {
        self.unary.len() as u32 - 1
    }

    /// n, the number of virtual nodes besides the robot.
    pub fn nodes(&self) -> u32 {
        2 * self.places()
    }

    /// The place of a virtual node 1 to n.
    pub fn place_of(&self, node: u32) -> u32 {
        node.min(self.nodes() - node)
    }

    /// The virtual nodes at a place, on the way out and on the way back; place 0 has the terminal node, place m one node.
    pub fn nodes_at(&self, place: u32) -> [Option<u32>; 2] {
        let out = (place > 0).then_some(place);
        [out, (place < self.places()).then_some(self.nodes() - place)]
    }

    /// The greatest place up to which, neither path's last one included, another path is the same; 0 unless both begin at the
    /// same robot, end alike at place 0, and name their links in the order of places.
    pub(super) fn shared_places(&self, other: &VirtualPath) -> u32 {
        let mut links = self.links.iter().zip(&other.links).peekable();
        let mut same_links = |place: u32| {
            let mut same = true;
            while let Some((one, other)) = links.next_if(|(one, other)| one.place.min(other.place) <= place) {
                same &= one == other;
            }
            same
        };
        let in_order = |path: &VirtualPath| path.links.is_sorted_by_key(|link| link.place);
        if !in_order(self)
            || !in_order(other)
            || self.robot != other.robot
            || self.unary[0] != other.unary[0]
            || !same_links(0)
        {
            return 0;
        }
        let last = self.places().min(other.places());
        let is_same = |place: u32| {
            let at = place as usize;
            self.unary[at] == other.unary[at]
                && self.out[at - 1] == other.out[at - 1]
                && self.back[at - 1] == other.back[at - 1]
        };
        (1..last).find(|&place| !is_same(place) || !same_links(place)).unwrap_or(last) - 1
    }

    /// Odometry information between virtual nodes i (`first`) and i + 1 (`second`), i = 0 to n - 1.
    pub fn step(&self, node: u32) -> &PairInformation {
        if node < self.places() {
            &self.out[node as usize]
        } else {
            &self.back[(self.nodes() - node - 1) as usize]
        }
    }
}

/// How links count.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LinkWeight {
    /// Each link by its probability: expected information, \[PDN12, eq. 3\].
    Expected,
    /// Each link as if it succeeded.
    All,
    /// No link at all.
    None,
}

impl LinkWeight {
    /// The factor by which this link's information is scaled.
    pub fn of(self, link: &VirtualLink) -> f64 {
        match self {
            LinkWeight::Expected => link.probability,
            LinkWeight::All => 1.0,
            LinkWeight::None => 0.0,
        }
    }
}

/// Covariances at the end of a path and along it.
#[derive(Clone, Debug, PartialEq)]
pub struct ExpectedCovariance {
    /// Sigma_nn, the covariance of the last virtual node, `[rho; phi]`.
    pub terminal: Matrix6<f64>,
    /// Covariance of each virtual node 1 to n in the same inverse; empty unless asked for.
    pub along: Vec<Matrix6<f64>>,
}

/// Covariances at the end of a path for each way in which its links may count, and along it.
#[derive(Clone, Debug, PartialEq)]
pub struct ExpectedCovariances {
    /// Sigma_nn with each link weighed by its probability.
    pub terminal: Matrix6<f64>,
    /// Sigma_nn with every link registered.
    pub terminal_all_links: Matrix6<f64>,
    /// Sigma_nn with none registered.
    pub terminal_no_links: Matrix6<f64>,
    /// Covariance of each virtual node 1 to n, in the inverse of `terminal`.
    pub along: Vec<Matrix6<f64>>,
}
