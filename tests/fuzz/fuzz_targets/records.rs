//! A record of a journal: the first byte is its kind.
#![no_main]

use libfuzzer_sys::fuzz_target;
use pdn_schemas::record::Kind;
use pdn_state::{Entry, Record};

fuzz_target!(|input: &[u8]| {
    let Some((&first, payload)) = input.split_first() else { return };
    let Some(kind) = Kind::from_number(u32::from(first)) else { return };
    if let Ok(entry) = Entry::read(&Record { kind, payload: payload.to_vec() }) {
        let _ = entry.record();
    }
});
