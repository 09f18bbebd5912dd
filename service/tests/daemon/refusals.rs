//! What cannot be taken is refused with a code and a sentence, and nothing else is disturbed.

use crate::support::{Daemon, mission};
use pdn_schemas::LinkOutcome;
use pdn_schemas::codec::{self, Format};
use serde_json::{Value, json};

fn link(mission: &str, seq: u64) -> Value {
    json!({ "mission": mission, "seq": seq, "stamp_ns": 0, "from": 0, "to": 1, "registered": true })
}

#[test]
fn a_question_that_cannot_be_read_says_what_can() {
    let daemon = Daemon::start(&[]);
    let client = daemon.client();
    for (selector, code, words) in [
        ("pdn/hull/v1/rpc/decision", "unknown_vehicle", "op/configure"),
        ("pdn/hull/v1/op/start", "unknown_vehicle", "hull"),
        ("pdn/hull/v1/rpc/decisions", "invalid", "rpc/decision, rpc/evaluate, rpc/mission"),
        ("pdn/hull/v1/op/go", "invalid", "op/configure, op/start"),
        ("pdn/Hull/v1/rpc/mission", "invalid", "a-z"),
        ("pdn/*/v1/rpc/mission", "invalid", "vehicle"),
    ] {
        let problem = client.ask(selector, None).expect_err(selector);
        assert_eq!(problem.code, code, "{selector}: {}", problem.message);
        assert!(problem.message.contains(words), "{selector}: {}", problem.message);
    }
    mission::begin(&client, "hull", "m1").unwrap();
    for (selector, code, words) in [
        ("pdn/hull/v1/rpc/decision?alhpa=1", "invalid", "alpha"),
        ("pdn/hull/v1/rpc/decision?alpha=one", "invalid", "alpha=\"one\""),
        ("pdn/hull/v1/rpc/decision?alpha=2", "out_of_range", "alpha"),
        ("pdn/hull/v1/rpc/decision?sigma_heading_deg=0", "out_of_range", "heading"),
        ("pdn/hull/v1/rpc/decision?deadline_ms=99999999999", "out_of_range", "deadline_ms"),
        ("pdn/hull/v1/rpc/decision?mission=m2", "unknown_mission", "m2"),
        ("pdn/hull/v1/rpc/decision", "not_ready", "keyframe"),
        ("pdn/hull/v1/rpc/mission?encoding=xml", "invalid", "json or bincode"),
        ("pdn/hull/v1/op/pause?mission=m2", "unknown_mission", "m2"),
    ] {
        let problem = client.ask(selector, None).expect_err(selector);
        assert_eq!(problem.code, code, "{selector}: {}", problem.message);
        assert!(problem.message.contains(words), "{selector}: {}", problem.message);
    }
    for (selector, payload, code, words) in [
        ("pdn/hull/v1/op/configure", json!({}), "invalid", "mission"),
        ("pdn/hull/v1/op/configure", mission::configuration("m2"), "illegal_transition", "m1"),
        ("pdn/hull/v1/op/pause", json!({ "raison": "" }), "invalid", "raison"),
        ("pdn/hull/v1/rpc/mission", json!({}), "invalid", "no payload"),
        ("pdn/hull/v1/rpc/evaluate", json!({ "paths": [[["a"]]] }), "invalid", "paths"),
    ] {
        let problem = client.ask(selector, Some(payload)).expect_err(selector);
        assert_eq!(problem.code, code, "{selector}: {}", problem.message);
        assert!(problem.message.contains(words), "{selector}: {}", problem.message);
    }
    assert_eq!(client.ask("pdn/hull/v1/rpc/mission", None).unwrap()["phase"], "running");
}

#[test]
fn an_event_that_cannot_be_read_is_told_and_takes_its_place() {
    let daemon = Daemon::start(&[]);
    let client = daemon.client();
    let rejected = client.subscribe("pdn/hull/v1/out/rejected");
    mission::begin(&client, "hull", "m1").unwrap();
    let told = |code: &'static str, seq: Value| {
        rejected.wait_for(code, |problem| problem["code"] == code && problem["seq"] == seq);
    };
    let key = |name: &str| format!("pdn/hull/v1/in/{name}");

    mission::fly(&client, "hull", "m1", 0..1);
    client.publish(&key("link"), &json!({ "mission": "m1", "seq": 1, "stamp_ns": 0, "from": 0, "upto": 1 }));
    told("invalid", json!(1));

    let good: LinkOutcome = serde_json::from_value(link("m1", 2)).unwrap();
    let bytes = codec::encode(&good, Format::Bincode).unwrap();
    let encoding = codec::encoding::<LinkOutcome>(Format::Bincode);
    let (schema, _) = encoding.split_once('#').unwrap();
    client.publish_raw(&key("link"), bytes, &format!("{schema}#0123456789abcdef"));
    told("schema_mismatch", json!(2));

    let good: LinkOutcome = serde_json::from_value(link("m1", 3)).unwrap();
    let mut bytes = codec::encode(&good, Format::Bincode).unwrap();
    bytes.pop();
    client.publish_raw(&key("link"), bytes, schema);
    told("invalid", json!(3));

    // 10 MB of which the beginning is an event like any other.
    let good: LinkOutcome = serde_json::from_value(link("m1", 4)).unwrap();
    let mut bytes = codec::encode(&good, Format::Bincode).unwrap();
    bytes.resize(10 * 1024 * 1024, 0);
    client.publish_raw(&key("link"), bytes, schema);
    told("too_large", json!(4));

    client.publish_raw(&key("keyframe"), b"no event at all".to_vec(), "application/json");
    told("invalid", json!(null));
    client.publish(&key("nonsense"), &link("m1", 5));
    told("invalid", json!(null));

    let strangers = client.subscribe("pdn/stranger/v1/out/rejected");
    client.publish("pdn/stranger/v1/in/link", &link("m1", 6));
    strangers.wait_for("a stranger", |problem| problem["code"] == "unknown_vehicle" && problem["seq"] == 6);

    // What comes after goes on as if nothing had been.
    let mut events = mission::step("hull", "m1", 1);
    events[0].1["seq"] = json!(5);
    events[1].1["seq"] = json!(6);
    for (key, event) in events {
        client.publish(&key, &event);
    }
    client.ask("pdn/hull/v1/rpc/decision?after=6", None).unwrap();
    let status = client.ask("pdn/hull/v1/rpc/ingest", None).unwrap();
    assert_eq!((&status["next_seq"], &status["rejected"]), (&json!(7), &json!(4)));
}
