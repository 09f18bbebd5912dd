//! `binary.py`: reads and writes bincode. Neighbouring fields of fixed size become one precompiled
//! `struct.Struct`, which is what makes it quick: a factor with its covariance is three of them.

mod reading;
mod writing;

use super::shapes::constant;
use super::{class, import, unformatted};
use crate::contract::{Content, Contract, Shape, Variant};
use pdn_schemas::registry::message_names;
use serde_reflection::{ContainerFormat, Format};

/// The module.
pub fn module(contract: &Contract) -> String {
    let mut code = Code { contract, layouts: Vec::new(), lines: String::new(), depth: 0, variables: 0 };
    for name in contract.names_in_order() {
        match contract.shape(name) {
            Shape::Enum(variants) if contract.is_choice(name) => choice(name, &variants, &mut code),
            Shape::Enum(variants) => union(name, &variants, &mut code),
            Shape::Struct(_) if code.is_fixed_type(name) && !message_names().contains(&name) => {}
            Shape::Struct(fields) => {
                let fields: Vec<_> = fields.iter().map(|field| (field.name, field.format)).collect();
                code.write_function(&snake(name), &format!("m.{name}"), None, &fields);
                code.read_function(&snake(name), &format!("m.{name}"), &fields);
            }
        }
    }
    for (table, kind, function) in [
        ("WRITERS", "Callable[[bytearray, Any], None]", "write"),
        ("READERS", "Callable[[bytes, int], tuple[Any, int]]", "read"),
    ] {
        code.line(&format!("{table}: dict[type, {kind}] = {{"));
        for name in message_names() {
            code.line(&format!("    m.{name}: {function}_{},", snake(name)));
        }
        code.line("}");
        code.line("");
    }
    let names = [
        "boolean",
        "count",
        "flag",
        "length",
        "one_of",
        "read_run",
        "read_string",
        "run",
        "string",
        "unknown_variant",
        "wrong_sizes",
    ];
    let mut text = format!(
        "from collections.abc import Callable\nfrom struct import Struct\nfrom typing import Any\n\n\
         from . import messages as m\n{}\n",
        import("primitives", &names)
    );
    for (index, layout) in code.layouts.iter().enumerate() {
        text += &format!("_S{index} = Struct(\"<{layout}\")\n");
    }
    text += "\n";
    text += code.lines.trim_end();
    text.push('\n');
    unformatted("The messages in bincode: little-endian, 64-bit lengths, 32-bit variant tags.", &text)
}

fn choice(name: &str, variants: &[Variant], code: &mut Code) {
    let members = variants.iter().map(|variant| format!("m.{name}.{}", variant.name.to_uppercase()));
    let members = members.collect::<Vec<_>>().join(", ");
    let constant = constant(name);
    code.line(&format!("_{constant} = ({members},)"));
    code.line(&format!("_{constant}_TAG = {{value: tag for tag, value in enumerate(_{constant})}}"));
    code.line("");
    code.line("");
}

fn union(name: &str, variants: &[Variant], code: &mut Code) {
    let (snake, constant) = (snake(name), constant(name));
    for variant in variants {
        let kind = format!("m.{name}.{}", class(variant.name));
        let function = format!("{snake}_{}", variant.name);
        let fields = match &variant.content {
            Content::Unit => Vec::new(),
            Content::One(format) => vec![("value", *format)],
            Content::Fields(fields) => fields.iter().map(|field| (field.name, field.format)).collect(),
        };
        code.write_function(&function, &kind, Some(variant.tag), &fields);
        code.read_function(&function, &kind, &fields);
    }
    code.line(&format!("_WRITE_{constant}: dict[type, Callable[[bytearray, Any], None]] = {{"));
    for variant in variants {
        code.line(&format!("    m.{name}.{}: write_{snake}_{},", class(variant.name), variant.name));
    }
    code.line("}");
    code.line(&format!("_READ_{constant}: tuple[Callable[[bytes, int], tuple[m.Any{name}, int]], ...] = ("));
    for variant in variants {
        code.line(&format!("    read_{snake}_{},", variant.name));
    }
    code.line(")");
    code.line("");
    code.line("");
    let tag = code.layout("I");
    let lines = format!(
        "def write_{snake}(out: bytearray, v: m.Any{name}) -> None:\n    \
         _WRITE_{constant}[type(v)](out, v)\n\n\n\
         def read_{snake}(b: bytes, i: int) -> tuple[m.Any{name}, int]:\n    \
         tag: int = {tag}.unpack_from(b, i)[0]\n    \
         if tag >= {count}:\n        raise unknown_variant(\"{name}\", tag, {count})\n    \
         return _READ_{constant}[tag](b, i + 4)\n\n",
        count = variants.len()
    );
    lines.lines().for_each(|line| code.line(line));
    code.line("");
}

/// Python code in the making.
struct Code<'a> {
    contract: &'a Contract,
    /// Format strings of the precompiled structs.
    layouts: Vec<String>,
    lines: String,
    depth: usize,
    variables: usize,
}

impl Code<'_> {
    fn line(&mut self, line: &str) {
        if !line.is_empty() {
            self.lines += &"    ".repeat(self.depth);
            self.lines += line;
        }
        self.lines.push('\n');
    }

    /// The name of a precompiled struct.
    fn layout(&mut self, layout: &str) -> String {
        let index = self.layouts.iter().position(|known| known == layout).unwrap_or_else(|| {
            self.layouts.push(layout.to_owned());
            self.layouts.len() - 1
        });
        format!("_S{index}")
    }

    fn variable(&mut self) -> String {
        self.variables += 1;
        format!("x{}", self.variables)
    }

    fn is_fixed_type(&self, name: &str) -> bool {
        match &self.contract.registry[name] {
            ContainerFormat::Struct(fields) => fields.iter().all(|field| self.is_fixed(&field.value)),
            _ => self.contract.is_choice(name),
        }
    }

    /// Whether every value takes the same number of bytes.
    fn is_fixed(&self, format: &Format) -> bool {
        match format {
            Format::TypeName(name) => self.is_fixed_type(name),
            Format::Tuple(parts) => parts.iter().all(|part| self.is_fixed(part)),
            Format::TupleArray { content, .. } => self.is_fixed(content),
            other => primitive(other).is_some(),
        }
    }

    /// The fields of a struct, by name.
    fn fields_of(&self, name: &str) -> Vec<(String, Format)> {
        match &self.contract.registry[name] {
            ContainerFormat::Struct(fields) => {
                fields.iter().map(|field| (field.name.clone(), field.value.clone())).collect()
            }
            other => panic!("{name} is no struct but {other:?}"),
        }
    }
}

/// The letter of `struct` and the bytes of a primitive type. A bool is read as a byte, to refuse 2.
fn primitive(format: &Format) -> Option<(&'static str, usize)> {
    match format {
        Format::Bool => Some(("B", 1)),
        Format::U32 => Some(("I", 4)),
        Format::U64 => Some(("Q", 8)),
        Format::F32 => Some(("f", 4)),
        Format::F64 => Some(("d", 8)),
        _ => None,
    }
}

/// `FactorKind` as `factor_kind`.
fn snake(name: &str) -> String {
    constant(name).to_lowercase()
}
