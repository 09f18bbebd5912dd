//! One survey, streamed and decided on: everything that is timed.

use nalgebra::Matrix6;
use pdn_planning::{Question, decide};
use serde::Serialize;

use crate::arrays::Arrays;
use crate::evaluation::{self, Evaluation, Trees};
use crate::kernel::{self, Pose, Size, Stream};
use crate::measure::{Summary, summary, timed};
use crate::survey::{Keyframe, Measured};
use crate::{Fallible, Run, candidates, input};

/// Times in ms of CPU of one thread, where nothing else is said.
#[derive(Serialize)]
pub struct Report {
    pub keyframes: usize,
    pub measurements: usize,
    pub links: usize,
    /// Following one keyframe as it comes; at some the whole graph is linearised anew. All of them, and the
    /// others.
    pub update: Summary,
    pub update_between: Summary,
    /// Greatest distance of the estimate from the batch optimum at the end, [m, rad]: as streamed, and
    /// converged.
    pub drift: [f64; 2],
    pub converged_drift: [f64; 2],
    /// Copying the smoother, as a snapshot does.
    pub copy: f64,
    pub streamed_tree: Size,
    /// The tree made at once, and the time that takes, ordering included.
    pub tree: Size,
    pub shared: f64,
    /// Marginals of all keyframes, on the tree made at once.
    pub marginals: f64,
    pub goals: &'static str,
    /// A candidate's virtual nodes and links with their information, mean.
    pub virtual_path: f64,
    /// One whole decision on a new snapshot with the smoother's tree: marginals, clusters, routes,
    /// evaluations, choice.
    pub decision: f64,
    pub decision_candidates: usize,
    pub evaluations: Vec<Evaluation>,
    /// Terminal covariance of each candidate, row by row, on the tree made at once and on the smoother's.
    pub terminals: [Vec<Vec<f64>>; 2],
}

pub fn run(run: &Run) -> Fallible<Report> {
    let keyframes = run.which.keyframes();
    let mut stream = Stream::default();
    let (mut first_estimates, mut updates, mut between) = (Vec::new(), Vec::new(), Vec::new());
    for (index, keyframe) in keyframes.iter().enumerate() {
        first_estimates.push(stream.add(index, keyframe)?);
        let (relinearized, ms) = timed(|| stream.follow());
        updates.push(ms);
        if !relinearized? {
            between.push(ms);
        }
    }
    let drift_of = |stream: &Stream, optimum: &[Pose]| greatest_distance(&stream.estimates(), optimum);
    let optimum = stream.batch_optimum()?;
    let drift = drift_of(&stream, &optimum);
    stream.relinearize()?;

    let streamed = stream.elimination();
    let (at_once, shared) = evaluation::shared_ms(streamed.system(), run.repeats)?;
    let (_, marginals) = timed(|| kernel::marginals(&at_once));
    let (_, copy) = timed(|| stream.copy());

    let snapshot = || candidates::snapshot(&keyframes, stream.linearizations(), streamed.clone());
    let planned = snapshot()?;
    let most = run.candidates.iter().copied().max().unwrap_or(1);
    let (goals, trips) = candidates::round_trips(&planned, most)?;
    let (paths, paths_ms) = timed(|| candidates::paths(&planned, &trips));
    let paths = paths?;
    let trees = Trees { at_once: &at_once, shared_ms: shared, streamed };
    let evaluations = evaluation::evaluations(&trees, &paths, &run.candidates, run.repeats)?;

    let fresh = snapshot()?;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build()?;
    let (decision, decision_ms) = timed(|| decide(&fresh, &Question::default(), &pool, &|| false));
    if let Some(file) = &run.write {
        let mut arrays = Arrays::default();
        input::put_system(&mut arrays, streamed.system());
        input::put_paths(&mut arrays, &paths);
        input::put_stream(&mut arrays, &keyframes, &first_estimates);
        input::put_poses(&mut arrays, stream.linearizations());
        arrays.write(file)?;
    }
    let measured = || keyframes.iter().flat_map(Keyframe::measured);
    let terminals = |elimination| evaluation::terminals(elimination, &paths).map(|found| rows(&found));
    Ok(Report {
        keyframes: keyframes.len(),
        measurements: measured().count(),
        links: measured().filter(|measured| matches!(measured, Measured::Camera { .. })).count(),
        update: summary(&updates),
        update_between: summary(&between),
        drift,
        converged_drift: drift_of(&stream, &optimum),
        copy,
        streamed_tree: kernel::size(streamed),
        tree: kernel::size(&at_once),
        shared,
        marginals,
        goals: goals.name(),
        virtual_path: paths_ms / paths.len() as f64,
        decision: decision_ms,
        decision_candidates: decision?.candidates.len(),
        terminals: [terminals(&at_once)?, terminals(streamed)?],
        evaluations,
    })
}

fn rows(covariances: &[Matrix6<f64>]) -> Vec<Vec<f64>> {
    covariances.iter().map(|covariance| covariance.transpose().as_slice().to_vec()).collect()
}

/// Greatest difference of two trajectories, [m, rad].
fn greatest_distance(one: &[Pose], other: &[Pose]) -> [f64; 2] {
    let mut greatest = [0.0_f64; 2];
    for (one, other) in one.iter().zip(other) {
        let step = pdn_kernel::se3::log(&(one.inverse() * other));
        greatest[0] = greatest[0].max(step.fixed_rows::<3>(0).norm());
        greatest[1] = greatest[1].max(step.fixed_rows::<3>(3).norm());
    }
    greatest
}
