//! The layout of every message, extracted from the types themselves, and its hash.
//!
//! The hash of a message is FNV-1a (64 bits) over the lines `Name=layout\n` of the containers that the
//! message reaches, itself included, sorted by name; [`describe`] writes a layout. It changes exactly when
//! the bytes or the names of fields and variants change, and not with docs or defaults.

use crate::config::{Criterion, Loss};
use crate::event::{Appearance, FactorKind};
use crate::message::{Message, MessageVisitor, visit_messages, visit_records};
use crate::record::Kind;
use crate::reply::{Action, Phase, Policy};
use serde::de::DeserializeOwned;
use serde_reflection::{
    ContainerFormat, Format, FormatHolder, Named, Registry, Tracer, TracerConfig, VariantFormat,
};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::LazyLock;

/// Every container that a message reaches, by name; takes about a millisecond.
pub fn registry() -> Registry {
    traced(visit_messages)
}

/// Every container that a message or a record of the journal reaches, by name.
pub fn journal_registry() -> Registry {
    traced(|trace| {
        visit_messages(trace);
        visit_records(trace);
    })
}

struct Trace(Tracer);

impl Trace {
    fn of<T: DeserializeOwned>(&mut self) {
        self.0.trace_simple_type::<T>().expect("every type of the contract describes itself");
    }
}

impl MessageVisitor for Trace {
    fn visit<T: Message>(&mut self) {
        self.of::<T>();
    }
}

fn traced(visit: impl FnOnce(&mut Trace)) -> Registry {
    let mut trace = Trace(Tracer::new(TracerConfig::default()));
    // An enum within a message is only followed along one variant, so each is traced by itself first.
    trace.of::<Appearance>();
    trace.of::<FactorKind>();
    trace.of::<Criterion>();
    trace.of::<Loss>();
    trace.of::<Phase>();
    trace.of::<Action>();
    trace.of::<Policy>();
    visit(&mut trace);
    trace.0.registry().expect("every enum of the contract is traced above")
}

struct Names(Vec<&'static str>);

impl MessageVisitor for Names {
    fn visit<T: Message>(&mut self) {
        self.0.push(T::NAME);
    }
}

/// The names of the messages, in the order of `schemas/messages.md`.
pub fn message_names() -> Vec<&'static str> {
    let mut names = Names(Vec::new());
    visit_messages(&mut names);
    names.0
}

/// The names of the records that the journal keeps besides messages, in the order of `schemas/journal.md`.
pub fn record_names() -> Vec<&'static str> {
    let mut names = Names(Vec::new());
    visit_records(&mut names);
    names.0
}

/// The hash of the layout of a message (the sixteen hexadecimal digits after the `#` of its encoding) or
/// record.
pub fn layout_hash<T: Message>() -> u64 {
    all_hashes()[T::NAME]
}

/// The hash of every message, by name.
pub fn layout_hashes() -> BTreeMap<&'static str, u64> {
    message_names().into_iter().map(|name| (name, all_hashes()[name])).collect()
}

/// The hash of the layout of what the journal's records of a kind hold.
pub fn kind_layout_hash(kind: Kind) -> u64 {
    all_hashes()[kind.schema()]
}

fn all_hashes() -> &'static BTreeMap<&'static str, u64> {
    static HASHES: LazyLock<BTreeMap<&'static str, u64>> = LazyLock::new(|| {
        let registry = journal_registry();
        let hash = |name| (name, fnv1a(&layout_text(&registry, name)));
        message_names().into_iter().chain(record_names()).map(hash).collect()
    });
    &HASHES
}

/// The text that a message's hash is taken of.
pub fn layout_text(registry: &Registry, message: &str) -> String {
    let line = |name: String| format!("{name}={}\n", describe(&registry[&name]));
    reached(registry, message).into_iter().map(line).collect()
}

/// The containers that a message reaches, itself included.
pub fn reached(registry: &Registry, message: &str) -> BTreeSet<String> {
    let mut reached = BTreeSet::new();
    let mut open = vec![message.to_owned()];
    while let Some(name) = open.pop() {
        if reached.contains(&name) {
            continue;
        }
        let mut found = Vec::new();
        registry[&name]
            .visit(&mut |format| {
                if let Format::TypeName(name) = format {
                    found.push(name.clone());
                }
                Ok(())
            })
            .expect("a finished registry has no open variables");
        open.append(&mut found);
        reached.insert(name);
    }
    reached
}

/// A layout in one line: `{field:u64,other:[f64;3]}` for a struct, `<0:name,1:name{...}>` for an enum.
pub fn describe(container: &ContainerFormat) -> String {
    match container {
        ContainerFormat::UnitStruct => "()".to_owned(),
        ContainerFormat::NewTypeStruct(inner) => describe_format(inner),
        ContainerFormat::TupleStruct(parts) => describe_tuple(parts),
        ContainerFormat::Struct(fields) => describe_fields(fields),
        ContainerFormat::Enum(variants) => {
            let one = |(tag, variant): (&u32, &Named<VariantFormat>)| {
                format!("{tag}:{}{}", variant.name, describe_variant(&variant.value))
            };
            format!("<{}>", variants.iter().map(one).collect::<Vec<_>>().join(","))
        }
    }
}

fn describe_variant(variant: &VariantFormat) -> String {
    match variant {
        VariantFormat::Variable(_) | VariantFormat::Unit => String::new(),
        VariantFormat::NewType(inner) => format!("({})", describe_format(inner)),
        VariantFormat::Tuple(parts) => describe_tuple(parts),
        VariantFormat::Struct(fields) => describe_fields(fields),
    }
}

fn describe_fields(fields: &[Named<Format>]) -> String {
    let one = |field: &Named<Format>| format!("{}:{}", field.name, describe_format(&field.value));
    format!("{{{}}}", fields.iter().map(one).collect::<Vec<_>>().join(","))
}

fn describe_tuple(parts: &[Format]) -> String {
    format!("({})", parts.iter().map(describe_format).collect::<Vec<_>>().join(","))
}

/// The type of a field: `u64`, `string`, `[f64;3]`, `f64?` (optional), `u64*` (list), `(u32,f64)`,
/// `{string:u64}`, or the name of a container.
pub fn describe_format(format: &Format) -> String {
    match format {
        Format::Variable(_) => "?".to_owned(),
        Format::TypeName(name) => name.clone(),
        Format::Unit => "()".to_owned(),
        Format::Bool => "bool".to_owned(),
        Format::I8 => "i8".to_owned(),
        Format::I16 => "i16".to_owned(),
        Format::I32 => "i32".to_owned(),
        Format::I64 => "i64".to_owned(),
        Format::I128 => "i128".to_owned(),
        Format::U8 => "u8".to_owned(),
        Format::U16 => "u16".to_owned(),
        Format::U32 => "u32".to_owned(),
        Format::U64 => "u64".to_owned(),
        Format::U128 => "u128".to_owned(),
        Format::F32 => "f32".to_owned(),
        Format::F64 => "f64".to_owned(),
        Format::Char => "char".to_owned(),
        Format::Str => "string".to_owned(),
        Format::Bytes => "bytes".to_owned(),
        Format::Option(inner) => format!("{}?", describe_format(inner)),
        Format::Seq(inner) => format!("{}*", describe_format(inner)),
        Format::Map { key, value } => format!("{{{}:{}}}", describe_format(key), describe_format(value)),
        Format::Tuple(parts) => describe_tuple(parts),
        Format::TupleArray { content, size } => format!("[{};{size}]", describe_format(content)),
    }
}

pub(crate) fn fnv1a(text: &str) -> u64 {
    text.bytes()
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::event::{Keyframe, LinkOutcome};

    #[test]
    fn a_hash_is_fnv1a_of_the_layout() {
        // Published test vectors of FNV-1a, 64 bits.
        assert_eq!(fnv1a(""), 0xcbf29ce484222325);
        assert_eq!(fnv1a("foobar"), 0x85944171f73967e8);
        let text = "LinkOutcome={mission:string,seq:u64,stamp_ns:u64,from:u64,to:u64,registered:bool}\n";
        assert_eq!(layout_text(&registry(), "LinkOutcome"), text);
        assert_eq!(layout_hash::<LinkOutcome>(), fnv1a(text));
    }

    #[test]
    fn a_layout_includes_what_it_reaches() {
        let names: Vec<String> = reached(&registry(), "Keyframe").into_iter().collect();
        assert_eq!(names, ["Appearance", "Keyframe", "Pose"]);
        assert!(
            layout_text(&registry(), "Keyframe").contains("Pose={translation:[f64;3],rotation:[f64;4]}\n")
        );
        assert_ne!(layout_hash::<Keyframe>(), layout_hash::<LinkOutcome>());
    }
}
