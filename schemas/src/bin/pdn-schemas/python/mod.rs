//! The generated modules of the Python package `pdn.wire`.

mod binary;
mod messages;
mod names;
mod shapes;

use crate::contract::Contract;
use crate::files::{Files, MEND};
use serde_reflection::Format;

/// Adds the modules.
pub fn add(contract: &Contract, files: &mut Files) {
    let mut add = |module: &str, text: String| files.add(format!("client-py/src/pdn/wire/{module}.py"), text);
    add("messages", messages::module(contract));
    add("binary", binary::module(contract));
    add("shapes", shapes::module(contract));
    add("names", names::module());
    add("limits", names::limits_module());
}

fn header(title: &str) -> String {
    format!("\"\"\"{title}\n\nGenerated from the types in `schemas/src` by `{MEND}`.\n\"\"\"\n\n")
}

/// A module whose lines follow the layout, not a formatter.
fn unformatted(title: &str, body: &str) -> String {
    // ruff refuses both a line that is too long and an exemption that nothing needs.
    let exemption = if body.lines().any(|line| line.len() > WIDTH) { "# ruff: noqa: E501\n" } else { "" };
    format!("{}{exemption}# fmt: off\n\n{body}", header(title))
}

/// An import, one name a line as ruff sorts it.
fn import(module: &str, names: &[&str]) -> String {
    let names: String = names.iter().map(|name| format!("    {name},\n")).collect();
    format!("from .{module} import (\n{names})\n")
}

/// Characters of a line.
const WIDTH: usize = 110;

const RESERVED: &[&str] =
    &["from", "global", "None", "class", "in", "is", "lambda", "pass", "import", "return"];

/// A field as an attribute: words that Python reserves get an underscore.
fn attribute(name: &str) -> String {
    if RESERVED.contains(&name) { format!("{name}_") } else { name.to_owned() }
}

/// A variant as a class: `odometry` is `Odometry`, `none` is `None_`.
fn class(variant: &str) -> String {
    let capital = |word: &str| {
        let (first, rest) = word.split_at(1.min(word.len()));
        first.to_uppercase() + rest
    };
    attribute(&variant.split('_').map(capital).collect::<String>())
}

/// The annotation of a field.
fn annotation(contract: &Contract, format: &Format) -> String {
    let of = |format: &Format| annotation(contract, format);
    match format {
        Format::Bool => "bool".to_owned(),
        Format::U32 | Format::U64 => "int".to_owned(),
        Format::F32 | Format::F64 => "float".to_owned(),
        Format::Str => "str".to_owned(),
        Format::TypeName(name) => value_type(contract, name),
        Format::Option(inner) => format!("{} | None", of(inner)),
        Format::Seq(inner) => format!("tuple[{}, ...]", of(inner)),
        Format::Tuple(parts) => format!("tuple[{}]", parts.iter().map(of).collect::<Vec<_>>().join(", ")),
        Format::TupleArray { content, size } if *size <= 4 => {
            format!("tuple[{}]", vec![of(content); *size].join(", "))
        }
        Format::TupleArray { content, .. } => format!("tuple[{}, ...]", of(content)),
        Format::Map { key, value } => format!("dict[{}, {}]", of(key), of(value)),
        other => panic!("the Python codec knows no {other:?}"),
    }
}

/// The type that a value of a named type has: the class, or the union of an enum's variants.
fn value_type(contract: &Contract, name: &str) -> String {
    let is_union = matches!(contract.registry[name], serde_reflection::ContainerFormat::Enum(_));
    if is_union && !contract.is_choice(name) { format!("Any{name}") } else { name.to_owned() }
}
