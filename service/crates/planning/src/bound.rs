//! The best revisit without all that is told of each: only Sigma_nn is found of the others, which is a
//! quarter of the work, and none of those that cannot be the best.
//!
//! C^k = alpha U^k + (1 - alpha) A^k \[PDN12, eq. 7\] with U^k > 0, and A^k is known from the path's length
//! alone. So C^k is no less than (1 - alpha) A^k, in floating point too, since rounding is monotone. The
//! nearest trips are taken first, and of the others those whose bound is not above the least penalty found,
//! all at once, since trips that begin alike cost less together: the choice is that of evaluating all, bit
//! for bit. The bound tells much where the area weighs much: of 50 trips 16 are evaluated at alpha = 0,
//! nearly all at 0.1, and all at alpha = 1.

use crate::belief::{Belief, expect_all, terminals};
use crate::error::PlanningError;
use crate::expected_places::ExpectedPlaces;
use crate::reward::Scale;
use crate::round_trip::RoundTrip;
use crate::snapshot::Snapshot;

/// Trips that are evaluated first. It does not depend on the number of threads, and so neither does what is
/// evaluated.
const NEAREST: usize = 16;

/// What was found of trips among which one was sought.
#[derive(Clone, Debug, PartialEq)]
pub struct Best {
    /// In the order of the trips: everything of the best one, nothing of the others.
    pub beliefs: Vec<Option<Belief>>,
    /// In the order of the trips: whether it is known that another one is better, or that it is the best.
    pub judged: Vec<bool>,
}

/// The trip of the least penalty, ties to the first. `stop` as in [`expect_all`]; once it has said so the
/// best is that of those evaluated.
///
/// # Errors
/// As [`expect_all`], and the kernel's if an expected covariance is not positive definite.
pub fn best(
    snapshot: &Snapshot,
    scale: &Scale,
    trips: &[RoundTrip],
    pool: &rayon::ThreadPool,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Best, PlanningError> {
    let area = |index: usize| scale.detour(trips[index].one_way_m).area;
    let least_penalty = |index: usize| scale.penalty(0.0, area(index));
    let mut order: Vec<usize> = (0..trips.len()).collect();
    order.sort_by(|&one, &other| least_penalty(one).total_cmp(&least_penalty(other)).then(one.cmp(&other)));

    let expected = ExpectedPlaces::new(snapshot, &trips.iter().collect::<Vec<_>>())?;
    let (mut found, mut judged): (Option<(f64, usize)>, _) = (None, vec![false; trips.len()]);
    let (nearest, others) = order.split_at(order.len().min(NEAREST));
    for batch in [nearest, others] {
        let can_win = |index: usize| found.is_none_or(|(least, _)| least_penalty(index) <= least);
        let (open, beaten): (Vec<usize>, Vec<usize>) = batch.iter().partition(|&&index| can_win(index));
        beaten.into_iter().for_each(|index| judged[index] = true);
        let asked: Vec<(usize, &RoundTrip)> = open.iter().map(|&index| (index, &trips[index])).collect();
        for (index, terminal) in open.into_iter().zip(terminals(snapshot, &expected, &asked, pool, stop)?) {
            let Some(terminal) = terminal else { continue };
            let penalty = scale.penalty(scale.uncertainty_ratio(&terminal)?, area(index));
            judged[index] = true;
            if found.is_none_or(|(least, first)| penalty < least || (penalty == least && index < first)) {
                found = Some((penalty, index));
            }
        }
    }
    let mut beliefs = vec![None; trips.len()];
    if let Some((_, index)) = found {
        // It has been evaluated in time; what is told of it beside is not stopped.
        let told = expect_all(snapshot, std::slice::from_ref(&trips[index]), pool, &|| false)?;
        beliefs[index] = told.into_iter().next().flatten();
    }
    Ok(Best { beliefs, judged })
}
