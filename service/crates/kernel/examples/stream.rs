//! How long the smoother takes on a published pose graph, streamed keyframe by keyframe.
//!
//! `cargo run --release -p pdn-kernel --example stream FILE.g2o [relinearize_above]`; times are CPU times of one thread.

#[path = "../tests/support/g2o.rs"]
mod g2o;
mod measure;

use measure::{now_ms, summary};
use pdn_kernel::smoother::{Smoother, SmootherSettings};

fn main() {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().expect("usage: stream FILE.g2o [relinearize_above]");
    let default = SmootherSettings::default();
    let relinearize_above =
        arguments.next().and_then(|word| word.parse().ok()).unwrap_or(default.relinearize_above);
    let edges = g2o::parse_edges(&std::fs::read_to_string(&file).expect("the file can be read"));
    let mut smoother = Smoother::new(SmootherSettings { relinearize_above, ..default });
    let mut times = Vec::new();
    let (mut iterations, mut relinearized, mut halvings, mut unfinished) = (0, 0, 0, 0);
    for node in 0..g2o::keyframes(&edges) {
        g2o::add_keyframe(&mut smoother, node, &edges);
        let start = now_ms();
        let report = smoother.advance().expect("the graph is anchored");
        times.push(now_ms() - start);
        iterations += report.iterations;
        relinearized += report.relinearized;
        halvings += report.halvings;
        unfinished += usize::from(!report.converged);
    }
    println!("{file}, relinearize above {relinearize_above:e}");
    println!("  total {:.0} ms; advance: {}", times.iter().sum::<f64>(), summary(&mut times));
    println!(
        "  iterations {iterations}, relinearised {relinearized}, halvings {halvings}, hit the bound {unfinished}"
    );
    println!("  {:?}", smoother.elimination().statistics());
    let chi2 = smoother.chi2().expect("finite");
    let start = now_ms();
    let report = smoother.relinearize(1e-8).expect("the graph is anchored");
    println!(
        "  chi2 {chi2}; settled to 1e-8 in {:.1} ms: {}",
        now_ms() - start,
        smoother.chi2().expect("finite")
    );
    println!("  {report:?}");
}
