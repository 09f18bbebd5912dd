//! The reason of a decision, in one sentence for a person.

use crate::decision::{Action, Candidate, Exploration};
use crate::revisit::Waypoint;
use crate::snapshot::Snapshot;

/// Why the action was chosen, with the numbers that made the difference. `waypoints` are all of the
/// snapshot's, `not_evaluated` those that time was too short for.
pub fn reason(
    snapshot: &Snapshot,
    action: &Action,
    exploration: &Exploration,
    candidates: &[Candidate],
    waypoints: &[Waypoint],
    not_evaluated: &[u64],
) -> String {
    let sentence = match action {
        Action::Explore => why_explore(snapshot, exploration, candidates, waypoints),
        Action::Revisit { candidate, keyframe } => {
            let chosen = candidates.iter().find(|revisit| revisit.candidate == *candidate);
            why_revisit(*keyframe, exploration, chosen)
        }
    };
    match not_evaluated.len() {
        0 => format!("{sentence}."),
        1 => format!("{sentence}; 1 candidate was not evaluated in time."),
        count => format!("{sentence}; {count} candidates were not evaluated in time."),
    }
}

fn why_explore(
    snapshot: &Snapshot,
    exploration: &Exploration,
    candidates: &[Candidate],
    waypoints: &[Waypoint],
) -> String {
    let ratio = exploration.uncertainty_ratio;
    if ratio < 1.0 {
        return format!("Explore: the next step's uncertainty ratio {ratio:.3} is below the allowance");
    }
    let exceeded =
        format!("Explore although the next step's uncertainty ratio {ratio:.3} exceeds the allowance");
    let best = candidates.iter().min_by(|one, other| one.penalty.total_cmp(&other.penalty));
    let salient = |saliency: f64| saliency >= snapshot.settings.waypoint_local_saliency;
    match best {
        None if !snapshot.keyframes.iter().any(|keyframe| salient(keyframe.saliency.local)) => {
            format!("{exceeded}: no keyframe is salient enough to revisit")
        }
        None if waypoints.is_empty() => format!("{exceeded}: no salient keyframes lie close enough together"),
        None if waypoints.iter().all(|waypoint| waypoint.route.is_none()) => {
            format!("{exceeded}: no waypoint can be reached over the keyframes of the graph")
        }
        None if waypoints.iter().all(|waypoint| !waypoint.candidate) => {
            let least_m = snapshot.settings.min_revisit_m;
            format!("{exceeded}: no waypoint that can be reached is at least {least_m} m away")
        }
        None => format!("{exceeded}: no revisit was evaluated"),
        Some(best) if best.uncertainty >= exploration.uncertainty => format!(
            "{exceeded}: the best revisit, candidate {} ({:.1} m away), promises {:.3}, which is no less",
            best.candidate, best.one_way_m, best.uncertainty,
        ),
        Some(best) => format!(
            "{exceeded}: the best revisit, candidate {} ({:.1} m away), promises {:.3} but is worth it only \
             for alpha above {:.3}",
            best.candidate,
            best.one_way_m,
            best.uncertainty,
            best.break_even_alpha.unwrap_or(1.0),
        ),
    }
}

fn why_revisit(keyframe: u64, exploration: &Exploration, chosen: Option<&Candidate>) -> String {
    let Some(chosen) = chosen else { return format!("Revisit keyframe {keyframe}") };
    format!(
        "Revisit keyframe {keyframe} (candidate {}, {:.1} m away): expected uncertainty {:.3} against {:.3} \
         when exploring; worth it for alpha above {:.3}",
        chosen.candidate,
        chosen.one_way_m,
        chosen.uncertainty,
        exploration.uncertainty,
        chosen.break_even_alpha.unwrap_or(0.0),
    )
}
