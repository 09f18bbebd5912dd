//! Explore or revisit? The algorithm of the paper, from its steps [PDN12, III].

use crate::belief::{expect_all, expect_exploration};
use crate::bound::{Best, best};
use crate::candidate::candidates;
use crate::decision::{Decision, Evaluation, Question, Robot};
use crate::error::PlanningError;
use crate::reason::reason;
use crate::reward::{Scale, choose};
use crate::round_trip::{RoundTrip, along_points, along_route};
use crate::settings::{check_positive, check_share};
use crate::snapshot::Snapshot;
use crate::waypoint::{goals, waypoints};
use nalgebra::Vector3;

/// Decides what the vehicle should do next, with every number behind it.
///
/// The same snapshot and question give the same bits at any number of threads in `pool`. `stop` is asked
/// before each candidate; once it says so the rest is listed in `not_evaluated`, and the choice is the best
/// of what was evaluated. Without keyframes to revisit the decision is to explore. A question for the choice
/// alone has the best candidate and no other, and none where exploring is certain.
///
/// # Errors
/// [`PlanningError::OutOfRange`] for an alpha outside [0, 1] or an allowance that is not positive;
/// [`PlanningError::NoKeyframe`]; [`PlanningError::Kernel`] if the graph's information is not positive
/// definite.
pub fn decide(
    snapshot: &Snapshot,
    question: &Question,
    pool: &rayon::ThreadPool,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Decision, PlanningError> {
    let scale = scale(snapshot, question)?;
    let robot = robot(snapshot)?;
    let exploration = scale.exploration(expect_exploration(snapshot)?)?; // eqs. 5 to 8, k = 0

    let certain = question.choice_only && exploration.uncertainty == 0.0;
    let goals = if certain { Vec::new() } else { goals(snapshot)? }; // III.B
    let trips = goals.iter().zip(0..).map(|((_, route), index)| along_route(snapshot, route, index)); // III.C
    let trips = trips.collect::<Result<Vec<RoundTrip>, _>>()?;
    let (beliefs, judged) = if question.choice_only {
        let Best { beliefs, judged } = best(snapshot, &scale, &trips, pool, stop)?;
        (beliefs, judged)
    } else {
        let beliefs = expect_all(snapshot, &trips, pool, stop)?; // eqs. 1 to 4
        let judged = beliefs.iter().map(Option::is_some).collect();
        (beliefs, judged)
    };

    let revisits = goals.iter().map(|(waypoint, _)| Some(*waypoint)).zip(&trips).zip(&beliefs);
    let candidates = candidates(snapshot, &scale, &exploration, revisits)?; // eqs. 5 to 8, k > 0
    let unfinished = goals.iter().zip(&judged).filter(|(_, judged)| !**judged);
    let not_evaluated: Vec<u64> = unfinished.map(|((waypoint, _), _)| waypoint.keyframe).collect();

    let action = choose(&exploration, &candidates); // eq. 9
    let waypoints = if certain { &[] } else { waypoints(snapshot)? };
    let reason = reason(snapshot, &action, &exploration, &candidates, waypoints, &not_evaluated);
    Ok(Decision {
        robot,
        alpha: scale.alpha,
        allowable: scale.allowable,
        action,
        exploration,
        candidates,
        complete: not_evaluated.is_empty(),
        not_evaluated,
        target_m2: snapshot.target_m2,
        covered_m2: snapshot.covered_m2,
        reason,
    })
}

/// What paths that a person drew would bring, by the mission's alpha and allowance: world points in metres,
/// from the robot's place on; the way back follows the same points. `pool` and `stop` as in [`decide`].
///
/// # Errors
/// As [`decide`], and [`PlanningError::PathNotFinite`], [`PlanningError::PathEmpty`],
/// [`PlanningError::PathTooLong`] with the path's index.
pub fn evaluate_paths(
    snapshot: &Snapshot,
    paths: &[Vec<Vector3<f64>>],
    pool: &rayon::ThreadPool,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<Evaluation, PlanningError> {
    let scale = scale(snapshot, &Question::default())?;
    let exploration = scale.exploration(expect_exploration(snapshot)?)?;
    let trips = paths.iter().enumerate().map(|(index, points)| along_points(snapshot, points, index));
    let trips = trips.collect::<Result<Vec<RoundTrip>, _>>()?;
    let beliefs = expect_all(snapshot, &trips, pool, stop)?;
    let drawn = paths.iter().map(|_| None).zip(&trips).zip(&beliefs);
    let candidates = candidates(snapshot, &scale, &exploration, drawn)?;
    let unfinished = beliefs.iter().enumerate().filter(|(_, belief)| belief.is_none());
    Ok(Evaluation { exploration, candidates, not_evaluated: unfinished.map(|(index, _)| index).collect() })
}

/// What the mission or the question weighs by.
fn scale(snapshot: &Snapshot, question: &Question) -> Result<Scale, PlanningError> {
    let settings = &snapshot.settings;
    let alpha = question.alpha.unwrap_or(settings.alpha);
    let allowable = question.allowable.unwrap_or(settings.allowable);
    check_share("alpha", alpha)?;
    allowable.check()?;
    check_positive("target_m2", snapshot.target_m2)?;
    let Snapshot { target_m2, covered_m2, .. } = *snapshot;
    Ok(Scale { alpha, allowable, target_m2, covered_m2, swath_m: settings.swath_m })
}

fn robot(snapshot: &Snapshot) -> Result<Robot, PlanningError> {
    let newest = snapshot.keyframe(snapshot.robot()?);
    Ok(Robot { keyframe: newest.id, pose: newest.world_from_body, covariance: snapshot.robot_covariance()? })
}
