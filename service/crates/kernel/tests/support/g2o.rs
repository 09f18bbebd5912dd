//! Published pose graphs in g2o form, as a stream of keyframes.

use nalgebra::{Matrix6, Translation3, UnitQuaternion, Vector6};
use pdn_kernel::smoother::Smoother;
use pdn_kernel::{Factor, Node, Pose};

/// A 6-DOF measurement between two poses of a file.
pub struct Edge {
    pub from: u32,
    pub to: u32,
    pub relative: Pose,
    pub covariance: Matrix6<f64>,
}

/// `EDGE_SE3:QUAT from to x y z qx qy qz qw` and the upper triangle of the information matrix, in our order.
pub fn parse_edges(text: &str) -> Vec<Edge> {
    text.lines()
        .filter_map(|line| line.strip_prefix("EDGE_SE3:QUAT"))
        .map(|line| {
            let numbers: Vec<f64> =
                line.split_whitespace().map(|word| word.parse().expect("a number")).collect();
            let quaternion = nalgebra::Quaternion::new(numbers[8], numbers[5], numbers[6], numbers[7]);
            let translation = Translation3::new(numbers[2], numbers[3], numbers[4]);
            let mut information = Matrix6::zeros();
            let mut rest = numbers[9..].iter();
            for row in 0..6 {
                for column in row..6 {
                    let value = *rest.next().expect("21 numbers");
                    information[(row, column)] = value;
                    information[(column, row)] = value;
                }
            }
            Edge {
                from: numbers[0] as u32,
                to: numbers[1] as u32,
                relative: Pose::from_parts(translation, UnitQuaternion::from_quaternion(quaternion)),
                covariance: information.cholesky().expect("positive definite information").inverse(),
            }
        })
        .collect()
}

/// Number of keyframes that edges name.
pub fn keyframes(edges: &[Edge]) -> u32 {
    edges.iter().map(|edge| edge.from.max(edge.to) + 1).max().expect("there are edges")
}

/// Adds a keyframe with its edges to those before it; the first gets a prior with deviations of 1e-3 m and
/// rad. Its pose is that of the first such edge.
pub fn add_keyframe(smoother: &mut Smoother, node: u32, edges: &[Edge]) {
    if node == 0 {
        let covariance = Matrix6::from_diagonal(&Vector6::repeat(1e-6));
        smoother.add_keyframe(Pose::identity());
        let prior = Factor::prior(Node(0), Pose::identity(), &covariance).expect("a valid prior");
        smoother.add_factor(prior).expect("node 0 exists");
        return;
    }
    let own: Vec<Factor> = edges
        .iter()
        .filter(|edge| edge.from.max(edge.to) == node)
        .map(|edge| {
            Factor::relative(Node(edge.from), Node(edge.to), edge.relative, &edge.covariance)
                .expect("a valid edge")
        })
        .collect();
    let initial = own.iter().find_map(|factor| {
        let (from, to) = factor.nodes();
        let to = to.expect("a relative factor has two nodes");
        let known = if to.0 == node { from } else { to };
        factor.pose_of_other(known, &smoother.estimate(known))
    });
    smoother.add_keyframe(initial.expect("each pose has an edge to an earlier one"));
    for factor in own {
        smoother.add_factor(factor).expect("both nodes exist");
    }
}
