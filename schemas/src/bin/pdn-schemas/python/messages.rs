//! `messages.py`: a frozen struct for each message and each of its parts.

use super::{WIDTH, annotation, attribute, class, header};
use crate::contract::{Content, Contract, Field, Shape, Variant};
use serde_json::Value;
use serde_reflection::Format;

/// The module.
pub fn module(contract: &Contract) -> String {
    let mut text = header("The messages of the contract and what they are made of.");
    text += "# fmt: off\n\nfrom enum import StrEnum\nfrom typing import TypeAlias\n\n\
             from msgspec import Struct\n";
    for name in contract.names_in_order() {
        text += "\n\n";
        match contract.shape(name) {
            Shape::Struct(fields) => {
                structure(contract, 0, name, contract.doc(name), &fields, &mut text);
            }
            Shape::Enum(variants) if contract.is_choice(name) => choice(contract, name, &variants, &mut text),
            Shape::Enum(variants) => union(contract, name, &variants, &mut text),
        }
    }
    text
}

fn choice(contract: &Contract, name: &str, variants: &[Variant], text: &mut String) {
    *text += &format!("class {name}(StrEnum):\n");
    docstring(4, contract.doc(name), text);
    for variant in variants {
        *text += &format!("\n    {} = \"{}\"\n", variant.name.to_uppercase(), variant.name);
        docstring(4, variant.doc, text);
    }
}

fn union(contract: &Contract, name: &str, variants: &[Variant], text: &mut String) {
    *text += &format!("class {name}:\n");
    docstring(4, contract.doc(name), text);
    for variant in variants {
        *text += "\n";
        let class = class(variant.name);
        match &variant.content {
            Content::Unit => structure(contract, 4, &class, variant.doc, &[], text),
            Content::One(format) => {
                let field = Field { name: "value", format, doc: "What the variant holds.", default: None };
                structure(contract, 4, &class, variant.doc, &[field], text);
            }
            Content::Fields(fields) => structure(contract, 4, &class, variant.doc, fields, text),
        }
    }
    let all = variants.iter().map(|variant| format!("{name}.{}", class(variant.name)));
    let all = all.collect::<Vec<_>>().join("\n    | ");
    *text += &format!("\n\nAny{name}: TypeAlias = (\n    {all}\n)\n");
    docstring(0, &format!("A value of {name}."), text);
}

fn structure(contract: &Contract, indent: usize, name: &str, doc: &str, fields: &[Field], text: &mut String) {
    let margin = " ".repeat(indent);
    let first_optional = fields.iter().position(|field| field.default.is_some());
    let mixed = first_optional.is_some_and(|at| fields[at..].iter().any(|field| field.default.is_none()));
    let keywords = if mixed { ", kw_only=True" } else { "" };
    *text += &format!("{margin}class {name}(Struct, frozen=True{keywords}):\n");
    docstring(indent + 4, doc, text);
    for field in fields {
        let default = match &field.default {
            Some(value) => format!(" = {}", expression(contract, field.format, value)),
            None => String::new(),
        };
        let attribute = attribute(field.name);
        let line = format!("{margin}    {attribute}: {}{default}", annotation(contract, field.format));
        *text += &format!("\n{}\n", wrapped_default(&line, indent + 4));
        docstring(indent + 4, field.doc, text);
    }
}

/// A docstring, wrapped.
fn docstring(indent: usize, doc: &str, text: &mut String) {
    let margin = " ".repeat(indent);
    let mut line = format!("{margin}\"\"\"");
    let mut fresh = true;
    for word in doc.split_whitespace() {
        // Three columns are kept for the closing quotes.
        if line.len() + 1 + word.len() + 3 > WIDTH && !fresh {
            *text += &format!("{line}\n");
            line = format!("{margin}{word}");
        } else {
            line += &format!("{}{word}", if fresh { "" } else { " " });
        }
        fresh = false;
    }
    *text += &format!("{line}\"\"\"\n");
}

/// A long default is broken after the commas of its outermost parentheses.
fn wrapped_default(line: &str, indent: usize) -> String {
    if line.len() <= WIDTH {
        return line.to_owned();
    }
    let margin = " ".repeat(indent);
    let default = line.find(" = ").expect("only a default makes a field long");
    let open = default + line[default..].find('(').expect("a long default is a call or a tuple") + 1;
    let mut text = format!("{}\n{margin}    ", &line[..open]);
    let mut depth = 0;
    for letter in line[open..line.len() - 1].chars() {
        match letter {
            '(' => depth += 1,
            ')' => depth -= 1,
            _ => {}
        }
        match (letter, depth) {
            (',', 0) => text += &format!(",\n{margin}   "),
            _ => text.push(letter),
        }
    }
    text + &format!(",\n{margin})")
}

/// A default as a Python expression.
fn expression(contract: &Contract, format: &Format, value: &Value) -> String {
    match (format, value) {
        (_, Value::Null) => "None".to_owned(),
        (_, Value::Bool(flag)) => if *flag { "True" } else { "False" }.to_owned(),
        (Format::Option(inner), value) => expression(contract, inner, value),
        (Format::TypeName(name), value) => named(contract, name, value),
        (Format::Seq(inner), Value::Array(values)) => {
            tuple(values.iter().map(|one| expression(contract, inner, one)))
        }
        (Format::TupleArray { content, .. }, Value::Array(values)) => {
            tuple(values.iter().map(|one| expression(contract, content, one)))
        }
        (_, Value::Number(number)) => number.to_string(),
        (_, Value::String(text)) => format!("{text:?}"),
        (format, value) => panic!("no default {value} of {format:?}"),
    }
}

fn tuple(parts: impl Iterator<Item = String>) -> String {
    let parts: Vec<String> = parts.collect();
    if parts.len() == 1 { format!("({},)", parts[0]) } else { format!("({})", parts.join(", ")) }
}

fn named(contract: &Contract, name: &str, value: &Value) -> String {
    match contract.shape(name) {
        Shape::Struct(fields) => {
            let is_default = |field: &Field| field.default.as_ref() == Some(&value[field.name]);
            let changed = fields.iter().filter(|field| !is_default(field));
            let argument = |field: &Field| {
                format!(
                    "{}={}",
                    attribute(field.name),
                    expression(contract, field.format, &value[field.name])
                )
            };
            format!("{name}({})", changed.map(argument).collect::<Vec<_>>().join(", "))
        }
        Shape::Enum(variants) => {
            let chosen = value.as_str().or_else(|| value.as_object()?.keys().next().map(String::as_str));
            let variant = variants.iter().find(|variant| Some(variant.name) == chosen);
            let variant = variant.expect("a default is one of the variants");
            match &variant.content {
                Content::Unit if contract.is_choice(name) => {
                    format!("{name}.{}", variant.name.to_uppercase())
                }
                Content::Unit => format!("{name}.{}()", class(variant.name)),
                Content::One(format) => {
                    let inner = expression(contract, format, &value[variant.name]);
                    format!("{name}.{}({inner})", class(variant.name))
                }
                Content::Fields(_) => panic!("{name}: no default has fields"),
            }
        }
    }
}
