//! How long it takes to evaluate candidates.

use std::collections::BTreeSet;
use std::sync::atomic::{AtomicUsize, Ordering};

use nalgebra::Matrix6;
use pdn_planning::belief::group_size;
use serde::Serialize;

use crate::kernel::{self, BlockSystem, Elimination, KernelError, VirtualPath, Wanted, Workspace};
use crate::measure::{Summary, median, summary, timed, wall_ms};

/// Times of K candidates, CPU time of one thread in ms but for `wall`; those of a candidate are medians over
/// repeats.
#[derive(Serialize)]
pub struct Evaluation {
    pub candidates: usize,
    /// Means over the candidates: virtual nodes, links, and poses that a candidate names (virtual nodes,
    /// keyframes linked to).
    pub virtual_nodes: f64,
    pub links: f64,
    pub poses: f64,
    /// A candidate's terminal covariance on the tree made at once and on the smoother's.
    pub candidate: Summary,
    pub streamed_candidate: Summary,
    /// All that a decision asks of a candidate, on the tree made at once.
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

/// Times of `counts` of these candidates, evenly spread; every one is measured `repeats` times.
pub fn evaluations(
    trees: &Trees,
    paths: &[VirtualPath],
    counts: &[usize],
    repeats: usize,
) -> Result<Vec<Evaluation>, KernelError> {
    counts.iter().map(|&count| evaluation(trees, &spread(paths, count), repeats)).collect()
}

fn evaluation(trees: &Trees, paths: &[&VirtualPath], repeats: usize) -> Result<Evaluation, KernelError> {
    let candidate = summary(&candidate_ms(trees.at_once, paths, Wanted::Terminal, repeats)?);
    let candidate_variants = summary(&candidate_ms(trees.at_once, paths, Wanted::Variants, repeats)?);
    let streamed_candidate = summary(&candidate_ms(trees.streamed, paths, Wanted::Terminal, repeats)?);
    let mut walls = [Vec::new(), Vec::new()];
    let mut workspaces = [Workspace::default(), Workspace::default()];
    for _ in 0..repeats {
        for threads in [1, 2] {
            walls[threads - 1].push(wall_ms_of(trees.at_once, paths, &mut workspaces[..threads])?);
        }
    }
    let mean = |of: &dyn Fn(&VirtualPath) -> usize| {
        paths.iter().map(|path| of(path)).sum::<usize>() as f64 / paths.len() as f64
    };
    Ok(Evaluation {
        candidates: paths.len(),
        virtual_nodes: mean(&virtual_nodes),
        links: mean(&|path| path.node_links().count()),
        poses: mean(&|path| virtual_nodes(path) + linked(path)),
        candidate,
        streamed_candidate,
        candidate_variants,
        scratch: trees.shared_ms + candidate.sum,
        scratch_variants: trees.shared_ms + candidate_variants.sum,
        streamed: streamed_candidate.sum,
        wall: walls.map(|walls| median(&walls)),
    })
}

/// `count` of these, evenly spread, in their order.
fn spread(paths: &[VirtualPath], count: usize) -> Vec<&VirtualPath> {
    let count = count.min(paths.len());
    (0..count).map(|index| &paths[index * paths.len() / count]).collect()
}

fn virtual_nodes(path: &VirtualPath) -> usize {
    path.nodes() as usize
}

fn linked(path: &VirtualPath) -> usize {
    path.links().map(|(_, link)| link.keyframe).collect::<BTreeSet<_>>().len()
}

/// Terminal covariance of each candidate.
pub fn terminals(elimination: &Elimination, paths: &[VirtualPath]) -> Result<Vec<Matrix6<f64>>, KernelError> {
    let all: Vec<&VirtualPath> = paths.iter().collect();
    let found = kernel::evaluate(elimination, &all, Wanted::Terminal, &mut Workspace::default())?;
    Ok(found.into_iter().map(|(terminal, _)| terminal).collect())
}

/// The time of each candidate on one thread: the median over repeats. Memory is kept from one to the next, as
/// planning does.
fn candidate_ms(
    elimination: &Elimination,
    paths: &[&VirtualPath],
    wanted: Wanted,
    repeats: usize,
) -> Result<Vec<f64>, KernelError> {
    let mut workspace = Workspace::default();
    let mut by_path = vec![Vec::new(); paths.len()];
    for _ in 0..repeats {
        let found = kernel::evaluate(elimination, paths, wanted, &mut workspace)?;
        for (times, (_, ms)) in by_path.iter_mut().zip(found) {
            times.push(ms);
        }
    }
    Ok(by_path.iter().map(|times| median(times)).collect())
}

/// Time that passes for the terminal covariances in planning's groups, the workspace of each thread being
/// there.
fn wall_ms_of(
    elimination: &Elimination,
    paths: &[&VirtualPath],
    workspaces: &mut [Workspace],
) -> Result<f64, KernelError> {
    let groups: Vec<_> = paths.chunks(group_size(paths.len(), workspaces.len())).collect();
    let next = AtomicUsize::new(0);
    let work = |workspace: &mut Workspace| -> Result<(), KernelError> {
        while let Some(group) = groups.get(next.fetch_add(1, Ordering::Relaxed)) {
            kernel::evaluate(elimination, group, Wanted::Terminal, workspace)?;
        }
        Ok(())
    };
    let start = wall_ms();
    std::thread::scope(|scope| {
        let running: Vec<_> =
            workspaces.iter_mut().map(|workspace| scope.spawn(|| work(workspace))).collect();
        running.into_iter().try_for_each(|thread| thread.join().expect("an evaluation does not panic"))
    })?;
    Ok(wall_ms() - start)
}
