//! How long it takes to evaluate candidates.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::Matrix6;
use serde::Serialize;

use crate::kernel::{self, BlockSystem, Elimination, KernelError, VirtualPath, Wanted, Workspace};
use crate::measure::{Summary, median, summary, timed, wall_ms};

/// Times of K candidates, CPU time of one thread in ms but for `wall`; those of a candidate are medians over repeats.
#[derive(Serialize)]
pub struct Evaluation {
    pub candidates: usize,
    /// Means over the candidates: virtual nodes, links, and poses that a candidate names (virtual nodes, keyframes linked to).
    pub virtual_nodes: f64,
    pub links: f64,
    pub poses: f64,
    /// A candidate's terminal covariance on the tree made at once and on the smoother's.
    pub candidate: Summary,
    pub streamed_candidate: Summary,
    /// All that a decision asks of a candidate, on the tree made at once; measured once.
    pub candidate_variants: Summary,
    /// Ordering and eliminating Lambda_0 from scratch, then the terminal covariance of each candidate.
    pub scratch: f64,
    /// The same with all that a decision asks.
    pub scratch_variants: f64,
    /// The terminal covariances on the tree that the smoother keeps: nothing is shared.
    pub streamed: f64,
    /// Time that passes for the terminal covariances on the tree made at once: one thread, two threads.
    pub wall: [f64; 2],
}

/// A tree made at once, at this cost, and the smoother's.
pub struct Trees<'a> {
    pub at_once: &'a Elimination,
    pub shared_ms: f64,
    pub streamed: &'a Elimination,
}

/// Ordering and eliminating Lambda_0 from scratch: median CPU time of `repeats`, ms.
pub fn shared_ms(system: &BlockSystem, repeats: usize) -> Result<(Elimination, f64), KernelError> {
    let mut times = Vec::new();
    loop {
        let fresh = system.clone();
        let (elimination, ms) = timed(|| kernel::eliminate(fresh));
        let elimination = elimination?;
        times.push(ms);
        if times.len() >= repeats {
            return Ok((elimination, median(&times)));
        }
    }
}

/// Times of the first so-manyth of these candidates, for each of the counts; every one is measured `repeats` times.
pub fn evaluations(
    trees: &Trees,
    paths: &[VirtualPath],
    counts: &[usize],
    repeats: usize,
) -> Result<Vec<Evaluation>, KernelError> {
    let terminal = candidate_ms(trees.at_once, paths, Wanted::Terminal, repeats)?;
    let variants = candidate_ms(trees.at_once, paths, Wanted::Variants, 1)?;
    let streamed = candidate_ms(trees.streamed, paths, Wanted::Terminal, repeats)?;
    let of_count = |&count: &usize| {
        let places = spread(paths.len(), count);
        let some: Vec<&VirtualPath> = places.iter().map(|&place| &paths[place]).collect();
        let times = |of: &[f64]| summary(&places.iter().map(|&place| of[place]).collect::<Vec<f64>>());
        let mean = |of: &dyn Fn(&VirtualPath) -> usize| {
            some.iter().map(|path| of(path)).sum::<usize>() as f64 / some.len() as f64
        };
        let mut walls = [Vec::new(), Vec::new()];
        for _ in 0..repeats {
            for threads in [1, 2] {
                walls[threads - 1].push(wall_of(trees.at_once, &some, threads)?);
            }
        }
        let [candidate, candidate_variants, streamed_candidate] =
            [times(&terminal), times(&variants), times(&streamed)];
        Ok(Evaluation {
            candidates: some.len(),
            virtual_nodes: mean(&|path| path.unary.len()),
            links: mean(&|path| path.links.len()),
            poses: mean(&|path| path.unary.len() + linked(path)),
            candidate,
            streamed_candidate,
            candidate_variants,
            scratch: trees.shared_ms + candidate.sum,
            scratch_variants: trees.shared_ms + candidate_variants.sum,
            streamed: streamed_candidate.sum,
            wall: walls.map(|walls| median(&walls)),
        })
    };
    counts.iter().map(of_count).collect()
}

/// Places of `count` of `all`, evenly spread.
fn spread(all: usize, count: usize) -> Vec<usize> {
    let count = count.min(all);
    (0..count).map(|index| index * all / count).collect()
}

fn linked(path: &VirtualPath) -> usize {
    path.links.iter().map(|link| link.keyframe).collect::<BTreeSet<_>>().len()
}

/// Terminal covariance of each candidate.
pub fn terminals(elimination: &Elimination, paths: &[VirtualPath]) -> Result<Vec<Matrix6<f64>>, KernelError> {
    let mut workspace = Workspace::default();
    paths.iter().map(|path| kernel::evaluate(elimination, path, Wanted::Terminal, &mut workspace)).collect()
}

/// The time of each candidate: the median over repeats, each of which begins with a new workspace.
fn candidate_ms(
    elimination: &Elimination,
    paths: &[VirtualPath],
    wanted: Wanted,
    repeats: usize,
) -> Result<Vec<f64>, KernelError> {
    let mut by_path = vec![Vec::new(); paths.len()];
    for _ in 0..repeats {
        let mut workspace = Workspace::default();
        for (path, times) in paths.iter().zip(&mut by_path) {
            let (result, ms) = timed(|| kernel::evaluate(elimination, path, wanted, &mut workspace));
            result?;
            times.push(ms);
        }
    }
    Ok(by_path.iter().map(|times| median(times)).collect())
}

fn wall_of(elimination: &Elimination, paths: &[&VirtualPath], threads: usize) -> Result<f64, KernelError> {
    let next = AtomicUsize::new(0);
    let work = || -> Result<(), KernelError> {
        let mut workspace = Workspace::default();
        while let Some(path) = paths.get(next.fetch_add(1, Ordering::Relaxed)) {
            kernel::evaluate(elimination, path, Wanted::Terminal, &mut workspace)?;
        }
        Ok(())
    };
    let start = wall_ms();
    std::thread::scope(|scope| {
        let running: Vec<_> = (0..threads).map(|_| scope.spawn(work)).collect();
        running.into_iter().try_for_each(|thread| thread.join().expect("an evaluation does not panic"))
    })?;
    Ok(wall_ms() - start)
}
