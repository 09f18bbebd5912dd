//! Missions of a vehicle: which may be configured when, what ended ones still answer, and that a mission is
//! the same from its configuration to its end.

mod support;

use pdn_schemas::problem::Code;
use pdn_schemas::reply::{Action, Phase, Policy, Timing};
use pdn_state::{DecisionRequest, Limits, Operation, StateError, Vehicle, WhatIf};
use support::{SENT_BYTES, config, mission, pool, running, script};

fn code<T>(result: Result<T, StateError>) -> Code {
    result.err().expect("a refusal").code()
}

#[test]
fn a_vehicle_without_a_mission_says_so() {
    let mut vehicle = Vehicle::new(Limits::default());
    assert_eq!(code(vehicle.mission(None).map(drop)), Code::NoMission);
    assert_eq!(code(vehicle.mission(Some("m")).map(drop)), Code::UnknownMission);
    assert_eq!(code(vehicle.command(None, Operation::Start, "", 0).map(drop)), Code::NoMission);
    let event = script("m").events.swap_remove(0);
    let outcome = vehicle.offer(event, SENT_BYTES);
    assert_eq!(outcome.refused[0].error.code(), Code::UnknownMission);
}

#[test]
fn configuring_waits_for_the_active_mission_and_never_reuses_an_id() {
    let mut vehicle = Vehicle::new(Limits::default());
    vehicle.configure(config("a"), 1).expect("first mission");
    let mut other = config("a");
    other.alpha = 0.25;
    let again = vehicle.configure(other, 2).expect("nothing has come yet").state();
    assert_eq!((again.config.alpha, again.since_ns), (0.25, 2));
    for operation in [Operation::Start, Operation::Pause, Operation::Resume, Operation::Hold] {
        vehicle.command(None, operation, "", 3).expect("a legal path through the active phases");
        assert_eq!(code(vehicle.configure(config("b"), 4).map(drop)), Code::IllegalTransition);
    }
    vehicle.command(None, Operation::Complete, "done", 5).expect("held missions can be completed");
    assert_eq!(code(vehicle.configure(config("a"), 6).map(drop)), Code::RepeatedId);
    vehicle.configure(config("b"), 7).expect("the first mission has ended");
    let ended = vehicle.mission(Some("a")).expect("ended missions stay readable").state();
    assert_eq!((ended.phase, ended.reason.as_str(), ended.since_ns), (Phase::Completed, "done", 5));
    assert_eq!(vehicle.mission(None).expect("a current mission").id(), "b");
}

#[test]
fn a_mission_that_never_started_gives_way_and_its_id_is_spent_once_an_event_came() {
    let mut vehicle = Vehicle::new(Limits::default());
    vehicle.configure(config("a"), 1).expect("first mission");
    vehicle.offer(script("a").events.swap_remove(0), SENT_BYTES);
    assert_eq!(code(vehicle.configure(config("a"), 2).map(drop)), Code::RepeatedId);
    vehicle.configure(config("b"), 3).expect("the other was never started");
    let state = vehicle.mission(Some("a")).expect("it stays readable").state();
    assert_eq!(state.phase, Phase::Aborted);
    assert!(state.reason.contains("\"b\""), "{}", state.reason);
}

#[test]
fn the_oldest_ended_mission_is_forgotten_beyond_the_bound_but_not_its_id() {
    let mut vehicle = Vehicle::new(Limits { max_missions: 2, max_mission_ids: 4, ..Limits::default() });
    for id in ["a", "b", "c", "d"] {
        vehicle.configure(config(id), 1).expect("a new id");
        vehicle.command(None, Operation::Abort, "", 2).expect("configured missions can be aborted");
    }
    assert_eq!(vehicle.mission_ids().collect::<Vec<_>>(), ["c", "d"]);
    assert_eq!(code(vehicle.configure(config("a"), 3).map(drop)), Code::RepeatedId);
    assert_eq!(code(vehicle.configure(config("e"), 3).map(drop)), Code::Limit);
}

#[test]
fn events_come_until_the_end_and_decisions_only_while_running() {
    let mut vehicle = running();
    let events = script("m").events;
    let mut seq = 0;
    for operation in [Operation::Pause, Operation::Resume, Operation::Hold, Operation::Resume] {
        for event in &events[seq..seq + 10] {
            assert_eq!(vehicle.offer(event.clone(), SENT_BYTES).refused, vec![]);
        }
        seq += 10;
        vehicle.command(None, operation, "", 4).expect("a legal path");
        let mission = mission(&mut vehicle);
        let begun = mission.begin_decision(DecisionRequest::default());
        assert_eq!(begun.is_ok(), mission.phase() == Phase::Running);
        let what_if = WhatIf { alpha: Some(0.5), ..WhatIf::default() };
        mission
            .begin_decision(DecisionRequest { what_if, full: false, ..Default::default() })
            .expect("a what-if needs no phase");
    }
    vehicle.command(None, Operation::Abort, "", 5).expect("running missions can be aborted");
    let late = vehicle.offer(events[seq].clone(), SENT_BYTES);
    assert_eq!((late.refused[0].error.code(), late.next_seq), (Code::MissionEnded, 40));
    let repeat = vehicle.offer(events[0].clone(), SENT_BYTES);
    assert!(
        repeat.repeat && repeat.refused.is_empty(),
        "a resend whose acknowledgement was lost is no fault"
    );
    assert_eq!(
        code(mission(&mut vehicle).begin_decision(DecisionRequest::default())),
        Code::IllegalTransition
    );
}

#[test]
fn a_reason_is_kept_filled_in_or_too_long() {
    let mut vehicle = running();
    assert_eq!(mission(&mut vehicle).state().reason, "running by \"start\"");
    assert_eq!(code(vehicle.command(None, Operation::Pause, &"x".repeat(5000), 3).map(drop)), Code::TooLarge);
    let state = vehicle.command(None, Operation::Pause, "lunch", 3).expect("short enough").state();
    assert_eq!((state.phase, state.reason.as_str()), (Phase::Paused, "lunch"));
}

#[test]
fn a_small_mission_from_configuration_to_completion() {
    let (mut vehicle, pool) = (running(), pool(2));
    let script = script("m");
    script.offer_all(&mut vehicle);
    let mission = mission(&mut vehicle);

    let state = mission.state();
    let factors = script.events.iter().filter(|event| matches!(event, pdn_state::Event::Factor(_))).count();
    assert_eq!((state.keyframes, state.factors), (24, factors as u64 + 1));
    assert_eq!((state.health.ok, state.health.findings.as_slice()), (true, [].as_slice()));
    assert_eq!(state.robot.expect("a robot").keyframe, 23);
    assert!(state.uncertainty.expect("a robot") > 0.0);
    // The estimate is within a few centimetres of the truth, so the survey is behind and the floor below
    // covered.
    assert!(state.estimated_remaining_m.expect("a survey") < 0.1, "{:?}", state.estimated_remaining_m);
    assert!(state.covered_m2 > 5.0 && state.covered_m2 < state.target_m2 && state.target_m2 == 24.0);

    let graph = mission.begin_graph(Some(20), true).run().expect("the graph is regular");
    assert_eq!(graph.keyframes.iter().map(|keyframe| keyframe.id).collect::<Vec<_>>(), [20, 21, 22, 23]);
    for (keyframe, truth) in graph.keyframes.iter().zip((20..24).map(support::place)) {
        let covariance = keyframe.covariance.expect("marginals were asked for").0;
        for axis in 0..3 {
            let (error, sigma) = (keyframe.pose.translation[axis] - truth[axis], covariance[7 * axis].sqrt());
            assert!(error.abs() < 5.0 * sigma, "keyframe {} axis {axis}: {error} of {sigma}", keyframe.id);
        }
    }
    let robot = graph.keyframes[3];
    let told = state.robot.expect("a robot").pose;
    for axis in 0..3 {
        // The state is told before the graph is relinearised: off by the square of 1e-3, their tolerance.
        assert!((robot.pose.translation[axis] - told.translation[axis]).abs() < 1e-5);
    }
    let waypoints = mission.begin_waypoints().expect("a graph").run().expect("marginals").waypoints;
    assert!(waypoints.iter().any(|waypoint| waypoint.candidate), "{waypoints:?}");

    // The decision's own numbers: reward order, numbering, counting; a what-if is not counted.
    let mut revisits = 0;
    for number in 0..3 {
        let alpha = (number == 2).then_some(0.0);
        let request = DecisionRequest {
            what_if: WhatIf { alpha, ..WhatIf::default() },
            full: true,
            ..Default::default()
        };
        let job = mission.begin_decision(request).expect("running");
        let outcome = job.run(&pool, &|| false).expect("a decision");
        let decision = mission.record(outcome, Timing::default()).expect("small enough");
        assert_eq!(decision.decision, (number < 2).then_some(number));
        assert_eq!((decision.graph_seq, decision.policy), (script.seq(), Policy::Pdn));
        assert!(decision.complete && !decision.candidates.is_empty() && decision.link_model.is_some());
        let best = decision.candidates.iter().map(|candidate| candidate.reward).fold(f64::MIN, f64::max);
        match decision.action {
            Action::Explore {} => assert!(decision.exploration.reward >= best),
            Action::Revisit { candidate, keyframe } => {
                let chosen = &decision.candidates[candidate as usize - 1];
                assert_eq!((chosen.keyframe, chosen.reward), (Some(keyframe), best));
                assert!(best > decision.exploration.reward);
                revisits += u64::from(number < 2);
            }
        }
        assert!(number < 2 || decision.action == Action::Explore {}, "alpha = 0 weighs the area alone");
    }
    let state = mission.state();
    assert_eq!((state.decisions, state.revisits), (2, revisits));

    // A stopped decision is incomplete and explores; a drawn path is a candidate like any other.
    let job = mission.begin_decision(DecisionRequest::default()).expect("running");
    let stopped = job.run(&pool, &|| true).expect("never silence").decision().clone();
    assert!(!stopped.complete && !stopped.not_evaluated.is_empty() && stopped.action == Action::Explore {});
    let there = support::place(3);
    let job = mission
        .begin_evaluate(vec![vec![there], vec![there]], DecisionRequest::default())
        .expect("two paths");
    let drawn = job.run(&pool, &|| false).expect("evaluated").candidates;
    assert_eq!(drawn[0].covariance, drawn[1].covariance);
    assert_eq!((drawn[0].keyframe, drawn[1].candidate, drawn[0].poses.is_none()), (None, 2, true));
    assert_eq!(code(job.run(&pool, &|| true)), Code::Deadline);

    let state = vehicle.command(None, Operation::Complete, "", 9).expect("running").state();
    assert_eq!((state.phase, state.next_seq), (Phase::Completed, script.seq()));
}
