//! What a candidate path adds to the pose graph: virtual nodes and their expected information.

use nalgebra::Matrix6;

use crate::Node;
use crate::information::PairInformation;

/// A path that has not been driven: virtual nodes 1 to n after the robot, which is node 0.
///
/// All information is at the linearisation points of the elimination it is added to, tangent
/// order `[rho (m); phi (rad)]` of each node's right perturbation.
#[derive(Clone, Debug)]
pub struct VirtualPath {
    /// The keyframe at which the path begins: virtual node 0.
    pub robot: Node,
    /// Information of each virtual node 1 to n on its own (expected attitude and depth; may be zero).
    /// Its length is n, which is at least 1.
    pub unary: Vec<Matrix6<f64>>,
    /// Odometry information: entry i joins virtual nodes i and i + 1 (`first` = node i,
    /// `second` = node i + 1), i = 0 to n - 1.
    pub steps: Vec<PairInformation>,
    /// Possible registrations of virtual nodes with keyframes, in any order.
    pub links: Vec<VirtualLink>,
}

/// A possible registration between a virtual node and a keyframe.
#[derive(Clone, Debug)]
pub struct VirtualLink {
    /// Virtual node, 1 to n.
    pub node: u32,
    /// The keyframe it would register with.
    pub keyframe: Node,
    /// Information of a registration that succeeds (`first` = keyframe, `second` = virtual node).
    pub information: PairInformation,
    /// Probability P_L that it succeeds, 0 to 1.
    pub probability: f64,
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
