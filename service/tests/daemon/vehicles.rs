//! Vehicles do not know each other; and readiness is told for each before it is known.

use crate::support::{BOUND, Daemon, mission};
use serde_json::json;
use zenoh::Wait;

#[test]
fn two_vehicles_are_independent() {
    let daemon = Daemon::start(&[]);
    let client = daemon.client();
    for vehicle in ["left", "right"] {
        mission::begin(&client, vehicle, "m1").unwrap();
    }
    mission::fly(&client, "left", "m1", 0..6);
    mission::fly(&client, "right", "m1", 0..3);
    let last = |keyframes| mission::last_seq(keyframes);
    let left = client.ask(&format!("pdn/left/v1/rpc/mission?after={}", last(6)), None).unwrap();
    let right = client.ask(&format!("pdn/right/v1/rpc/mission?after={}", last(3)), None).unwrap();
    assert_eq!((&left["keyframes"], &right["keyframes"]), (&json!(6), &json!(3)));
    client.ask("pdn/left/v1/op/abort", Some(json!({ "reason": "enough" }))).unwrap();
    assert_eq!(client.ask("pdn/right/v1/rpc/mission", None).unwrap()["phase"], "running");
    // A question that waits for an event of one vehicle keeps the other from nothing.
    let waits = client.begin("pdn/right/v1/rpc/decision?after=6", None);
    client.ask("pdn/left/v1/rpc/graph?marginals=true", None).unwrap();
    mission::fly(&client, "right", "m1", 3..4);
    waits.wait().unwrap();
}

#[test]
fn vehicles_are_counted_and_only_accepted_configurations_make_one() {
    let daemon = Daemon::start(&["--set", "max_vehicles=2"]);
    let client = daemon.client();
    for attempt in 0..5 {
        let key = format!("pdn/wrong{attempt}/v1/op/configure");
        let mut config = mission::configuration("m1");
        config["alpha"] = json!(7.0);
        assert_eq!(client.ask(&key, Some(config)).unwrap_err().code, "out_of_range");
    }
    for vehicle in ["one", "two"] {
        mission::begin(&client, vehicle, "m1").unwrap();
    }
    let problem = mission::begin(&client, "three", "m1").unwrap_err();
    assert_eq!(problem.code, "limit");
    assert!(problem.message.contains("max_vehicles"), "{}", problem.message);
    client.ask("pdn/two/v1/rpc/mission", None).unwrap();
}

#[test]
fn a_vehicle_finds_the_planner_before_it_configures() {
    let daemon = Daemon::start(&[]);
    let client = daemon.client();
    let key = "pdn/hull/v1/alive/planner";
    let replies = client.session.liveliness().get(key).timeout(BOUND).wait().unwrap();
    assert!(replies.recv().unwrap().into_result().is_ok());
    let watch = client.session.liveliness().declare_subscriber(key).history(true).wait().unwrap();
    let alive = watch.recv_deadline(std::time::Instant::now() + BOUND).unwrap().expect("the planner");
    assert_eq!(alive.kind(), zenoh::sample::SampleKind::Put);
    daemon.signal("TERM");
    let gone = watch.recv_deadline(std::time::Instant::now() + BOUND).unwrap().expect("a change");
    assert_eq!(gone.kind(), zenoh::sample::SampleKind::Delete);
}
