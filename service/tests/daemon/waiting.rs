//! `after=`, `deadline_ms=` and the bound on questions in flight.

use crate::support::{Daemon, mission};
use serde_json::json;

#[test]
fn a_question_waits_for_its_event_and_holds_up_nobody() {
    let daemon = Daemon::start(&[]);
    let client = daemon.client();
    mission::begin(&client, "hull", "m1").unwrap();
    mission::fly(&client, "hull", "m1", 0..10);
    let last = mission::last_seq(12);
    let waits = client.begin(&format!("pdn/hull/v1/rpc/decision?after={last}"), None);
    let next = mission::last_seq(10) + 1;
    let waits_for_the_next = client.begin(&format!("pdn/hull/v1/rpc/mission?after={next}"), None);
    // Answered while the others wait.
    let early = client.ask("pdn/hull/v1/rpc/decision", None).unwrap();
    assert_eq!(early["graph_seq"], mission::last_seq(10) + 1);
    mission::fly(&client, "hull", "m1", 10..12);
    let (bytes, _) = waits.wait().unwrap();
    let decision: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
    assert_eq!(decision["graph_seq"], last + 1);
    let (bytes, _) = waits_for_the_next.wait().unwrap();
    let state: serde_json::Value = serde_json::from_slice(&bytes).unwrap();
    assert!(state["next_seq"].as_u64() > Some(next), "{}", state["next_seq"]);
    assert_eq!(
        client.ask(&format!("pdn/hull/v1/rpc/mission?after={last}"), None).unwrap()["next_seq"],
        last + 1
    );
}

#[test]
fn waiting_ends_at_the_deadline_or_at_wait_ms() {
    let daemon = Daemon::start(&["--set", "wait_ms=50"]);
    let client = daemon.client();
    mission::begin(&client, "hull", "m1").unwrap();
    mission::fly(&client, "hull", "m1", 0..2);
    for parameters in ["after=1000", "after=1000;deadline_ms=1"] {
        let problem = client.ask(&format!("pdn/hull/v1/rpc/graph?{parameters}"), None).unwrap_err();
        assert_eq!(problem.code, "deadline", "{parameters}");
        assert!(
            problem.message.contains("event 1000") && problem.message.contains("3 is the next"),
            "{}",
            problem.message
        );
    }
}

#[test]
fn a_decision_without_time_is_incomplete_and_says_what_is_left_out() {
    let daemon = Daemon::start(&[]);
    let client = daemon.client();
    mission::begin(&client, "hull", "m1").unwrap();
    mission::fly(&client, "hull", "m1", 0..24);
    let last = mission::last_seq(24);
    let whole = client.ask(&format!("pdn/hull/v1/rpc/decision?after={last}"), None).unwrap();
    let decision = client.ask("pdn/hull/v1/rpc/decision?deadline_ms=0", None).unwrap();
    assert_eq!(decision["complete"], false);
    assert_eq!(decision["not_evaluated"], json!([whole["candidates"][0]["keyframe"]]));
    assert_eq!(decision["action"], json!({ "explore": {} }));
    let problem = client.ask("pdn/hull/v1/rpc/graph?marginals=true;deadline_ms=0", None).unwrap_err();
    assert_eq!(problem.code, "deadline");
}

#[test]
fn beyond_the_bound_questions_are_answered_overloaded() {
    let daemon = Daemon::start(&["--set", "max_questions_in_flight=2"]);
    let client = daemon.client();
    mission::begin(&client, "hull", "m1").unwrap();
    mission::fly(&client, "hull", "m1", 0..2);
    let waits: Vec<_> = (0..2).map(|_| client.begin("pdn/hull/v1/rpc/decision?after=4", None)).collect();
    let problem = client.ask("pdn/hull/v1/rpc/decision", None).unwrap_err();
    assert_eq!(problem.code, "overloaded");
    assert!(problem.message.contains("max_questions_in_flight"), "{}", problem.message);
    // How things stand is told still; and room comes back.
    client.ask("pdn/hull/v1/rpc/mission", None).unwrap();
    mission::fly(&client, "hull", "m1", 2..3);
    for waiting in waits {
        waiting.wait().unwrap();
    }
    client.ask("pdn/hull/v1/rpc/decision", None).unwrap();
}

#[test]
fn a_flood_of_questions_is_answered_whole() {
    let daemon = Daemon::start(&["--set", "incoming_messages=16"]);
    let client = daemon.client();
    mission::begin(&client, "hull", "m1").unwrap();
    mission::fly(&client, "hull", "m1", 0..24);
    let flood: Vec<_> =
        (0..500).map(|_| client.begin("pdn/hull/v1/rpc/graph?marginals=true", None)).collect();
    let (answered, refused): (Vec<_>, Vec<_>) =
        flood.into_iter().map(|pending| pending.wait()).partition(Result::is_ok);
    assert!(!answered.is_empty());
    for problem in refused.into_iter().filter_map(Result::err) {
        assert_eq!(problem.code, "overloaded", "{}", problem.message);
    }
    client.ask("pdn/hull/v1/rpc/decision", None).unwrap();
}
