//! Keyframes that nothing ties to the graph yet, and events that the graph cannot be solved with.

mod support;

use pdn_schemas::event::FactorKind;
use pdn_schemas::problem::Code;
use pdn_state::{DecisionRequest, Limits, OfferOutcome, Operation, Vehicle};
use support::{
    SENT_BYTES, Script, bits, config, diagonal, level, mission, odometry_covariance, place, pool, running,
};

fn step(script: &mut Script, from: u64, to: u64) {
    let relative = [0, 1, 2].map(|axis| place(to)[axis] - place(from)[axis]);
    script.factor(FactorKind::Odometry {
        from,
        to,
        relative: level(relative),
        covariance: odometry_covariance(),
    });
}

fn offer(vehicle: &mut Vehicle, script: &Script) -> Vec<OfferOutcome> {
    let from = mission(vehicle).next_seq() as usize;
    script.events[from..].iter().map(|event| vehicle.offer(event.clone(), SENT_BYTES)).collect()
}

fn refusals(outcome: &[OfferOutcome]) -> Vec<(u64, Code)> {
    let refused = outcome.iter().flat_map(|outcome| &outcome.refused);
    refused.map(|refusal| (refusal.seq, refusal.error.code())).collect()
}

#[test]
fn keyframes_wait_until_they_are_tied_and_bring_what_waited_for_them() {
    let (mut vehicle, mut script) = (running(), Script::new("m"));
    script.keyframe(0, Some(level(place(0))));
    for id in [2, 3, 1] {
        script.keyframe(id, None);
        script.depth(id);
        script.attitude(id);
    }
    step(&mut script, 2, 3); // both still wait
    assert_eq!(refusals(&offer(&mut vehicle, &script)), []);
    let state = mission(&mut vehicle).state();
    assert_eq!((state.keyframes, state.factors, state.robot.expect("the first").keyframe), (1, 1, 0));
    assert!(!state.health.ok && state.health.findings[0].contains("2 keyframes wait"), "{:?}", state.health);

    step(&mut script, 0, 1); // brings 1 with depth and attitude
    assert_eq!(refusals(&offer(&mut vehicle, &script)), []);
    let state = mission(&mut vehicle).state();
    assert_eq!((state.keyframes, state.factors, state.robot.expect("tied").keyframe), (2, 4, 1));

    step(&mut script, 1, 2); // brings 2, and through the waiting step 3, each with depth and attitude
    assert_eq!(refusals(&offer(&mut vehicle, &script)), []);
    let state = mission(&mut vehicle).state();
    assert_eq!((state.keyframes, state.factors, state.health.ok), (4, 10, true));
    assert_eq!(
        state.robot.expect("still there").keyframe,
        1,
        "the newest by events, though it was tied first"
    );
    let graph = mission(&mut vehicle).begin_graph(None, false).run().expect("the graph is regular");
    for keyframe in &graph.keyframes {
        for axis in 0..3 {
            // The steps are exact and the noise of depth and attitude is a few centimetres and hundredths of
            // a radian.
            assert!(
                (keyframe.pose.translation[axis] - place(keyframe.id)[axis]).abs() < 0.05,
                "{keyframe:?}"
            );
        }
    }
}

#[test]
fn without_a_configured_prior_the_first_keyframe_waits_for_a_prior_factor() {
    let mut vehicle = Vehicle::new(Limits::default());
    let mut without = config("m");
    without.first_keyframe_sigmas = None;
    vehicle.configure(without, 1).expect("a valid configuration");
    vehicle.command(None, Operation::Start, "", 2).expect("configured missions can start");
    let mut script = Script::new("m");
    script.keyframe(7, None);
    offer(&mut vehicle, &script);
    let state = mission(&mut vehicle).state();
    assert_eq!((state.keyframes, state.robot, state.uncertainty, state.health.ok), (0, None, None, false));
    let refused = mission(&mut vehicle).begin_decision(DecisionRequest::default()).expect_err("no graph");
    assert_eq!(refused.code(), Code::NotReady);
    assert_eq!(mission(&mut vehicle).begin_graph(None, true).run().expect("an answer").keyframes, vec![]);

    let covariance = diagonal([0.01; 6]);
    script.factor(FactorKind::Prior { keyframe: 7, pose: level([1.0, 2.0, 3.0]), covariance });
    offer(&mut vehicle, &script);
    let robot = mission(&mut vehicle).state().robot.expect("tied by the prior");
    assert_eq!(robot.keyframe, 7);
    for axis in 0..3 {
        assert!((robot.pose.translation[axis] - [1.0, 2.0, 3.0][axis]).abs() < 1e-12);
    }
    for (value, expected) in robot.covariance.0.iter().zip(covariance.0) {
        assert!((value - expected).abs() < 1e-12);
    }
}

#[test]
fn a_baseline_is_checked_when_both_keyframes_are_in_the_graph() {
    let (mut vehicle, mut script) = (running(), Script::new("m"));
    script.keyframe(0, Some(level(place(0))));
    script.keyframe(1, Some(level([0.1, 0.0, 8.5]))); // nearer than min_baseline_m = 0.3
    script.camera(0, 1); // waits: keyframe 1 is not tied
    let camera = script.seq() - 1;
    assert_eq!(refusals(&offer(&mut vehicle, &script)), []);
    step(&mut script, 0, 1);
    assert_eq!(refusals(&offer(&mut vehicle, &script)), [(camera, Code::DegenerateBaseline)]);
    script.camera(0, 1);
    assert_eq!(refusals(&offer(&mut vehicle, &script)), [(script.seq() - 1, Code::DegenerateBaseline)]);
    assert_eq!(mission(&mut vehicle).ingest_status().rejected, 2);
    assert_eq!(
        mission(&mut vehicle).begin_graph(None, false).run().expect("regular").factors.get("camera"),
        None
    );
}

/// Information of 1e30 beside 1e3 leaves nothing of the latter in double precision: the pivot vanishes.
#[test]
fn an_event_that_makes_the_graph_singular_is_undone_and_refused_alone() {
    let poison = |script: &mut Script| {
        let covariance = diagonal([1e-30; 6]);
        script.factor(FactorKind::Odometry { from: 1, to: 2, relative: level([0.5, 0.0, 0.0]), covariance });
    };
    let with = |poisoned: bool, ask: bool| {
        let (mut vehicle, mut script) = (running(), Script::new("m"));
        script.keyframe(0, Some(level(place(0))));
        for id in 1..4 {
            script.keyframe(id, None);
            if poisoned && id == 2 {
                poison(&mut script);
            } else if id == 2 {
                script.link(0, 1, false); // takes the number of the event that the other mission loses
            }
            step(&mut script, id - 1, id);
            script.depth(id);
        }
        script.keyframe(4, None); // ends the last group
        let mut outcome = Vec::new();
        for event in &script.events {
            outcome.push(vehicle.offer(event.clone(), SENT_BYTES));
            if ask {
                mission(&mut vehicle).state();
            }
        }
        let texts: Vec<String> = outcome
            .iter()
            .flat_map(|outcome| &outcome.refused)
            .map(|refusal| refusal.error.to_string())
            .collect();
        // The keyframe at which it fails enters the graph with the event, and is named all the same.
        let names = |text: &String| text.contains("that it and keyframe 2 carry") && text.contains("undone");
        assert!(texts.iter().all(names), "{texts:?}");
        (vehicle, refusals(&outcome))
    };
    let (_, clean) = with(false, false);
    assert_eq!(clean, []);
    let (mut vehicle, refused) = with(true, false);
    assert_eq!(refused, [(5, Code::Singular)]);
    let state = mission(&mut vehicle).state();
    assert_eq!((state.keyframes, state.factors), (4, 7));
    let (mut asked, also) = with(true, true);
    assert_eq!(also, refused);
    assert!(bits(mission(&mut asked), &pool(1)) == bits(mission(&mut vehicle), &pool(1)));
}
