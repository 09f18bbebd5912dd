//! A mission from its configuration to its end, in both formats.

use crate::support::{Daemon, mission};
use pdn_schemas::codec::{self, Format};
use pdn_schemas::reply::{Action, Decision, MissionState};
use pdn_schemas::{Factor, Keyframe, MissionConfig};
use serde_json::json;

#[test]
fn a_mission_in_json() {
    let daemon = Daemon::start(&[]);
    let client = daemon.client();
    let acks = client.subscribe("pdn/hull/v1/out/ack");
    let states = client.subscribe("pdn/hull/v1/out/state");
    let decided = client.subscribe("pdn/hull/v1/out/decided");

    let configured = client.ask("pdn/hull/v1/op/configure", Some(mission::configuration("m1"))).unwrap();
    assert_eq!(configured["phase"], "configured");
    let early = client.ask("pdn/hull/v1/rpc/decision", None).unwrap_err();
    assert_eq!(early.code, "illegal_transition", "{}", early.message);
    let running = client.ask("pdn/hull/v1/op/start", Some(json!({ "reason": "go" }))).unwrap();
    assert_eq!((&running["phase"], &running["reason"]), (&json!("running"), &json!("go")));

    let last = mission::last_seq(24);
    mission::fly(&client, "hull", "m1", 0..24);
    let decision = client.ask(&format!("pdn/hull/v1/rpc/decision?after={last};detail=full"), None).unwrap();
    assert_eq!(decision["graph_seq"], last + 1);
    assert_eq!(decision["decision"], 0);
    assert_eq!(decision["robot"]["keyframe"], 23);
    assert_eq!(decision["complete"], true);
    assert_eq!(decision["candidates"].as_array().unwrap().len(), 1);
    assert!(decision["candidates"][0]["poses"].is_array());
    assert!(decision["timing"]["total_ms"].as_f64().unwrap() > 0.0);
    assert_eq!(decided.wait_for("the decision", |told| told["decision"] == 0), decision);
    acks.wait_for("the last event", |ack| ack["next_seq"] == last + 1);
    states.wait_for("a decision", |state| state["decisions"] == 1);

    let what_if = client.ask("pdn/hull/v1/rpc/decision?alpha=0", None).unwrap();
    assert_eq!((&what_if["decision"], &what_if["alpha"]), (&json!(null), &json!(0.0)));
    assert!(what_if["candidates"][0]["poses"].is_null());
    let state = client.ask("pdn/hull/v1/rpc/mission", None).unwrap();
    assert_eq!((&state["keyframes"], &state["decisions"]), (&json!(24), &json!(1)));

    let graph = client.ask("pdn/hull/v1/rpc/graph?from=20;marginals=true", None).unwrap();
    assert_eq!(graph["keyframes"].as_array().unwrap().len(), 4);
    assert_eq!(graph["keyframes"][3]["covariance"].as_array().unwrap().len(), 36);
    let waypoints = client.ask("pdn/hull/v1/rpc/waypoints", None).unwrap();
    assert_eq!(waypoints["waypoints"].as_array().unwrap().len(), 1);
    let coverage = client.ask("pdn/hull/v1/rpc/coverage", None).unwrap();
    assert!(coverage["covered_m2"].as_f64().unwrap() > 10.0);
    let links = client.ask("pdn/hull/v1/rpc/link_model", None).unwrap();
    assert_eq!(links["cells"].as_array().unwrap().len(), 25);
    let drawn = json!({ "paths": [[[11.0, 1.0, 10.0], [8.0, 1.0, 10.0]]] });
    let evaluated = client.ask("pdn/hull/v1/rpc/evaluate", Some(drawn)).unwrap();
    assert_eq!(evaluated["candidates"].as_array().unwrap().len(), 1);
    let ingest = client.ask("pdn/hull/v1/rpc/ingest", None).unwrap();
    assert_eq!((&ingest["next_seq"], &ingest["missing"]), (&json!(last + 1), &json!([])));

    let completed = client.ask("pdn/hull/v1/op/complete", None).unwrap();
    assert_eq!(completed["phase"], "completed");
    let again = client.ask("pdn/hull/v1/op/pause", None).unwrap_err();
    assert_eq!(again.code, "illegal_transition");
}

#[test]
fn a_mission_in_bincode_and_the_same_decision() {
    let daemon = Daemon::start(&[]);
    let client = daemon.client();
    let config: MissionConfig = serde_json::from_value(mission::configuration("m1")).unwrap();
    let body =
        (codec::encode(&config, Format::Bincode).unwrap(), codec::encoding::<MissionConfig>(Format::Bincode));
    let (bytes, encoding) = client.ask_raw("pdn/hull/v1/op/configure?encoding=bincode", Some(body)).unwrap();
    assert_eq!(encoding, codec::encoding::<MissionState>(Format::Bincode));
    let state: MissionState = codec::decode(&bytes, Format::Bincode).unwrap();
    assert_eq!(state.config, config);
    client.ask("pdn/hull/v1/op/start", None).unwrap();
    for (key, event) in (0..24).flat_map(|index| mission::step("hull", "m1", index)) {
        let (bytes, encoding) = if key.ends_with("keyframe") {
            let event: Keyframe = serde_json::from_value(event).unwrap();
            (codec::encode(&event, Format::Bincode).unwrap(), codec::encoding::<Keyframe>(Format::Bincode))
        } else {
            let event: Factor = serde_json::from_value(event).unwrap();
            (codec::encode(&event, Format::Bincode).unwrap(), codec::encoding::<Factor>(Format::Bincode))
        };
        client.publish_raw(&key, bytes, &encoding);
    }
    let last = mission::last_seq(24);
    let selector = format!("pdn/hull/v1/rpc/decision?after={last};encoding=bincode");
    let (bytes, _) = client.ask_raw(&selector, None).unwrap();
    let in_bincode: Decision = codec::decode(&bytes, Format::Bincode).unwrap();
    assert!(in_bincode.complete);

    mission::begin(&client, "other", "m1").unwrap();
    mission::fly(&client, "other", "m1", 0..24);
    let in_json = client.ask(&format!("pdn/other/v1/rpc/decision?after={last}"), None).unwrap();
    let in_json: Decision = serde_json::from_value(in_json).unwrap();
    assert_eq!(Decision { timing: in_bincode.timing, ..in_json }, in_bincode);
    assert!(matches!(in_bincode.action, Action::Explore {} | Action::Revisit { .. }));
}
