//! The program from outside: its commands, its exit codes, how it stops.

use crate::support::{Daemon, mission, run};
use serde_json::json;
use std::path::PathBuf;

/// A directory of the test's own, taken away at its end.
struct Scratch(PathBuf);

impl Scratch {
    fn new(name: &str) -> Scratch {
        let path = std::env::temp_dir().join(format!("pdnd-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Scratch(path)
    }

    fn file(&self, name: &str, text: &str) -> String {
        let path = self.0.join(name);
        std::fs::write(&path, text).unwrap();
        path.display().to_string()
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

#[test]
fn an_endpoint_in_use_is_named_with_the_way_out() {
    let daemon = Daemon::start(&[]);
    let (code, _, error) = run(&["-l", &daemon.endpoint]);
    assert_eq!(code, 3, "{error}");
    for words in [daemon.endpoint.as_str(), "in use", "-l tcp/127.0.0.1:7448"] {
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn a_wrong_setting_is_found_before_the_network_is_touched() {
    let scratch = Scratch::new("settings");
    let unknown = scratch.file("unknown.toml", "max_vehicle = 3\n");
    let range = scratch.file("range.toml", "drain_ms = 1\n");
    let zenoh = scratch.file("zenoh.json5", "{ listen: { endpoint: [] } }");
    let good = scratch.file("good.toml", "listen = [\"tcp/127.0.0.1:7999\"]\n");
    for (arguments, words) in [
        (vec!["check-config", unknown.as_str()], "no setting `max_vehicle` (did you mean `max_vehicles`?)"),
        (vec!["--config", unknown.as_str()], "no setting `max_vehicle`"),
        (vec!["check-config", range.as_str()], "`drain_ms` is 1, outside its range 100 to 60000"),
        (vec!["check-config", "/no/such/file"], "cannot read the settings file /no/such/file"),
        (vec!["check-config", "--zenoh-config", zenoh.as_str()], "is no Zenoh configuration"),
        (vec!["-l", "7447"], "is no endpoint"),
        (vec!["--set", "drain=3"], "did you mean `drain_ms`"),
        (vec!["--log-format", "xml"], "`log_format` must be"),
        (vec!["--no-such-flag"], "--no-such-flag"),
    ] {
        let (code, _, error) = run(&arguments);
        assert_eq!(code, 2, "{arguments:?}: {error}");
        assert!(error.contains(words), "{arguments:?}: {error}");
    }
    let (code, output, _) = run(&["check-config", &good]);
    assert_eq!(code, 0);
    assert!(output.contains("tcp/127.0.0.1:7999"), "{output}");
}

#[test]
fn settings_are_printed_as_they_are_in_force() {
    let (code, document, _) = run(&["config"]);
    assert_eq!((code, document.as_str()), (0, include_str!("../../../deploy/pdnd.toml")));
    let (code, effective, _) =
        run(&["config", "--effective", "--set", "max_vehicles=3", "-l", "tcp/127.0.0.1:1"]);
    assert_eq!(code, 0);
    let effective: toml::Table = effective.parse().unwrap();
    assert_eq!(effective["max_vehicles"].as_integer(), Some(3));
    assert_eq!(effective["listen"].as_array().unwrap()[0].as_str(), Some("tcp/127.0.0.1:1"));
    assert!(effective["planner_threads"].as_integer().unwrap() >= 1);
    let (code, version, _) = run(&["--version"]);
    assert_eq!((code, version.trim()), (0, concat!("pdnd ", env!("CARGO_PKG_VERSION"))));
}

#[test]
fn health_tells_a_ready_daemon_from_none() {
    let mut daemon = Daemon::start(&[]);
    let endpoint = daemon.endpoint.clone();
    let (code, output, error) = run(&["health", "-e", &endpoint]);
    assert_eq!(code, 0, "{output}{error}");
    daemon.signal("TERM");
    assert_eq!(daemon.ended().code(), Some(0));
    let (code, _, error) = run(&["health", "-e", &endpoint, "--timeout-ms", "500"]);
    assert_eq!(code, 1);
    assert!(error.contains(&endpoint), "{error}");
}

#[test]
fn a_state_directory_is_not_shared_and_must_be_writable() {
    let scratch = Scratch::new("state");
    let directory = scratch.0.join("state").display().to_string();
    let mut first = Daemon::start(&["--state-dir", &directory]);
    let (code, _, error) = run(&["-l", "tcp/127.0.0.1:0", "--state-dir", &directory]);
    assert_eq!(code, 3);
    assert!(error.contains("in use by another pdnd"), "{error}");
    first.signal("INT");
    assert_eq!(first.ended().code(), Some(0));
    let _second = Daemon::start(&["--state-dir", &directory]);
    let file = scratch.file("file", "");
    let (code, _, error) = run(&["-l", "tcp/127.0.0.1:0", "--state-dir", &file]);
    assert_eq!(code, 3);
    assert!(error.contains("cannot use the state directory"), "{error}");
}

#[test]
fn a_stop_finishes_what_was_accepted() {
    let mut daemon = Daemon::start(&[]);
    let client = daemon.client();
    let acks = client.subscribe("pdn/hull/v1/out/ack");
    mission::begin(&client, "hull", "m1").unwrap();
    mission::fly(&client, "hull", "m1", 0..100);
    let last = mission::last_seq(100);
    let waits = client.begin("pdn/hull/v1/rpc/decision?after=100000", None);
    let computed = client.begin(&format!("pdn/hull/v1/rpc/graph?after={last};marginals=true"), None);
    // Asked over the same link after the others, so they have been accepted when it is answered.
    client.ask("pdn/hull/v1/rpc/ingest", None).unwrap();
    daemon.signal("TERM");
    let (graph, _) = computed.wait().unwrap();
    let graph: serde_json::Value = serde_json::from_slice(&graph).unwrap();
    assert_eq!(graph["graph_seq"], json!(last + 1));
    assert_eq!(waits.wait().unwrap_err().code, "not_ready");
    acks.wait_for("the last event", |ack| ack["next_seq"] == last + 1);
    assert_eq!(daemon.ended().code(), Some(0));
    daemon.wait_for_line("\"drained\":true");
}
