//! Published pose graphs, streamed keyframe by keyframe, against optima and covariances computed elsewhere.

#[path = "support/g2o.rs"]
mod g2o;
mod support;

use std::io::Write;
use std::path::PathBuf;

use nalgebra::Matrix6;
use pdn_kernel::Node;
use pdn_kernel::smoother::{Smoother, SmootherSettings};
use support::scaled_difference;

#[test]
fn tiny_grid() {
    reaches_the_published_optimum("tinyGrid3D", SmootherSettings::default());
}

#[test]
fn small_grid() {
    reaches_the_published_optimum("smallGrid3D", SmootherSettings::default());
}

#[test]
fn parking_garage() {
    reaches_the_published_optimum("parking-garage", SmootherSettings::default());
}

#[test]
fn sphere() {
    // Its measurements are so coarse (0.3 m, 0.1 rad) that every keyframe moves the whole sphere by more than the default.
    reaches_the_published_optimum(
        "sphere2500",
        SmootherSettings { relinearize_above: 0.1, ..SmootherSettings::default() },
    );
}

fn reaches_the_published_optimum(name: &str, settings: SmootherSettings) {
    let folder = folder();
    let (graph, expected) =
        (folder.join(format!("{name}.g2o")), folder.join(format!("expected/{name}.json")));
    let (Ok(graph), Ok(expected)) = (std::fs::read_to_string(&graph), std::fs::read_to_string(&expected))
    else {
        // Past the test's capture: a test that has tried nothing must not pass in silence.
        let _ = writeln!(
            std::io::stderr(),
            "skipped {name}: needs {} and {}; PDN_SHARED names the folder above data/",
            graph.display(),
            expected.display()
        );
        return;
    };
    let edges = g2o::parse_edges(&graph);
    let smoother = stream(&edges, settings);

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

/// Adds the keyframes in the order of their ids and lets the smoother advance after each.
fn stream(edges: &[g2o::Edge], settings: SmootherSettings) -> Smoother {
    let mut smoother = Smoother::new(settings);
    for node in 0..g2o::keyframes(edges) {
        g2o::add_keyframe(&mut smoother, node, edges);
        smoother.advance().expect("the graph is anchored");
    }
    // The published covariances are those at the optimum itself.
    while !smoother.relinearize(1e-8).expect("the graph is anchored").converged {}
    smoother
}

fn folder() -> PathBuf {
    let shared = std::env::var_os("PDN_SHARED").map(PathBuf::from);
    let beside = || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../../shared"));
    shared.unwrap_or_else(beside).join("data/pose_graphs")
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
