//! The program itself, on a small survey.

use std::path::PathBuf;
use std::process::Command;

use serde_json::Value;

fn json(arguments: &[&str]) -> Value {
    let run = Command::new(env!("CARGO_BIN_EXE_pdn-perf")).args(arguments).output().expect("it starts");
    assert!(run.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&run.stderr));
    serde_json::from_slice(&run.stdout).expect("it prints JSON")
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().expect("an array").iter().map(|number| number.as_f64().expect("a number")).collect()
}

#[test]
fn a_small_survey_is_streamed_decided_on_and_written() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR"));
    let written = folder.join("survey");
    let written = written.to_str().expect("a path of characters");
    let survey = ["--keyframes", "240", "--salient-percent", "60"];
    let options = ["--candidates", "2,4", "--repeats", "1", "--write", written];
    let found = json(&[&["run"], &survey[..], &options[..]].concat());
    let evaluations = found["evaluations"].as_array().expect("an array");
    assert_eq!(
        evaluations.iter().map(|of| of["candidates"].as_u64()).collect::<Vec<_>>(),
        [Some(2), Some(4)]
    );
    assert!(
        numbers(&found["converged_drift"]).iter().all(|&drift| drift < 1e-6),
        "{}",
        found["converged_drift"]
    );

    // Both trees hold the same matrix.
    let terminals = |tree: usize| found["terminals"][tree].as_array().expect("an array").iter().map(numbers);
    for (at_once, streamed) in terminals(0).zip(terminals(1)) {
        for (place, (one, other)) in at_once.iter().zip(&streamed).enumerate() {
            let scale = (at_once[place / 6 * 7] * at_once[place % 6 * 7]).sqrt();
            assert!((one - other).abs() < 1e-10 * scale, "entry {place}: {one} and {other}");
        }
    }

    for memory in [
        json(&["evaluate-memory", written, "--candidates", "2"]),
        json(&[&["stream-memory"], &survey[..]].concat()),
    ] {
        assert!(memory["peak"].as_f64() >= memory["before"].as_f64(), "{memory}");
    }
}
