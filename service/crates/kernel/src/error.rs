use crate::Node;

/// Why a computation has no answer, with the numbers that show it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum KernelError {
    /// A number is infinite or not a number.
    #[error("{what}: entry {index} is {value}, which is not finite")]
    NotFinite {
        /// What the number belongs to.
        what: &'static str,
        /// Position of the first such number (row-major in a matrix).
        index: usize,
        /// The number.
        value: f64,
    },

    /// Two mirrored entries of a covariance differ.
    #[error(
        "covariance: entries ({row}, {column}) and ({column}, {row}) differ by {difference_ratio:e} of the \
         product of their standard deviations"
    )]
    NotSymmetric {
        /// Row of the first such entry, greater than `column`.
        row: usize,
        /// Column of the first such entry.
        column: usize,
        /// |s_ij - s_ji| / sqrt(s_ii s_jj).
        difference_ratio: f64,
    },

    /// A covariance gives some combination of its components no variance, or a negative one.
    #[error(
        "covariance: given the components before it, component {index} (variance {variance:e}) is \
         left with variance {pivot:e}; it must be positive"
    )]
    CovarianceNotPositiveDefinite {
        /// Row of the Cholesky factor at which it stopped.
        index: usize,
        /// What is left of the variance there: s_ii - sum_k l_ik^2.
        pivot: f64,
        /// s_ii itself.
        variance: f64,
    },

    /// A quaternion or a direction is not of length 1.
    #[error("{what}: its norm is {norm}; it must be 1 within 1e-6")]
    NotUnit {
        /// What has that norm.
        what: &'static str,
        /// The norm.
        norm: f64,
    },

    /// A number that must be above zero is not.
    #[error("{what}: {value} must be positive")]
    NotPositive {
        /// What the number is.
        what: &'static str,
        /// The number.
        value: f64,
    },

    /// Two cameras are too close together for the direction from one to the other to tell anything.
    #[error("the baseline of {baseline_m} m is shorter than {min_baseline_m} m")]
    DegenerateBaseline {
        /// Distance between the two cameras, metres.
        baseline_m: f64,
        /// The least distance that is accepted here, metres.
        min_baseline_m: f64,
    },

    /// A factor between two keyframes names the same one twice.
    #[error("a factor ties keyframe {node} to itself")]
    SameNode {
        /// The keyframe.
        node: Node,
    },

    /// A factor between two keyframes was given only one pose.
    #[error("a factor between two keyframes needs the pose of keyframe {node} too")]
    MissingPose {
        /// The keyframe whose pose is missing.
        node: Node,
    },

    /// What was kept of a smoother does not fit its factors.
    #[error("what was kept of the smoother is of another graph: {problem}")]
    OtherGraph {
        /// What does not fit.
        problem: &'static str,
    },

    /// The graph leaves some motion of a keyframe undetermined.
    #[error(
        "the information of keyframe {node}, given what was eliminated before it, has pivot {pivot:e}; \
         it must be positive"
    )]
    NotPositiveDefinite {
        /// The keyframe at which the factorisation stopped.
        node: Node,
        /// The pivot found there.
        pivot: f64,
    },

    /// A virtual node of a path is left without information in some direction.
    #[error(
        "the information of virtual node {node}, given what was eliminated before it, has pivot {pivot:e}; \
         it must be positive"
    )]
    VirtualNotPositiveDefinite {
        /// The virtual node, 1 to n.
        node: u32,
        /// The pivot found there.
        pivot: f64,
    },

    /// A node that is not in the graph.
    #[error("keyframe {node} is not among the {nodes} of the graph")]
    UnknownNode {
        /// The node asked for.
        node: Node,
        /// Number of nodes.
        nodes: usize,
    },

    /// The places of a virtual path do not fit together.
    #[error(
        "a path needs the robot's place and one more, and odometry to each but the first: {places} places, \
         odometry is wrong at place {}", .wrong_step.map_or("(none)".to_string(), |place| place.to_string())
    )]
    PathShape {
        /// Number of places, the robot's included.
        places: usize,
        /// The first place that has odometry though it is the robot's, or has none though it is not.
        wrong_step: Option<usize>,
    },
}
