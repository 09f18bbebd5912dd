//! Published pose graphs, streamed keyframe by keyframe, against optima and covariances computed elsewhere.

mod support;

use std::path::PathBuf;

use nalgebra::{Matrix6, Translation3, UnitQuaternion, Vector6};
use pdn_kernel::smoother::{Smoother, SmootherSettings};
use pdn_kernel::{Factor, Node, Pose};
use support::scaled_difference;

/// A 6-DOF measurement between two poses of a file.
struct Edge {
    from: u32,
    to: u32,
    relative: Pose,
    covariance: Matrix6<f64>,
}

#[test]
fn tiny_grid() {
    reaches_the_published_optimum("tinyGrid3D");
}

#[test]
fn small_grid() {
    reaches_the_published_optimum("smallGrid3D");
}

#[test]
fn parking_garage() {
    reaches_the_published_optimum("parking-garage");
}

#[test]
fn sphere() {
    reaches_the_published_optimum("sphere2500");
}

fn reaches_the_published_optimum(name: &str) {
    let folder = folder();
    let (graph, expected) = (folder.join(format!("{name}.g2o")), folder.join(format!("expected/{name}.json")));
    let (Ok(graph), Ok(expected)) = (std::fs::read_to_string(&graph), std::fs::read_to_string(&expected)) else {
        println!("skipped: {} and {} are needed; PDN_SHARED names the folder above data/", graph.display(), expected.display());
        return;
    };
    let edges = parse_edges(&graph);
    let smoother = stream(&edges);

    let chi2 = smoother.chi2().expect("the estimate is finite");
    let prior = smoother.factors().next().expect("the prior is the first factor");
    let own = prior.chi2(&smoother.estimate(Node(0)), None).expect("the estimate is finite");
    let optimum = numbers_after(&expected, &["\"optimal\"", "\"se3log\"", "\"chi2\""], 1)[0];
    let relative = (chi2 - own - optimum).abs() / optimum;
    println!("{name}: chi2 {} (prior {own:e}), expected {optimum}: {relative:e}", chi2 - own);
    assert!(relative < 1e-6, "{name}: {relative:e}");

    let published = numbers_after(&expected, &["\"optimal\"", "\"se3log\"", "\"cov_last_prior_1e-3\""], 36);
    // Theirs has rotation first.
    let swap = |axis: usize| (axis + 3) % 6;
    let wanted = Matrix6::from_fn(|row, column| published[6 * swap(row) + swap(column)]);
    let last = Node(smoother.len() as u32 - 1);
    let found = smoother.marginal(last).expect("the graph is anchored");
    let difference = scaled_difference(&found, &wanted);
    println!("{name}: covariance of the last pose differs by {difference:e}");
    assert!(difference < 1e-6, "{name}: {difference:e}");
}

/// Adds the keyframes in the order of their ids, each with the edges to those before it, and lets the smoother
/// advance after each.
fn stream(edges: &[Edge]) -> Smoother {
    let mut smoother = Smoother::new(SmootherSettings::default());
    let first = Pose::identity();
    let covariance = Matrix6::from_diagonal(&Vector6::repeat(1e-6));
    smoother.add_keyframe(first);
    smoother.add_factor(Factor::prior(Node(0), first, &covariance).expect("a valid prior")).expect("node 0 exists");
    let last = edges.iter().map(|edge| edge.from.max(edge.to)).max().expect("there are edges");
    for node in 1..=last {
        let own: Vec<Factor> = edges
            .iter()
            .filter(|edge| edge.from.max(edge.to) == node)
            .map(|edge| {
                Factor::relative(Node(edge.from), Node(edge.to), edge.relative, &edge.covariance).expect("a valid edge")
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
        smoother.advance().expect("the graph is anchored");
    }
    // The published covariances are those at the optimum itself.
    while !smoother.settle(1e-8).expect("the graph is anchored").converged {}
    smoother
}

fn folder() -> PathBuf {
    let shared = std::env::var_os("PDN_SHARED").map(PathBuf::from);
    let beside = || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../../shared"));
    shared.unwrap_or_else(beside).join("data/pose_graphs")
}

/// `EDGE_SE3:QUAT from to x y z qx qy qz qw` and the upper triangle of the information matrix, in our order.
fn parse_edges(text: &str) -> Vec<Edge> {
    text.lines()
        .filter_map(|line| line.strip_prefix("EDGE_SE3:QUAT"))
        .map(|line| {
            let numbers: Vec<f64> = line.split_whitespace().map(|word| word.parse().expect("a number")).collect();
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

/// The first `count` numbers after these words, each looked for after the one before.
fn numbers_after(text: &str, words: &[&str], count: usize) -> Vec<f64> {
    let mut rest = text;
    for word in words {
        rest = &rest[rest.find(word).expect("the expected file has this entry") + word.len()..];
    }
    rest.split(|letter: char| !(letter.is_ascii_digit() || "+-.eE".contains(letter)))
        .filter_map(|word| word.parse().ok())
        .take(count)
        .collect()
}
