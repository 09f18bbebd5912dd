//! Measurements that cannot be true: told apart from what is believed, refused by themselves, and nothing
//! else disturbed.

mod support;

use pdn_schemas::config::{FirstKeyframeSigmas, Loss, MissionConfig};
use pdn_schemas::event::FactorKind;
use pdn_schemas::problem::Code;
use pdn_schemas::shared::Pose;
use pdn_state::{Limits, OfferOutcome, Operation, Vehicle};
use support::{
    LINES, PER_LINE, SENT_BYTES, Script, bits, config, diagonal, level, mission, place, pool, running, script,
};

const LAST: u64 = LINES * PER_LINE - 1;
const CLOSE: [f64; 6] = [1e-2, 1e-2, 1e-2, 1e-4, 1e-4, 1e-4];

fn refusals(outcome: &OfferOutcome) -> Vec<(u64, Code, String)> {
    let told = |refusal: &pdn_state::Refusal| (refusal.seq, refusal.error.code(), refusal.error.to_string());
    outcome.refused.iter().map(told).collect()
}

fn running_with(config: MissionConfig) -> Vehicle {
    let mut vehicle = Vehicle::new(Limits::default());
    vehicle.configure(config, 1).expect("a valid configuration");
    vehicle.command(None, Operation::Start, "", 2).expect("configured missions can start");
    vehicle
}

/// A loop closure from the last keyframe to the first, wrong by so much.
fn closure(error_m: [f64; 3]) -> FactorKind {
    let relative = [0, 1, 2].map(|axis| place(0)[axis] - place(LAST)[axis] + error_m[axis]);
    FactorKind::Relative { from: LAST, to: 0, relative: level(relative), covariance: diagonal(CLOSE) }
}

/// Measurements of the last keyframe that lie so far off.
fn absurd() -> Vec<(&'static str, FactorKind)> {
    let covariance = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let turned = Pose { translation: place(LAST), rotation: [0.0, 0.0, 1.0, 0.0] };
    vec![
        ("relative", closure([0.0, 100.0, 0.0])),
        ("relative", closure([3.0, 0.0, 0.0])),
        ("position", FactorKind::Position { keyframe: LAST, position: [99.0, 0.0, 8.5], covariance }),
        ("depth", FactorKind::Depth { keyframe: LAST, depth_m: 18.0, variance_m2: 4e-4 }),
        (
            "attitude",
            FactorKind::Attitude {
                keyframe: LAST,
                rotation: [1.0, 0.0, 0.0, 0.0],
                tilt_variance_rad2: 2e-5,
                heading_variance_rad2: None,
            },
        ),
        ("prior", FactorKind::Prior { keyframe: LAST, pose: turned, covariance: diagonal([1e-2; 6]) }),
        (
            "odometry",
            FactorKind::Odometry {
                from: LAST - 1,
                to: LAST,
                relative: level([0.0, 0.0, 30.0]),
                covariance: diagonal(CLOSE),
            },
        ),
    ]
}

/// A mission to its end and then this event; `is_committed` in a group of its own, after a question and
/// another keyframe.
fn with_last(factor: FactorKind, is_committed: bool) -> (Vehicle, Vec<(u64, Code, String)>) {
    let (mut vehicle, mut script) = (running(), script("m"));
    if is_committed {
        script.keyframe(LAST + 1, None);
    }
    script.offer_all(&mut vehicle);
    if is_committed {
        mission(&mut vehicle).state();
    }
    script.factor(factor);
    let outcome = vehicle.offer(script.events[script.events.len() - 1].clone(), SENT_BYTES);
    let refused = refusals(&outcome);
    (vehicle, refused)
}

#[test]
fn what_cannot_be_true_is_refused_with_its_reason_and_leaves_no_trace() {
    for is_committed in [false, true] {
        // Takes up the same number in the order, and is refused for another reason.
        let nothing = FactorKind::Depth { keyframe: 9999, depth_m: 8.5, variance_m2: 1.0 };
        let (mut without, refused) = with_last(nothing, is_committed);
        assert_eq!(refused[0].1, Code::UnknownKeyframe);
        for (kind, factor) in absurd() {
            let (mut vehicle, refused) = with_last(factor, is_committed);
            let [(_, Code::Contradiction, told)] = refused.as_slice() else {
                panic!("{kind}, committed {is_committed}: {refused:?}")
            };
            for word in [format!("factor.{kind}"), LAST.to_string(), format!("robust.{kind}")] {
                assert!(told.contains(&word), "{word} in: {told}");
            }
            let pool = pool(1);
            assert_eq!(
                bits(mission(&mut vehicle), &pool),
                bits(mission(&mut without), &pool),
                "{kind}, committed {is_committed}"
            );
        }
    }
}

#[test]
fn what_is_only_unlikely_is_taken() {
    // Sigmas of the closure are 0.1 m; half a metre is what an odd registration or covariance may come to.
    for is_committed in [false, true] {
        for factor in [closure([0.0; 3]), closure([0.5, -0.5, 0.3])] {
            assert_eq!(with_last(factor, is_committed).1, []);
        }
    }
}

#[test]
fn a_kind_with_a_robust_loss_is_weighed_down_instead() {
    let mut robust = config("m");
    robust.robust.relative = Loss::Cauchy(2.385);
    let mut vehicle = running_with(robust);
    let mut script = script("m");
    script.factor(closure([0.0, 100.0, 0.0]));
    script.offer_all(&mut vehicle);
    let graph = mission(&mut vehicle).begin_graph(None, false).run().expect("the graph is regular");
    for keyframe in &graph.keyframes {
        for axis in 0..3 {
            // As without it: a few centimetres of noise.
            let error_m = (keyframe.pose.translation[axis] - place(keyframe.id)[axis]).abs();
            assert!(error_m < 0.1, "keyframe {}: {error_m} m", keyframe.id);
        }
    }
}

#[test]
fn the_distance_is_that_of_all_noise_together() {
    // Level steps of 1 m ahead. What is believed of the last depth: the prior's, three steps', and by their
    // lever arms in metres all turns in pitch; the last step is told the other way round, and turns about
    // where it comes from.
    let (prior_m, step_m, depth_m) = (0.3_f64, 0.1_f64, 0.05_f64);
    let (prior_deg, step_rad, levers_m) = (5.0_f64, 0.1_f64, [2.0_f64, 1.0, 1.0]);
    let (steps, off_m) = (3_u64, 30.0);
    for is_committed in [false, true] {
        let mut below = config("m");
        below.first_keyframe_sigmas =
            Some(FirstKeyframeSigmas { translation_m: [prior_m; 3], rotation_deg: [prior_deg; 3] });
        let mut vehicle = running_with(below);
        let mut script = Script::new("m");
        script.keyframe(0, Some(level([0.0; 3])));
        for id in 1..=steps {
            script.keyframe(id, None);
        }
        for id in 1..=steps {
            let backwards = id == steps;
            let (from, to) = if backwards { (id, id - 1) } else { (id - 1, id) };
            let relative = level([if backwards { -1.0 } else { 1.0 }, 0.0, 0.0]);
            let turn = step_rad * step_rad;
            let variances = [1e-2, 1e-2, step_m * step_m, turn, turn, turn];
            script.factor(FactorKind::Odometry { from, to, relative, covariance: diagonal(variances) });
        }
        if is_committed {
            script.keyframe(steps + 1, None);
        }
        script.offer_all(&mut vehicle);
        script.factor(FactorKind::Depth { keyframe: steps, depth_m: off_m, variance_m2: depth_m * depth_m });
        let refused = refusals(&vehicle.offer(script.events[script.events.len() - 1].clone(), SENT_BYTES));
        let turns_m2 = (steps as f64 * prior_deg.to_radians()).powi(2)
            + levers_m.map(|lever| (lever * step_rad).powi(2)).iter().sum::<f64>();
        let variance_m2 = prior_m * prior_m + steps as f64 * step_m * step_m + depth_m * depth_m + turns_m2;
        let wanted = format!("lies {:.0} standard deviations", off_m / variance_m2.sqrt());
        assert!(refused[0].2.contains(&wanted), "{wanted}, committed {is_committed}: {refused:?}");
    }
}

#[test]
fn one_that_waited_is_blamed_itself_when_its_keyframe_enters() {
    let (mut vehicle, mut script) = (running(), script("m"));
    script.keyframe(LAST + 1, None);
    script.factor(FactorKind::Depth { keyframe: LAST + 1, depth_m: 50.0, variance_m2: 4e-4 });
    let absurd = script.seq() - 1;
    script.factor(FactorKind::Depth { keyframe: LAST + 1, depth_m: 8.5, variance_m2: 4e-4 });
    script.offer_all(&mut vehicle);
    let before = mission(&mut vehicle).state().factors;
    script.odometry(LAST, LAST + 1);
    let outcome = vehicle.offer(script.events[script.events.len() - 1].clone(), SENT_BYTES);
    let refused: Vec<(u64, Code)> =
        refusals(&outcome).into_iter().map(|(seq, code, _)| (seq, code)).collect();
    assert_eq!(refused, [(absurd, Code::Contradiction)]);
    let state = mission(&mut vehicle).state();
    assert_eq!((state.factors, state.robot.expect("tied").keyframe), (before + 2, LAST + 1));
}

#[test]
fn a_closure_that_a_loss_may_weigh_down_does_not_make_the_true_step_a_contradiction() {
    let mut robust = config("m");
    robust.robust.relative = Loss::Cauchy(2.385);
    let mut vehicle = running_with(robust);
    let mut script = script("m");
    script.keyframe(LAST + 1, None);
    let relative =
        [0, 1, 2].map(|axis| place(LAST + 1)[axis] - place(0)[axis] + if axis == 1 { 100.0 } else { 0.0 });
    let false_closure = FactorKind::Relative {
        from: 0,
        to: LAST + 1,
        relative: level(relative),
        covariance: diagonal(CLOSE),
    };
    script.factor(false_closure);
    script.odometry(LAST, LAST + 1);
    script.depth(LAST + 1);
    script.offer_all(&mut vehicle);
    let robot = mission(&mut vehicle).state().robot.expect("tied");
    let error_m = (robot.pose.translation[1] - place(LAST + 1)[1]).abs();
    assert!(robot.keyframe == LAST + 1 && error_m < 0.1, "{error_m} m");
}

/// A straight dive of 300 m with a heading of which 20 degrees (one sigma) are wrong, and then one true
/// position.
#[test]
fn a_true_position_far_along_an_arc_is_taken() {
    for off_deg in [0.0_f64, 20.0, 40.0, -40.0] {
        let mut unsure = config("m");
        unsure.first_keyframe_sigmas =
            Some(FirstKeyframeSigmas { translation_m: [0.1; 3], rotation_deg: [0.1, 0.1, 20.0] });
        let mut vehicle = running_with(unsure);
        let mut script = Script::new("m");
        script.keyframe(0, Some(level([0.0; 3])));
        let steps = 60_u64;
        for id in 1..=steps {
            script.keyframe(id, None);
            let covariance = diagonal([4e-4, 4e-4, 4e-4, 1e-8, 1e-8, 1e-8]);
            script.factor(FactorKind::Odometry {
                from: id - 1,
                to: id,
                relative: level([5.0, 0.0, 0.0]),
                covariance,
            });
        }
        let (sin, cos) = off_deg.to_radians().sin_cos();
        let length_m = 5.0 * steps as f64;
        let position = [length_m * cos, length_m * sin, 0.0];
        let covariance = [0.25, 0.0, 0.0, 0.0, 0.25, 0.0, 0.0, 0.0, 0.25];
        script.factor(FactorKind::Position { keyframe: steps, position, covariance });
        script.offer_all(&mut vehicle);
        let robot = mission(&mut vehicle).state().robot.expect("tied");
        for (found, wanted) in robot.pose.translation.iter().zip(position) {
            assert!(
                (found - wanted).abs() < 2.0,
                "{off_deg} degrees: {:?} for {position:?}",
                robot.pose.translation
            );
        }
    }
}

#[test]
fn a_graph_that_much_contradicts_is_told_and_a_prior_is_the_way_out() {
    let (mut vehicle, mut script) = (running(), script("m"));
    let truth = |id: u64| [place(LAST)[0], place(LAST)[1] + 0.5 * (id - LAST) as f64, 8.5];
    let step = |script: &mut Script, id: u64, error_m: f64| {
        script.keyframe(id, None);
        let relative = level([0.0, 0.5, error_m]);
        let covariance = support::odometry_covariance();
        script.factor(FactorKind::Odometry { from: id - 1, to: id, relative, covariance });
    };
    step(&mut script, LAST + 1, 30.0);
    script.offer_all(&mut vehicle);
    let mut id = LAST + 1;
    while mission(&mut vehicle).state().health.ok {
        assert!(id < LAST + 60, "told by now");
        id += 1;
        let from = script.events.len();
        step(&mut script, id, 0.0);
        script.depth(id);
        script.events[from..].iter().for_each(|event| drop(vehicle.offer(event.clone(), SENT_BYTES)));
    }
    let told = mission(&mut vehicle).state().health.findings.join(" ");
    assert!(told.contains("16 of the last 256 events contradict the graph"), "{told}");

    id += 1;
    let from = script.events.len();
    script.keyframe(id, None);
    script.factor(FactorKind::Prior { keyframe: id, pose: level(truth(id)), covariance: diagonal(CLOSE) });
    script.depth(id);
    for event in &script.events[from..] {
        assert_eq!(vehicle.offer(event.clone(), SENT_BYTES).refused, []);
    }
    let robot = mission(&mut vehicle).state().robot.expect("tied");
    assert!((robot.pose.translation[2] - 8.5).abs() < 0.1, "{:?}", robot.pose);
}

/// The gate is a setting of the mission: how far, told with its name, or none at all.
#[test]
fn the_gate_refuses_beyond_its_bound_and_names_it_or_lets_all_in() {
    let off_m = [0.0, 0.0, 0.5]; // a depth off by 0.5 m: about 25 of its standard deviations of 0.02 m
    for (gate_sigmas, told) in [
        (Some(20.0), Some("more than gate_sigmas = 20,")),
        (Some(3.5), Some("more than gate_sigmas = 3.5,")),
        (Some(40.0), None),
        (Some(1e300), None),
        (None, None),
    ] {
        let mut configuration = config("m");
        configuration.gate_sigmas = gate_sigmas;
        let mut vehicle = running_with(configuration);
        let mut script = script("m");
        script.offer_all(&mut vehicle);
        let depth_m = place(LAST)[2] + off_m[2];
        script.factor(FactorKind::Depth { keyframe: LAST, depth_m, variance_m2: 4e-4 });
        let last = script.events.last().expect("there is one").clone();
        let refused = refusals(&vehicle.offer(last, SENT_BYTES));
        match (told, refused.as_slice()) {
            (None, []) => {}
            (Some(told), [(_, Code::Contradiction, text)]) => {
                assert!(text.contains(told) && text.contains(" standard deviations from"), "{text}");
            }
            (_, refused) => panic!("{gate_sigmas:?}: {refused:?}"),
        }
    }
}
