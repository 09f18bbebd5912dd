//! Decisions as a whole: the same bits at any number of threads, honest when stopped, with a reason.

use crate::mission::{Mission, settings};
use pdn_planning::decide::{decide, evaluate_paths};
use pdn_planning::{
    Action, Allowable, Candidate, Decision, PlanningError, Question, Saliency, Snapshot, waypoints,
};
use rayon::ThreadPool;
use std::sync::atomic::{AtomicUsize, Ordering};

#[test]
fn any_number_of_threads_gives_the_same_bits_on_a_survey_as_large_as_the_paper_s() {
    let decide_anew = |threads: usize| {
        let snapshot = hull().snapshot;
        let first = ask(&snapshot, &Question::default(), threads);
        assert_eq!(ask(&snapshot, &Question::default(), threads), first);
        first
    };
    let decision = decide_anew(1);
    assert_eq!(decision.candidates.len(), 4);
    assert!(decision.complete && decision.not_evaluated.is_empty());
    for threads in [2, 4] {
        assert_eq!(decide_anew(threads), decision);
    }
}

#[test]
fn a_decision_is_the_equations_over_its_own_numbers() {
    let snapshot = Mission::survey(4, 30, 3).snapshot;
    let question = Question { alpha: Some(0.4), allowable: Some(tight()), ..Question::default() };
    let decision = ask(&snapshot, &question, 1);
    let penalty = |uncertainty: f64, area: f64| 0.4 * uncertainty + 0.6 * area;
    let ratio = |covariance: &nalgebra::Matrix6<f64>| {
        (covariance.determinant() / (2.0 * tight().log_determinant() / 2.0).exp()).powf(1.0 / 6.0)
    };
    let exploration = &decision.exploration;
    assert!((exploration.uncertainty_ratio / ratio(&exploration.covariance) - 1.0).abs() < 1e-6);
    assert!(exploration.uncertainty_ratio > 1.0 && exploration.uncertainty == exploration.uncertainty_ratio);
    assert!((exploration.area - 900.0 / 1200.0).abs() < 1e-15);
    assert!((exploration.penalty - penalty(exploration.uncertainty, exploration.area)).abs() < 1e-15);
    assert!(decision.candidates.len() >= 2);
    for (candidate, number) in decision.candidates.iter().zip(1..) {
        assert_eq!(candidate.candidate, number);
        assert_eq!(candidate.reward, -candidate.penalty);
        assert!((candidate.uncertainty / ratio(&candidate.covariance) - 1.0).abs() < 1e-6);
        assert!((candidate.redundant_m2 - 3.2 * candidate.one_way_m).abs() < 1e-12);
        assert!((candidate.area - (900.0 + candidate.redundant_m2) / 1200.0).abs() < 1e-14);
        assert!((candidate.penalty - penalty(candidate.uncertainty, candidate.area)).abs() < 1e-15);
        assert_eq!(candidate.path[0], decision.robot.keyframe);
        assert_eq!(candidate.path.last().copied(), candidate.keyframe);
        assert_eq!(candidate.nodes as usize, candidate.poses.len());
        assert_eq!(candidate.poses.last(), Some(&decision.robot.pose));
    }
    assert!(decision.candidates.is_sorted_by_key(|candidate| candidate.keyframe));
    let least =
        decision.candidates.iter().map(|candidate| candidate.penalty).fold(exploration.penalty, f64::min);
    match decision.action {
        Action::Explore => assert_eq!(least, exploration.penalty),
        Action::Revisit { candidate, keyframe } => {
            let chosen = &decision.candidates[candidate as usize - 1];
            assert_eq!((chosen.penalty, chosen.keyframe), (least, Some(keyframe)));
        }
    }
}

#[test]
fn a_what_if_changes_what_it_names_and_an_impossible_one_is_refused() {
    let snapshot = Mission::survey(4, 30, 3).snapshot;
    let tightened = Question { alpha: None, allowable: Some(tight()), ..Question::default() };
    let [plain, tightened] = [Question::default(), tightened].map(|question| ask(&snapshot, &question, 1));
    assert_eq!(plain.allowable, settings().allowable);
    let factor = ((settings().allowable.log_determinant() - tight().log_determinant()) / 6.0).exp();
    for (one, other) in plain.candidates.iter().zip(&tightened.candidates) {
        assert_eq!(one.covariance, other.covariance);
        assert!((one.uncertainty * factor / other.uncertainty - 1.0).abs() < 1e-12);
    }
    assert!(matches!(tightened.action, Action::Revisit { .. }), "{}", tightened.reason);
    assert!(tightened.reason.starts_with("Revisit keyframe ") && tightened.reason.contains("alpha above"));
    let careless = Question { alpha: Some(0.0), allowable: Some(tight()), ..Question::default() };
    let decision = ask(&snapshot, &careless, 1);
    assert_eq!(decision.action, Action::Explore);
    assert!(decision.reason.contains("worth it only for alpha above"), "{}", decision.reason);

    let pool = pool(1);
    let refused = |question: Question| decide(&snapshot, &question, &pool, &|| false).unwrap_err();
    for alpha in [-0.1, 1.1, f64::NAN] {
        let error = refused(Question { alpha: Some(alpha), allowable: None, ..Question::default() });
        assert!(matches!(error, PlanningError::OutOfRange { name: "alpha", .. }));
    }
    let nothing = Allowable { depth_m: 0.0, ..tight() };
    let error = refused(Question { alpha: None, allowable: Some(nothing), ..Question::default() });
    assert!(matches!(error, PlanningError::OutOfRange { .. }), "{error}");
}

#[test]
fn the_choice_alone_is_the_same_choice() {
    let snapshot = Mission::survey(4, 30, 3).snapshot;
    let wide = Allowable { x_m: 5.0, y_m: 5.0, ..tight() };
    for (allowable, certain) in [(tight(), false), (wide, true)] {
        let whole = Question { allowable: Some(allowable), ..Question::default() };
        let [whole, alone] =
            [false, true].map(|choice_only| ask(&snapshot, &Question { choice_only, ..whole }, 1));
        assert!(!whole.candidates.is_empty());
        assert_eq!((alone.action, &alone.reason), (whole.action, &whole.reason));
        assert_eq!(alone.exploration, whole.exploration);
        assert!(alone.complete);
        assert_eq!(alone.candidates, if certain { Vec::new() } else { vec![best(&whole)] });
    }
}

/// The candidate of the least penalty, ties to the lower number.
fn best(decision: &Decision) -> Candidate {
    let by_penalty = |one: &&Candidate, other: &&Candidate| one.penalty.total_cmp(&other.penalty);
    decision.candidates.iter().min_by(by_penalty).expect("there are candidates").clone()
}

/// Branch and bound leaves out what cannot be chosen, and nothing else: the choice and every number of the
/// best candidate are those of evaluating all, bit for bit, for whatever is weighed and at any number of
/// threads.
#[test]
fn the_choice_alone_is_that_of_evaluating_all_whatever_is_weighed() {
    let (mut explored, mut revisited) = (0, 0);
    // The long one has 50 candidates, more than are evaluated at once: there the bound leaves some out.
    let long = (3, 400, 3, [0, 1, 5].as_slice(), 1);
    let all: Vec<i32> = (0..=10).collect();
    let short = [(4, 30, 3), (5, 24, 4), (6, 40, 2), (8, 30, 3)];
    let short = short.map(|(lines, along, seed)| (lines, along, seed, all.as_slice(), 3));
    for (lines, along, seed, weights, allowances) in short.into_iter().chain([long]) {
        let snapshot = Mission::survey(lines, along, seed).snapshot;
        for (step, sigma) in [1.0, 0.7, 1.4].into_iter().take(allowances).enumerate() {
            let allowable = Allowable { x_m: sigma * tight().x_m, y_m: sigma * tight().y_m, ..tight() };
            for &weight in weights {
                let alpha = Some(f64::from(weight) / 10.0);
                let whole = Question { alpha, allowable: Some(allowable), choice_only: false };
                let threads = 1 + (step + weight as usize) % 3;
                let alone = ask(&snapshot, &Question { choice_only: true, ..whole }, threads);
                let whole = ask(&snapshot, &whole, 1);
                assert_eq!((alone.action, &alone.exploration), (whole.action, &whole.exploration));
                assert!(alone.complete);
                let certain = whole.exploration.uncertainty == 0.0;
                if !certain && !whole.candidates.is_empty() {
                    assert_eq!(alone.candidates, [best(&whole)]);
                }
                match whole.action {
                    Action::Explore => explored += 1,
                    Action::Revisit { .. } => revisited += 1,
                }
            }
        }
    }
    assert!(explored > 10 && revisited > 10, "{explored} {revisited}");
}

#[test]
fn a_stopped_decision_says_what_it_left_out_and_chooses_among_the_rest() {
    let snapshot = Mission::survey(4, 30, 3).snapshot;
    let question = Question { alpha: None, allowable: Some(tight()), ..Question::default() };
    let whole = ask(&snapshot, &question, 1);
    let goals = whole.candidates.len();
    for allowed in 0..goals {
        let asked = AtomicUsize::new(0);
        let stop = || asked.fetch_add(1, Ordering::Relaxed) >= allowed;
        let part = decide(&snapshot, &question, &pool(1), &stop).unwrap();
        assert_eq!(part.candidates.len(), allowed);
        assert_eq!(part.not_evaluated.len(), goals - allowed);
        assert!(!part.complete && part.reason.contains("not evaluated in time"), "{}", part.reason);
        for candidate in &part.candidates {
            assert_eq!(*candidate, whole.candidates[candidate.candidate as usize - 1]);
            assert!(!part.not_evaluated.contains(&candidate.keyframe.unwrap()));
        }
        let least = part.candidates.iter().map(|one| one.penalty).fold(part.exploration.penalty, f64::min);
        match part.action {
            Action::Explore => assert_eq!(part.exploration.penalty, least),
            Action::Revisit { candidate, .. } => {
                assert_eq!(whole.candidates[candidate as usize - 1].penalty, least)
            }
        }
    }
}

#[test]
fn without_a_place_to_revisit_the_reason_says_which_step_found_none() {
    let reason = |change: fn(&mut Snapshot)| {
        let mut snapshot = Mission::survey(4, 30, 3).snapshot;
        change(&mut snapshot);
        let decision =
            ask(&snapshot, &Question { alpha: None, allowable: Some(tight()), ..Question::default() }, 1);
        assert_eq!((decision.action, decision.candidates.len()), (Action::Explore, 0));
        assert!(decision.complete);
        decision.reason
    };
    let dull = |snapshot: &mut Snapshot| {
        snapshot.keyframes.iter_mut().for_each(|keyframe| keyframe.saliency = Saliency::NONE);
    };
    assert!(reason(dull).contains("no keyframe is salient enough"));
    assert!(
        reason(|snapshot| snapshot.settings.eps_m = 0.01).contains("no salient keyframes lie close enough")
    );
    assert!(
        reason(|snapshot| snapshot.settings.edge_radius_m = Some(0.01))
            .contains("no waypoint can be reached")
    );
    assert!(reason(|snapshot| snapshot.settings.min_revisit_m = 500.0).contains("at least 500 m away"));
    let snapshot = Mission::survey(4, 30, 3).snapshot;
    assert!(ask(&snapshot, &Question::default(), 1).reason.contains("below the allowance"));
}

#[test]
fn a_path_drawn_along_a_candidate_brings_the_same() {
    let snapshot = Mission::survey(4, 30, 3).snapshot;
    let decision = ask(&snapshot, &Question::default(), 1);
    let place = |id: &u64| {
        let keyframe = snapshot.keyframes.iter().find(|keyframe| keyframe.id == *id).unwrap();
        keyframe.world_from_body.translation.vector
    };
    let paths: Vec<Vec<_>> =
        decision.candidates.iter().map(|candidate| candidate.path.iter().map(place).collect()).collect();
    let evaluation = evaluate_paths(&snapshot, &paths, &pool(2), &|| false).unwrap();
    assert_eq!(evaluation.exploration, decision.exploration);
    assert!(evaluation.not_evaluated.is_empty());
    for (drawn, candidate) in evaluation.candidates.iter().zip(&decision.candidates) {
        assert_eq!((drawn.keyframe, drawn.path.len()), (None, 0));
        assert_eq!((drawn.covariance, drawn.penalty), (candidate.covariance, candidate.penalty));
        assert_eq!((&drawn.poses, &drawn.links), (&candidate.poses, &candidate.links));
    }
}

#[test]
fn waypoints_are_the_rarest_and_surest_of_their_clusters() {
    let snapshot = hull().snapshot;
    let found = waypoints(&snapshot).unwrap();
    let marginals = snapshot.elimination.marginals();
    assert_eq!(found.len(), 4);
    for waypoint in found {
        let of = |id: u64| snapshot.keyframes.iter().position(|keyframe| keyframe.id == id).unwrap();
        let sixth_root = |id: u64| marginals[of(id)].determinant().powf(1.0 / 6.0);
        let least = waypoint.members.iter().map(|&id| sixth_root(id)).fold(f64::INFINITY, f64::min);
        let score = |id: u64| snapshot.keyframes[of(id)].saliency.global * least / sixth_root(id);
        let best = waypoint.members.iter().map(|&id| score(id)).fold(0.0, f64::max);
        assert!((score(waypoint.keyframe) / best - 1.0).abs() < 1e-6);
        assert!((waypoint.score / best - 1.0).abs() < 1e-6);
        assert!((waypoint.marginal_uncertainty / sixth_root(waypoint.keyframe) - 1.0).abs() < 1e-6);
        assert!(waypoint.members.contains(&waypoint.keyframe) && waypoint.members.is_sorted());
        assert!(waypoint.members.iter().all(|&id| snapshot.keyframes[of(id)].saliency.local >= 0.5));
    }
}

/// One line of rich texture over 60 m is one cluster; its waypoints lie more than 24 spacings apart, and each
/// represents what is within them. Without a bound there is one waypoint, the best of them, with all members.
#[test]
fn a_long_cluster_has_a_waypoint_each_so_many_metres() {
    let mut snapshot = Mission::survey_over(1, 120, 5, |_, _| true).snapshot;
    let place = |snapshot: &Snapshot, id: u64| {
        let keyframe = snapshot.keyframes.iter().find(|keyframe| keyframe.id == id).unwrap();
        keyframe.world_from_body.translation.vector
    };
    let found = waypoints(&snapshot).unwrap().to_vec();
    let radius_m = 24.0 * snapshot.spacing_m().unwrap();
    assert!((3..=5).contains(&found.len()), "{}", found.len());
    for (at, waypoint) in found.iter().enumerate() {
        let away_m = |id: u64| (place(&snapshot, id) - place(&snapshot, waypoint.keyframe)).norm();
        assert!(waypoint.members.iter().all(|&id| away_m(id) <= radius_m));
        assert!(found[..at].iter().all(|other| away_m(other.keyframe) > radius_m));
    }
    let mut all: Vec<u64> = found.iter().flat_map(|waypoint| waypoint.members.clone()).collect();
    all.sort_unstable();
    snapshot.settings.max_cluster_radius_m = Some(f64::MAX);
    snapshot.derived = pdn_planning::Derived::default();
    let [whole] = waypoints(&snapshot).unwrap() else { panic!("one cluster, one waypoint") };
    assert_eq!(whole.members, all);
    let best = found.iter().find(|waypoint| waypoint.keyframe == whole.keyframe).unwrap();
    assert_eq!((best.score, best.marginal_uncertainty), (whole.score, whole.marginal_uncertainty));
    assert!(found.iter().all(|waypoint| waypoint.score <= whole.score));
}

#[test]
fn an_empty_graph_has_no_robot() {
    let snapshot = crate::mission::untied(Vec::new(), Vec::new());
    let error = decide(&snapshot, &Question::default(), &pool(1), &|| false).unwrap_err();
    assert!(matches!(error, PlanningError::NoKeyframe));
}

/// 25 lines of 80 keyframes with the four salient ellipses of the paper's hull, 2,000 keyframes in all.
fn hull() -> Mission {
    let ellipses =
        [(5.0, 5.0, 4.0, 4.0), (32.0, 4.0, 4.0, 3.0), (10.0, 20.0, 5.0, 4.0), (33.0, 24.0, 4.0, 4.0)];
    let is_salient = move |x: f64, line: usize| {
        let y = 0.6 + 1.2 * line as f64;
        ellipses.iter().any(|&(u, v, a, b)| ((x - u) / a).powi(2) + ((y - v) / b).powi(2) <= 1.0)
    };
    Mission::survey_over(25, 80, 40, is_salient)
}

fn tight() -> Allowable {
    let allowable = settings().allowable;
    Allowable { x_m: 0.01, y_m: 0.01, depth_m: 0.004, ..allowable }
}

fn pool(threads: usize) -> ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap()
}

fn ask(snapshot: &Snapshot, question: &Question, threads: usize) -> Decision {
    decide(snapshot, question, &pool(threads), &|| false).unwrap()
}
