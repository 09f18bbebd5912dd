//! The golden vectors, read and written byte for byte, and what becomes of them when they are damaged.

use pdn_schemas::codec::{CodecError, Format, Message, MessageVisitor, decode, encode, visit_messages};
use pdn_schemas::problem::Code;
use serde_json::Value;
use std::fs;
use std::path::Path;

/// A golden vector in both formats.
struct Vector {
    case: String,
    bincode: Vec<u8>,
    json: Vec<u8>,
}

fn vectors<T: Message>() -> Vec<Vector> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("generated/golden");
    let prefix = format!("{}-", T::NAME);
    let mut cases: Vec<String> = fs::read_dir(&folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter_map(|name| {
            Some(name.strip_suffix(".bin")?.to_owned()).filter(|name| name.starts_with(&prefix))
        })
        .collect();
    cases.sort();
    let read = |case: String| Vector {
        bincode: fs::read(folder.join(format!("{case}.bin"))).unwrap(),
        json: fs::read(folder.join(format!("{case}.json"))).unwrap(),
        case,
    };
    cases.into_iter().map(read).collect()
}

#[test]
fn every_vector_is_read_and_written_byte_for_byte() {
    struct RoundTrip;
    impl MessageVisitor for RoundTrip {
        fn visit<T: Message>(&mut self) {
            let vectors = vectors::<T>();
            assert!(vectors.len() >= 2, "{} has golden vectors", T::NAME);
            for Vector { case, bincode, json } in vectors {
                let message: T =
                    decode(&bincode, Format::Bincode).unwrap_or_else(|error| panic!("{case}: {error}"));
                assert_eq!(decode::<T>(&json, Format::Json).as_ref(), Ok(&message), "{case}");
                assert_eq!(encode(&message, Format::Bincode).unwrap(), bincode, "{case}");
                assert_eq!(encode(&message, Format::Json).unwrap(), json, "{case}");
            }
        }
    }
    visit_messages(&mut RoundTrip);
}

#[test]
fn every_truncation_and_every_trailing_byte_is_refused() {
    struct Truncate;
    impl MessageVisitor for Truncate {
        fn visit<T: Message>(&mut self) {
            for Vector { case, bincode, json } in vectors::<T>() {
                for end in 0..bincode.len() {
                    let refusal = decode::<T>(&bincode[..end], Format::Bincode).unwrap_err();
                    assert_eq!(refusal.code(), Code::Invalid, "{case} at {end}: {refusal}");
                }
                // A JSON object is whole at its last byte only.
                for end in (0..json.len()).step_by(1 + json.len() / 200) {
                    assert!(decode::<T>(&json[..end], Format::Json).is_err(), "{case} at {end}");
                }
                let longer = [&bincode[..], &[0]].concat();
                let trailing = decode::<T>(&longer, Format::Bincode).unwrap_err();
                assert!(matches!(trailing, CodecError::Trailing { .. }), "{case}: {trailing}");
                assert!(decode::<T>(&[&json[..], b"{}"].concat(), Format::Json).is_err(), "{case}");
            }
        }
    }
    visit_messages(&mut Truncate);
}

#[test]
fn a_flipped_bit_gives_a_refusal_or_another_message_and_never_a_panic() {
    struct Flip;
    impl MessageVisitor for Flip {
        fn visit<T: Message>(&mut self) {
            for Vector { bincode, json, .. } in vectors::<T>() {
                for (bytes, format) in [(bincode, Format::Bincode), (json, Format::Json)] {
                    // At most 4000 flips a vector, spread over all of it.
                    for bit in (0..bytes.len() * 8).step_by(1 + bytes.len() * 8 / 4000) {
                        let mut damaged = bytes.clone();
                        damaged[bit / 8] ^= 1 << (bit % 8);
                        if let (Ok(message), Format::Bincode) = (decode::<T>(&damaged, format), format) {
                            // What is read is written as it was: nothing is passed over. Maps are sorted when
                            // written, so only their length is compared.
                            let written = encode(&message, Format::Bincode).unwrap();
                            assert_eq!(written.len(), damaged.len());
                            assert!(written == damaged || T::NAME == "GraphReply");
                        }
                    }
                }
            }
        }
    }
    visit_messages(&mut Flip);
}

#[test]
fn an_unknown_field_is_refused_at_every_level() {
    struct Intrude {
        refused: usize,
    }
    impl MessageVisitor for Intrude {
        fn visit<T: Message>(&mut self) {
            for Vector { case, json, .. } in vectors::<T>() {
                let clean: Value = serde_json::from_slice(&json).unwrap();
                for place in 0..objects(&clean, T::NAME) {
                    let mut dirty = clean.clone();
                    intrude(&mut dirty, &mut { place }, T::NAME);
                    let refusal = decode::<T>(dirty.to_string().as_bytes(), Format::Json);
                    let Err(refusal) = refusal else { panic!("{case}: accepted {dirty}") };
                    assert_eq!(refusal.code(), Code::Invalid);
                    self.refused += 1;
                }
            }
        }
    }
    let mut intrude = Intrude { refused: 0 };
    visit_messages(&mut intrude);
    assert!(intrude.refused > 250, "{} intrusions tried", intrude.refused);
}

/// Objects in a value that have fields; the map of `GraphReply` has free keys instead.
fn objects(value: &Value, message: &str) -> usize {
    match value {
        Value::Array(values) => values.iter().map(|value| objects(value, message)).sum(),
        Value::Object(fields) => {
            let inside = fields.iter().filter(|(name, _)| !(message == "GraphReply" && *name == "factors"));
            1 + inside.map(|(_, value)| objects(value, message)).sum::<usize>()
        }
        _ => 0,
    }
}

/// Adds a field to the object that `place` counts down to.
fn intrude(value: &mut Value, place: &mut usize, message: &str) -> bool {
    match value {
        Value::Array(values) => values.iter_mut().any(|value| intrude(value, place, message)),
        Value::Object(fields) => {
            if *place == 0 {
                fields.insert("intruder".into(), Value::Null);
                return true;
            }
            *place -= 1;
            let inside =
                fields.iter_mut().filter(|(name, _)| !(message == "GraphReply" && *name == "factors"));
            inside.into_iter().any(|(_, value)| intrude(value, place, message))
        }
        _ => false,
    }
}
