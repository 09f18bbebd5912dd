//! Payloads made to hurt: too large, or claiming lengths that they do not have.

use pdn_schemas::codec::{CodecError, Format, decode, encode};
use pdn_schemas::command::{Command, EvaluateRequest};
use pdn_schemas::event::{Appearance, Factor, FactorKind, Keyframe};
use pdn_schemas::limits::MAX_REQUEST_BYTES;
use pdn_schemas::problem::Code;
use pdn_schemas::reply::IngestStatus;

/// Address space that the process has had at most, in bytes.
fn peak_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("the tests run on Linux");
    let line = status.lines().find_map(|line| line.strip_prefix("VmPeak:")).expect("Linux tells the peak");
    line.trim().trim_end_matches(" kB").trim().parse::<u64>().expect("a number of kB") * 1024
}

/// Allows for the stacks and allocation arenas (64 MiB of addresses each) of the threads that run the tests.
const NOISE_BYTES: u64 = 1 << 30;

fn keyframe(appearance: Appearance) -> Keyframe {
    Keyframe { mission: "m".into(), seq: 0, stamp_ns: 0, id: 0, pose: None, camera: None, appearance }
}

#[test]
fn ten_megabytes_are_refused_before_they_are_looked_at() {
    let payload = vec![b' '; 10_000_000];
    for format in [Format::Json, Format::Bincode] {
        let refusal = decode::<Keyframe>(&payload, format).unwrap_err();
        assert_eq!(refusal.code(), Code::TooLarge);
        let expected =
            CodecError::TooLarge { message: "Keyframe", bytes: 10_000_000, limit: MAX_REQUEST_BYTES };
        assert_eq!(refusal, expected);
    }
    let long = Command { reason: "x".repeat(MAX_REQUEST_BYTES) };
    assert_eq!(encode(&long, Format::Bincode).unwrap_err().code(), Code::TooLarge);
}

#[test]
fn a_length_that_lies_takes_no_memory() {
    // Where the length of a list stands in each payload, from its end.
    let words = encode(&keyframe(Appearance::Words(vec![])), Format::Bincode).unwrap();
    let values = keyframe(Appearance::Descriptors { dim: 1, values: vec![] });
    let descriptors = encode(&values, Format::Bincode).unwrap();
    let paths = encode(&EvaluateRequest { paths: vec![] }, Format::Bincode).unwrap();
    let status = IngestStatus {
        mission: "m".into(),
        next_seq: 0,
        durable_seq: 0,
        buffered: 0,
        missing: vec![],
        rejected: 0,
    };
    let status = encode(&status, Format::Bincode).unwrap();
    let patched = |bytes: &[u8], at: usize, length: u64| {
        let mut bytes = bytes.to_vec();
        bytes[at..at + 8].copy_from_slice(&length.to_le_bytes());
        bytes
    };
    let before = peak_bytes();
    for length in [1, 1000, u64::from(u32::MAX), 1 << 33, 1 << 40, u64::MAX / 8, u64::MAX - 1, u64::MAX] {
        let end = words.len() - 8;
        assert!(decode::<Keyframe>(&patched(&words, end, length), Format::Bincode).is_err());
        let end = descriptors.len() - 8;
        assert!(decode::<Keyframe>(&patched(&descriptors, end, length), Format::Bincode).is_err());
        assert!(decode::<EvaluateRequest>(&patched(&paths, 0, length), Format::Bincode).is_err());
        let end = status.len() - 16;
        assert!(decode::<IngestStatus>(&patched(&status, end, length), Format::Bincode).is_err());
        assert!(decode::<Keyframe>(&patched(&words, 0, length), Format::Bincode).is_err() || length == 1);
    }
    let grown = peak_bytes() - before;
    assert!(grown < NOISE_BYTES, "{grown} bytes were taken on the word of a length");
}

#[test]
fn deep_json_is_refused_without_recursion() {
    let deep = "[".repeat(1_000_000);
    for text in [deep.clone(), format!("{{\"paths\":{deep}"), format!("{{\"other\":{deep}")] {
        assert_eq!(
            decode::<EvaluateRequest>(text.as_bytes(), Format::Json).unwrap_err().code(),
            Code::Invalid
        );
    }
}

#[test]
fn json_has_no_form_for_what_is_not_finite() {
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let kind = FactorKind::Attitude {
            keyframe: 0,
            rotation: [0.0, 0.0, value, 1.0],
            tilt_variance_rad2: 1.0,
            heading_variance_rad2: None,
        };
        let factor = Factor { mission: "m".into(), seq: 0, stamp_ns: 0, factor: kind };
        let path = "factor.attitude.rotation[2]".to_owned();
        assert_eq!(encode(&factor, Format::Json), Err(CodecError::NotFinite { message: "Factor", path }));
        assert!(encode(&factor, Format::Bincode).is_ok(), "bincode carries it, for the service to refuse");
    }
}

#[test]
fn a_refusal_of_json_names_the_place() {
    let text = r#"{"mission":"m","seq":0,"stamp_ns":0,
        "factor":{"depth":{"keyframe":1,"depth_m":"deep","variance_m2":1}}}"#;
    let refusal = decode::<Factor>(text.as_bytes(), Format::Json).unwrap_err().to_string();
    assert!(refusal.contains("factor.depth.depth_m"), "{refusal}");
    let text = r#"{"mission":"m","seq":0,"stamp_ns":0,
        "factor":{"depth":{"keyframe":1,"depth_m":1e999,"variance_m2":1}}}"#;
    assert!(decode::<Factor>(text.as_bytes(), Format::Json).is_err(), "a number beyond its type");
}
