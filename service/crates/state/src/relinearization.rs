//! When the whole graph is linearised anew at the estimate, and how near.

use pdn_kernel::KernelError;
use pdn_kernel::smoother::Smoother;

/// The graph is relinearised as a whole with each keyframe whose number is a multiple of the second number
/// here, in graphs of up to the first number of keyframes, so that a question never has far to go. A loop
/// closure moves all of a graph, so the larger it is the dearer that is, and the rarer.
const RELINEARIZE_EVERY: [(usize, usize); 3] = [(1024, 16), (4096, 64), (usize::MAX, 256)];

/// Linearisation points lie this close to the estimate, m and rad, wherever a question looks: in graphs of at
/// most `SMALL_GRAPH` keyframes, and in larger ones, which would be linearised anew as a whole for every loop
/// closure.
const TOLERANCE: f64 = 1e-7;
const TOLERANCE_OF_LARGE: f64 = 1e-5;
const SMALL_GRAPH: usize = 4096;

/// Gauss-Newton steps of one relinearisation at most. A graph that needs more is reported as not converged.
const MAX_STEPS: usize = 20;

/// Whether a graph of so many keyframes is relinearised as a whole with the newest.
pub(crate) fn is_due(keyframes: usize) -> bool {
    let every = RELINEARIZE_EVERY.iter().find(|(most, _)| keyframes <= *most);
    every.is_some_and(|(_, every)| keyframes % every == 0)
}

/// Gauss-Newton steps until every linearisation point is at the estimate, as close as the size of the graph
/// asks; false if [`MAX_STEPS`] are not enough.
///
/// # Errors
/// As [`Smoother::relinearize`].
pub(crate) fn relinearize(smoother: &mut Smoother) -> Result<bool, KernelError> {
    let is_small = smoother.len() <= SMALL_GRAPH;
    let tolerance = if is_small { TOLERANCE } else { TOLERANCE_OF_LARGE };
    for _ in 0..MAX_STEPS {
        if smoother.relinearize(tolerance)?.converged {
            return Ok(true);
        }
    }
    Ok(false)
}
