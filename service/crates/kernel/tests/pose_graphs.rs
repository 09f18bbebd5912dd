//! Published pose graphs, streamed keyframe by keyframe, against optima and covariances computed elsewhere.

#[path = "support/g2o.rs"]
mod g2o;
mod support;

use std::path::PathBuf;

use libtest_mimic::{Arguments, Completion, Trial};
use nalgebra::Matrix6;
use pdn_kernel::Node;
use pdn_kernel::smoother::{Smoother, SmootherSettings};
use support::scaled_difference;

/// The harness of the standard library cannot skip while it runs; this one lists what misses its data as
/// ignored.
fn main() {
    let default = SmootherSettings::default();
    // Its measurements are so coarse (0.3 m, 0.1 rad) that every keyframe moves the whole sphere by more than
    // the default.
    let coarse = SmootherSettings { relinearize_above: 0.1, ..default };
    let others = ["tinyGrid3D", "smallGrid3D", "parking-garage"].map(|name| (name, default));
    let graphs = others.into_iter().chain([("sphere2500", coarse)]);
    let trials = graphs.map(|(name, settings)| {
        Trial::ignorable_test(name, move || Ok(reaches_the_published_optimum(name, settings)))
    });
    libtest_mimic::run(&Arguments::from_args(), trials.collect()).exit();
}

fn reaches_the_published_optimum(name: &str, settings: SmootherSettings) -> Completion {
    let folder = folder();
    let (graph, expected) =
        (folder.join(format!("{name}.g2o")), folder.join(format!("expected/{name}.json")));
    let (Ok(graph), Ok(expected)) = (std::fs::read_to_string(&graph), std::fs::read_to_string(&expected))
    else {
        return Completion::ignored_with(format!(
            "needs {} and {}; PDN_SHARED names the folder above data/",
            graph.display(),
            expected.display()
        ));
    };
    let edges = g2o::parse_edges(&graph);
    let smoother = stream(&edges, settings);

    let chi2 = smoother.chi2().expect("the estimate is finite");
    let prior = smoother.factors().next().expect("the prior is the first factor");
    let own = prior.chi2(&smoother.estimate(Node(0)), None).expect("the estimate is finite");
    let optimum = numbers_after(&expected, &["\"optimal\"", "\"se3log\"", "\"chi2\""], 1)[0];
    let relative = (chi2 - own - optimum).abs() / optimum;
    assert!(relative < 1e-6, "{name}: {relative:e}");

    let published = numbers_after(&expected, &["\"optimal\"", "\"se3log\"", "\"cov_last_prior_1e-3\""], 36);
    // Theirs has rotation first.
    let swap = |axis: usize| (axis + 3) % 6;
    let wanted = Matrix6::from_fn(|row, column| published[6 * swap(row) + swap(column)]);
    let last = Node(smoother.len() as u32 - 1);
    let found = smoother.marginal(last).expect("the graph is anchored");
    let difference = scaled_difference(&found, &wanted);
    assert!(difference < 1e-6, "{name}: {difference:e}");
    Completion::Completed
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
