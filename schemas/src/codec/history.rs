//! What earlier versions wrote stays readable.
//!
//! Each generation of layouts that was ever released stands in `schemas/history/N.json`, and the newest is
//! the present one. A bincode payload of an earlier generation is read by the text of its layout and then
//! taken as the same message in JSON would be: a field that has come since takes its default, or what was so
//! before it came. So a layout may grow by fields that have one, and by variants at the end of an enum;
//! nothing is taken away, renamed or reordered.
//!
//! Reading order: here which generation a layout is of, `layout` (the text of a layout), `value` (a payload
//! by it).

mod layout;
mod value;

use super::{CodecError, Format, Message, MessageVisitor, check_size, encode, visit_messages, visit_records};
use crate::record::Kind;
use crate::registry::{fnv1a, kind_layout_hash, layout_hash};
use layout::Layout;
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::LazyLock;

/// The files of all generations, oldest first.
const FILES: [&str; 2] = [include_str!("../../history/1.json"), include_str!("../../history/2.json")];

/// What was so before a field came that tells it, where that is not the field's default: container, field,
/// value.
const IMPLIED: [(&str, &str, f64); 1] = [("Planner", "max_cluster_radius_m", f64::MAX)];

/// The layouts of all messages and records at one time.
#[derive(Debug)]
pub struct Generation {
    layouts: BTreeMap<String, Layout>,
    hashes: BTreeMap<String, u64>,
    kinds: Vec<String>,
}

/// A file of `schemas/history`.
#[derive(Deserialize)]
struct File {
    /// The name of the record of each kind of the journal, in the order of their numbers.
    kinds: Vec<String>,
    /// The layout of each container, as [`crate::registry::describe`] writes it.
    containers: BTreeMap<String, String>,
}

impl Generation {
    /// All of them, oldest first; the last is the present one.
    pub fn all() -> &'static [Generation] {
        static ALL: LazyLock<Vec<Generation>> = LazyLock::new(|| {
            let read = |text| Generation::parse(text).expect("schemas/history is tested");
            FILES.into_iter().map(read).collect()
        });
        &ALL
    }

    /// The generation in which a message or record had the layout of this hash, other than the present one.
    pub fn earlier_with<T: Message>(hash: u64) -> Option<&'static Generation> {
        let is_other = hash != layout_hash::<T>();
        Generation::all().iter().find(|generation| is_other && generation.hash(T::NAME) == Some(hash))
    }

    /// The hash of the layout that a message or record had; none if there was none of that name.
    pub fn hash(&self, name: &str) -> Option<u64> {
        self.hashes.get(name).copied()
    }

    /// The name of the record of each kind of the journal, in the order of their numbers.
    pub fn kinds(&self) -> &[String] {
        &self.kinds
    }

    /// The message of a bincode payload that was written in this generation.
    ///
    /// # Errors
    /// As [`crate::codec::decode`]; [`CodecError::Json`] if the message has since come to want what was not
    /// written.
    pub fn decode<T: Message>(&self, bytes: &[u8]) -> Result<T, CodecError> {
        check_size::<T>(bytes.len())?;
        let value = value::read(&self.layouts, T::NAME, bytes)?;
        serde_path_to_error::deserialize(value).map_err(|error| CodecError::Json {
            message: T::NAME,
            path: error.path().to_string(),
            reason: error.into_inner().to_string(),
        })
    }

    /// The payload of a record of that kind, written in this generation, as it would be written now.
    ///
    /// # Errors
    /// As [`Generation::decode`].
    pub fn translate(&self, kind: Kind, payload: &[u8]) -> Result<Vec<u8>, CodecError> {
        if self.hash(kind.schema()) == Some(kind_layout_hash(kind)) {
            return Ok(payload.to_vec());
        }
        let mut translation =
            Translation { generation: self, schema: kind.schema(), payload, translated: None };
        visit_messages(&mut translation);
        visit_records(&mut translation);
        translation.translated.expect("the record of every kind is a message")
    }

    fn parse(text: &str) -> Result<Generation, String> {
        let File { kinds, containers } = serde_json::from_str(text).map_err(|error| error.to_string())?;
        let layouts = containers.iter().map(|(name, text)| Ok((name.clone(), Layout::parse(text)?)));
        let layouts = layouts.collect::<Result<BTreeMap<String, Layout>, String>>()?;
        let hash = |name: &String| (name.clone(), fnv1a(&text_of(&containers, &layouts, name)));
        let hashes = containers.keys().map(hash).collect();
        Ok(Generation { layouts, hashes, kinds })
    }
}

/// Finds the message of a name, and translates a payload of it.
struct Translation<'a> {
    generation: &'a Generation,
    schema: &'static str,
    payload: &'a [u8],
    translated: Option<Result<Vec<u8>, CodecError>>,
}

impl MessageVisitor for Translation<'_> {
    fn visit<T: Message>(&mut self) {
        if T::NAME == self.schema {
            let message = self.generation.decode::<T>(self.payload);
            self.translated = Some(message.and_then(|message| encode(&message, Format::Bincode)));
        }
    }
}

/// The text that the hash of a message's layout is taken of: a line for each container that it reaches.
fn text_of(
    containers: &BTreeMap<String, String>,
    layouts: &BTreeMap<String, Layout>,
    message: &str,
) -> String {
    let (mut reached, mut open) = (BTreeSet::new(), vec![message]);
    while let Some(name) = open.pop() {
        if reached.insert(name) {
            layouts[name].visit_names(&mut |inner| open.push(inner));
        }
    }
    reached.into_iter().map(|name| format!("{name}={}\n", containers[name])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::MissionConfig;
    use crate::codec::decode_encoded;
    use serde_json::Value;
    use std::path::Path;

    #[test]
    fn the_newest_generation_is_the_present_one_and_every_file_is_in() {
        struct Present;
        impl MessageVisitor for Present {
            fn visit<T: Message>(&mut self) {
                let newest = Generation::all().last().expect("there is one");
                assert_eq!(newest.hash(T::NAME), Some(layout_hash::<T>()), "{}", T::NAME);
            }
        }
        visit_messages(&mut Present);
        visit_records(&mut Present);
        let kinds: Vec<&str> = Kind::ALL.iter().map(|kind| kind.schema()).collect();
        assert_eq!(Generation::all().last().map(Generation::kinds).unwrap(), kinds);
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("history");
        let is_file = |entry: &std::fs::DirEntry| entry.path().extension().is_some_and(|kind| kind == "json");
        let files = folder.read_dir().unwrap().filter_map(Result::ok).filter(is_file).count();
        assert_eq!(files, FILES.len());
    }

    /// Whatever an earlier generation could say can still be said, by the same names.
    #[test]
    fn layouts_only_grow() {
        let newest = Generation::all().last().unwrap();
        for (generation, number) in Generation::all().iter().zip(1..) {
            for (name, earlier) in &generation.layouts {
                let present =
                    newest.layouts.get(name).unwrap_or_else(|| panic!("{name} of {number} is gone"));
                assert!(present.includes(earlier), "{name} of {number} cannot be read as what it is now");
            }
        }
    }

    /// Reading by the text of a layout is another way to the same message: the golden vectors hold it to the
    /// first.
    #[test]
    fn a_payload_read_by_the_text_of_its_layout_is_the_message() {
        struct Vectors(usize);
        impl MessageVisitor for Vectors {
            fn visit<T: Message>(&mut self) {
                let newest = Generation::all().last().unwrap();
                let golden = Path::new(env!("CARGO_MANIFEST_DIR")).join("generated/golden");
                for entry in golden.read_dir().unwrap() {
                    let path = entry.unwrap().path();
                    let stem = path.file_stem().unwrap().to_str().unwrap().to_owned();
                    if path.extension().unwrap() != "bin" || stem.split('-').next() != Some(T::NAME) {
                        continue;
                    }
                    let bytes = std::fs::read(&path).unwrap();
                    let message: T = newest.decode(&bytes).unwrap_or_else(|error| panic!("{stem}: {error}"));
                    assert_eq!(encode(&message, Format::Bincode).unwrap(), bytes, "{stem}");
                    for end in 0..bytes.len() {
                        assert!(newest.decode::<T>(&bytes[..end]).is_err(), "{stem} cut to {end} bytes");
                    }
                    self.0 += 1;
                }
            }
        }
        let mut vectors = Vectors(0);
        visit_messages(&mut vectors);
        assert!(vectors.0 > 20, "{} vectors", vectors.0);
    }

    /// Of a value what another of an earlier generation has a field for.
    fn known_to(earlier: &Value, value: &Value) -> Value {
        match (earlier, value) {
            (Value::Object(earlier), Value::Object(fields)) => {
                let known = earlier.iter().map(|(name, one)| (name.clone(), known_to(one, &fields[name])));
                Value::Object(known.collect())
            }
            _ => value.clone(),
        }
    }

    #[test]
    fn what_has_come_since_is_as_it_was() {
        let bytes = include_bytes!("../../history/1/MissionConfig-default.bin");
        let hash = Generation::all()[0].hash("MissionConfig").unwrap();
        let encoding = format!("application/octet-stream;pdn.v1.MissionConfig+bincode#{hash:016x}");
        let config: MissionConfig = decode_encoded(bytes, &encoding).unwrap();
        assert_eq!(config.gate_sigmas, Some(20.0));
        assert_eq!(config.planner.max_cluster_radius_m, Some(f64::MAX));
        let unknown = format!("application/octet-stream;pdn.v1.MissionConfig+bincode#{:016x}", hash ^ 1);
        let refused = decode_encoded::<MissionConfig>(bytes, &unknown);
        assert!(matches!(refused, Err(CodecError::OtherLayout { .. })), "{refused:?}");
    }

    /// `history/N/` has vectors of generation N of those messages that have grown since.
    #[test]
    fn what_earlier_generations_wrote_is_read() {
        struct Earlier(usize);
        impl MessageVisitor for Earlier {
            fn visit<T: Message>(&mut self) {
                for (generation, number) in Generation::all().iter().zip(1..) {
                    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("history/{number}"));
                    let Ok(entries) = folder.read_dir() else { continue };
                    for path in entries.map(|entry| entry.unwrap().path()) {
                        let stem = path.file_stem().unwrap().to_str().unwrap().to_owned();
                        let is_of = stem.split('-').next() == Some(T::NAME);
                        if !is_of || path.extension().is_none_or(|kind| kind != "bin") {
                            continue;
                        }
                        let message: T = generation.decode(&std::fs::read(&path).unwrap()).unwrap();
                        let said = std::fs::read(path.with_extension("json")).unwrap();
                        let said: Value = serde_json::from_slice(&said).unwrap();
                        assert_eq!(known_to(&said, &serde_json::to_value(message).unwrap()), said, "{stem}");
                        self.0 += 1;
                    }
                }
            }
        }
        let mut earlier = Earlier(0);
        visit_messages(&mut earlier);
        visit_records(&mut earlier);
        assert!(earlier.0 > 0 || FILES.len() == 1, "earlier generations have no vectors");
    }
}
