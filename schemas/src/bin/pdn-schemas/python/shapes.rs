//! `shapes.py`: what `plain.py` needs to know of every type to read and write it as dicts, lists and numbers.

use super::{attribute, class, import, unformatted};
use crate::contract::{Content, Contract, Field, Shape};
use serde_reflection::Format;

/// The module.
pub fn module(contract: &Contract) -> String {
    let compounds =
        ["array", "choice", "field", "listed", "mapped", "optional", "paired", "record", "union", "variant"];
    let scalars = ["BOOL", "F32", "F64", "STRING", "U32", "U64", "Shape"];
    let imports = import("plain", &compounds) + &import("scalars", &scalars);
    let mut text = format!("from . import messages as m\n{imports}\n");
    for name in contract.names_in_order() {
        let shape = match contract.shape(name) {
            Shape::Struct(fields) => format!("record(m.{name}{})", of_fields(&fields)),
            Shape::Enum(_) if contract.is_choice(name) => format!("choice(m.{name})"),
            Shape::Enum(variants) => {
                let one = |variant: &crate::contract::Variant| {
                    let class = class(variant.name);
                    let of = match &variant.content {
                        Content::Unit => String::new(),
                        Content::One(format) => format!(", single={}", of_format(format)),
                        Content::Fields(fields) => {
                            format!(", fields=record(m.{name}.{class}{})", of_fields(fields))
                        }
                    };
                    format!("\n    variant(\"{}\", m.{name}.{class}{of}),", variant.name)
                };
                format!("union(\"{name}\",{}\n)", variants.iter().map(one).collect::<String>())
            }
        };
        text += &format!("{} = {shape}\n", constant(name));
    }
    text += "\nSHAPES: dict[object, Shape] = {\n";
    for name in contract.names_in_order() {
        text += &format!("    m.{name}: {},\n", constant(name));
        if let (Shape::Enum(variants), false) = (contract.shape(name), contract.is_choice(name)) {
            for variant in variants {
                text += &format!("    m.{name}.{}: {},\n", class(variant.name), constant(name));
            }
        }
    }
    text += "}\n\"\"\"The form of each type; a variant has that of its enum.\"\"\"\n";
    unformatted("The form of every type in JSON.", &text)
}

fn of_fields(fields: &[Field]) -> String {
    let one = |field: &Field| {
        let attribute = attribute(field.name);
        let optional = if field.default.is_some() { ", optional=True" } else { "" };
        format!("\n    field(\"{}\", \"{attribute}\", {}{optional}),", field.name, of_format(field.format))
    };
    if fields.is_empty() {
        return String::new();
    }
    format!(",{}\n", fields.iter().map(one).collect::<String>())
}

fn of_format(format: &Format) -> String {
    match format {
        Format::Bool => "BOOL".to_owned(),
        Format::U32 => "U32".to_owned(),
        Format::U64 => "U64".to_owned(),
        Format::F32 => "F32".to_owned(),
        Format::F64 => "F64".to_owned(),
        Format::Str => "STRING".to_owned(),
        Format::TypeName(name) => constant(name),
        Format::Option(inner) => format!("optional({})", of_format(inner)),
        Format::Seq(inner) => format!("listed({})", of_format(inner)),
        Format::Tuple(parts) => {
            format!("paired({})", parts.iter().map(of_format).collect::<Vec<_>>().join(", "))
        }
        Format::TupleArray { content, size } => format!("array({}, {size})", of_format(content)),
        Format::Map { value, .. } => format!("mapped({})", of_format(value)),
        other => panic!("the Python codec knows no {other:?}"),
    }
}

/// `FactorKind` as `FACTOR_KIND`.
pub fn constant(name: &str) -> String {
    let mut text = String::new();
    for (index, letter) in name.chars().enumerate() {
        if letter.is_uppercase() && index > 0 {
            text.push('_');
        }
        text.extend(letter.to_uppercase());
    }
    text
}
