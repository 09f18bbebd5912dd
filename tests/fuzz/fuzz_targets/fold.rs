//! A mission and the events that come to it: each is a length (two bytes), a kind (one byte) and a payload.
#![no_main]

use libfuzzer_sys::fuzz_target;
use pdn_schemas::record::Kind;
use pdn_state::{Entry, Limits, Operation, Record, Vehicle};

fuzz_target!(|input: &[u8]| {
    let facet = serde_json::json!({
        "origin": [-1, -1, 10], "u": [0, 1, 0], "v": [1, 0, 0], "length_u_m": 4, "length_v_m": 6
    });
    let config = serde_json::json!({"mission": "m", "target": {"facets": [facet]}});
    let config = serde_json::from_value(config).expect("a configuration");
    let limits = Limits { max_keyframes: 64, max_factors: 256, ..Limits::default() };
    let mut vehicle = Vehicle::new(limits);
    vehicle.configure(config, 1).expect("a valid configuration");
    vehicle.command(None, Operation::Start, "", 2).expect("configured missions can start");
    let (mut rest, mut next_seq) = (input, 0);
    while let [low, high, kind, bytes @ ..] = rest {
        let length = usize::from(u16::from_le_bytes([*low, *high])).min(bytes.len());
        let (payload, after) = bytes.split_at(length);
        rest = after;
        let kind = [Kind::Keyframe, Kind::Factor, Kind::Link, Kind::Unread][usize::from(kind % 4)];
        let record = Record { kind, payload: payload.to_vec() };
        let Ok(Entry::Event(event)) = Entry::read(&record) else { continue };
        let outcome = vehicle.offer(event, length);
        if outcome.mission == "m" {
            assert!(outcome.next_seq >= next_seq);
            next_seq = outcome.next_seq;
        }
    }
    let state = vehicle.mission(None).expect("a mission").state();
    assert!(state.uncertainty.is_none_or(f64::is_finite));
});
