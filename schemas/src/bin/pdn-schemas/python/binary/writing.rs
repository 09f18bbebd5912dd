//! The functions that write.

use super::super::attribute;
use super::super::shapes::constant;
use super::{Code, primitive, snake};
use serde_reflection::Format;

/// Fields that will be packed by one `struct.Struct`.
#[derive(Default)]
struct Pending {
    layout: String,
    arguments: Vec<String>,
    /// Arrays among the arguments, and their sizes.
    arrays: Vec<(String, usize)>,
}

impl Pending {
    fn push(&mut self, letters: &str, argument: String) {
        self.layout += letters;
        self.arguments.push(argument);
    }
}

impl Code<'_> {
    /// `write_<name>`, which begins with the tag if it is of a variant.
    pub(super) fn write_function(
        &mut self,
        name: &str,
        kind: &str,
        tag: Option<u32>,
        fields: &[(&str, &Format)],
    ) {
        let unused = if fields.is_empty() { "_" } else { "v" };
        self.line(&format!("def write_{name}(out: bytearray, {unused}: {kind}) -> None:"));
        self.depth += 1;
        let mut pending = Pending::default();
        if let Some(tag) = tag {
            pending.push("I", tag.to_string());
        }
        for (field, format) in fields {
            self.write(format, &format!("v.{}", attribute(field)), &mut pending);
        }
        self.flush_writing(&mut pending);
        self.depth -= 1;
        self.line("");
        self.line("");
    }

    fn flush_writing(&mut self, pending: &mut Pending) {
        let Pending { layout, arguments, arrays } = std::mem::take(pending);
        if !arguments.is_empty() {
            // `pack` compares the number of all values with the layout: of several arrays, one too long could
            // make up for one too short.
            if let Some((_, others)) = arrays.split_last().filter(|(_, others)| !others.is_empty()) {
                let wrong = others.iter().map(|(array, size)| format!("len({array}) != {size}"));
                self.line(&format!("if {}:", wrong.collect::<Vec<_>>().join(" or ")));
                self.line("    raise wrong_sizes()");
            }
            let layout = self.layout(&layout);
            self.line(&format!("out += {layout}.pack({})", arguments.join(", ")));
        }
    }

    fn write(&mut self, format: &Format, value: &str, pending: &mut Pending) {
        match format {
            Format::TypeName(name) if self.contract.is_choice(name) => {
                pending.push("I", format!("_{}_TAG[{value}]", constant(name)));
            }
            Format::TypeName(name) if self.is_fixed_type(name) => {
                for (field, format) in self.fields_of(name) {
                    self.write(&format, &format!("{value}.{}", attribute(&field)), pending);
                }
            }
            Format::Tuple(parts) => {
                for (index, part) in parts.iter().enumerate() {
                    self.write(part, &format!("{value}[{index}]"), pending);
                }
            }
            Format::TupleArray { content, size } => {
                let (letter, _) = primitive(content).expect("the contract's arrays hold numbers");
                pending.push(&format!("{size}{letter}"), format!("*{value}"));
                pending.arrays.push((value.to_owned(), *size));
            }
            Format::TypeName(name) => {
                self.flush_writing(pending);
                self.line(&format!("write_{}(out, {value})", snake(name)));
            }
            Format::Str => {
                self.flush_writing(pending);
                self.line(&format!("string(out, {value})"));
            }
            Format::Option(inner) => {
                self.flush_writing(pending);
                self.write_option(inner, value);
            }
            Format::Seq(inner) => {
                self.flush_writing(pending);
                self.write_list(inner, value);
            }
            Format::Map { value: inner, .. } => {
                self.flush_writing(pending);
                self.write_map(inner, value);
            }
            other => {
                let (letter, _) =
                    primitive(other).expect("the Python codec knows every primitive of the contract");
                pending.push(letter, value.to_owned());
            }
        }
    }

    fn write_option(&mut self, inner: &Format, value: &str) {
        let some = self.variable();
        self.line(&format!("{some} = {value}"));
        self.line(&format!("if {some} is None:"));
        self.line("    out.append(0)");
        self.line("else:");
        self.depth += 1;
        let mut pending = Pending::default();
        pending.push("B", "1".to_owned());
        self.write(inner, &some, &mut pending);
        self.flush_writing(&mut pending);
        self.depth -= 1;
    }

    fn write_list(&mut self, inner: &Format, value: &str) {
        if let Some((letter, _)) = primitive(inner) {
            self.line(&format!("run(out, \"{letter}\", {value})"));
            return;
        }
        let one = self.variable();
        self.line(&format!("length(out, {value})"));
        self.line(&format!("for {one} in {value}:"));
        self.write_block(inner, &one);
    }

    fn write_map(&mut self, inner: &Format, value: &str) {
        let key = self.variable();
        self.line(&format!("length(out, {value})"));
        self.line(&format!("for {key} in sorted({value}):"));
        self.depth += 1;
        self.line(&format!("string(out, {key})"));
        self.depth -= 1;
        self.write_block(inner, &format!("{value}[{key}]"));
    }

    fn write_block(&mut self, inner: &Format, value: &str) {
        self.depth += 1;
        let mut pending = Pending::default();
        self.write(inner, value, &mut pending);
        self.flush_writing(&mut pending);
        self.depth -= 1;
    }
}
