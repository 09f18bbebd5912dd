//! The functions that read.

use super::super::shapes::constant;
use super::super::{annotation, attribute};
use super::{Code, primitive, snake};
use serde_reflection::Format;

/// Fields that will be unpacked by one `struct.Struct` into the tuple of that name.
struct Pending {
    tuple: String,
    layout: String,
    values: usize,
    bytes: usize,
}

impl Pending {
    /// The expression of the next `values` values.
    fn take(&mut self, layout: &str, values: usize, bytes: usize) -> String {
        let first = self.values;
        self.layout += layout;
        self.values += values;
        self.bytes += bytes;
        let tuple = &self.tuple;
        if values == 1 && !layout.starts_with(|c: char| c.is_ascii_digit()) {
            format!("{tuple}[{first}]")
        } else {
            format!("{tuple}[{first}:{}]", first + values)
        }
    }
}

impl Code<'_> {
    /// `read_<name>`.
    pub(super) fn read_function(&mut self, name: &str, kind: &str, fields: &[(&str, &Format)]) {
        let unused = if fields.is_empty() { "_" } else { "b" };
        self.line(&format!("def read_{name}({unused}: bytes, i: int) -> tuple[{kind}, int]:"));
        self.depth += 1;
        let mut pending = self.pending();
        let mut arguments = Vec::new();
        for (field, format) in fields {
            let value = self.read(format, &mut pending);
            arguments.push(format!("{}={value}", attribute(field)));
        }
        self.flush_reading(&mut pending);
        self.line(&format!("return {kind}({}), i", arguments.join(", ")));
        self.depth -= 1;
        self.line("");
        self.line("");
    }

    fn pending(&mut self) -> Pending {
        Pending { tuple: self.variable(), layout: String::new(), values: 0, bytes: 0 }
    }

    fn flush_reading(&mut self, pending: &mut Pending) {
        let fresh = self.pending();
        let Pending { tuple, layout, values, bytes } = std::mem::replace(pending, fresh);
        if values > 0 {
            let layout = self.layout(&layout);
            self.line(&format!("{tuple} = {layout}.unpack_from(b, i)"));
            self.line(&format!("i += {bytes}"));
        }
    }

    /// The expression of a value, once `pending` is flushed.
    fn read(&mut self, format: &Format, pending: &mut Pending) -> String {
        match format {
            Format::Bool => format!("boolean({})", pending.take("B", 1, 1)),
            Format::TypeName(name) if self.contract.is_choice(name) => {
                format!("one_of(\"{name}\", _{}, {})", constant(name), pending.take("I", 1, 4))
            }
            Format::TypeName(name) if self.is_fixed_type(name) => {
                let mut arguments = Vec::new();
                for (field, format) in self.fields_of(name) {
                    let value = self.read(&format, pending);
                    arguments.push(format!("{}={value}", attribute(&field)));
                }
                format!("m.{name}({})", arguments.join(", "))
            }
            Format::Tuple(parts) => {
                let parts: Vec<String> = parts.iter().map(|part| self.read(part, pending)).collect();
                format!("({})", parts.join(", "))
            }
            Format::TupleArray { content, size } => {
                let (letter, bytes) = primitive(content).expect("the contract's arrays hold numbers");
                pending.take(&format!("{size}{letter}"), *size, size * bytes)
            }
            Format::TypeName(name) => self.read_call(&format!("read_{}(b, i)", snake(name)), pending),
            Format::Str => self.read_call("read_string(b, i)", pending),
            Format::Option(inner) => {
                self.flush_reading(pending);
                self.read_option(inner)
            }
            Format::Seq(inner) => match primitive(inner) {
                Some((letter, bytes)) => {
                    self.read_call(&format!("read_run(b, i, \"{letter}\", {bytes})"), pending)
                }
                None => {
                    self.flush_reading(pending);
                    if self.is_fixed(inner) { self.read_fixed_list(inner) } else { self.read_list(inner) }
                }
            },
            Format::Map { value, .. } => {
                self.flush_reading(pending);
                self.read_map(value)
            }
            other => {
                let (letter, bytes) =
                    primitive(other).expect("the Python codec knows every primitive of the contract");
                pending.take(letter, 1, bytes)
            }
        }
    }

    fn read_call(&mut self, call: &str, pending: &mut Pending) -> String {
        self.flush_reading(pending);
        let value = self.variable();
        self.line(&format!("{value}, i = {call}"));
        value
    }

    fn read_option(&mut self, inner: &Format) -> String {
        let value = self.variable();
        let kind = self.qualified(&Format::Option(Box::new(inner.clone())));
        self.line(&format!("{value}: {kind} = None"));
        self.line("some = flag(b, i)");
        self.line("i += 1");
        self.line("if some:");
        self.read_block(inner, |one| format!("{value} = {one}"));
        value
    }

    /// A list whose elements all take the same bytes: one pass of `iter_unpack`.
    fn read_fixed_list(&mut self, inner: &Format) -> String {
        let mut element = self.pending();
        let one = self.read(inner, &mut element);
        let Pending { tuple, layout, bytes, .. } = element;
        let layout = self.layout(&layout);
        let (value, number) = (self.variable(), self.variable());
        self.line(&format!("{number}, i = count(b, i, {bytes})"));
        let elements = format!("{layout}.iter_unpack(b[i:i + {number} * {bytes}])");
        let kind = self.qualified(&Format::Seq(Box::new(inner.clone())));
        self.line(&format!("{value}: {kind} = tuple({one} for {tuple} in {elements})"));
        self.line(&format!("i += {number} * {bytes}"));
        value
    }

    fn read_list(&mut self, inner: &Format) -> String {
        let (list, number) = (self.variable(), self.variable());
        let kind = self.qualified(inner);
        self.line(&format!("{number}, i = count(b, i, 1)"));
        self.line(&format!("{list}: list[{kind}] = []"));
        self.line(&format!("for _ in range({number}):"));
        self.read_block(inner, |one| format!("{list}.append({one})"));
        format!("tuple({list})")
    }

    fn read_map(&mut self, inner: &Format) -> String {
        let (map, number, key) = (self.variable(), self.variable(), self.variable());
        let kind = self.qualified(inner);
        self.line(&format!("{number}, i = count(b, i, 9)"));
        self.line(&format!("{map}: dict[str, {kind}] = {{}}"));
        self.line(&format!("for _ in range({number}):"));
        self.line(&format!("    {key}, i = read_string(b, i)"));
        self.read_block(inner, |one| format!("{map}[{key}] = {one}"));
        map
    }

    fn read_block(&mut self, inner: &Format, last: impl FnOnce(&str) -> String) {
        self.depth += 1;
        let mut pending = self.pending();
        let one = self.read(inner, &mut pending);
        self.flush_reading(&mut pending);
        self.line(&last(&one));
        self.depth -= 1;
    }

    /// An annotation with the names of messages qualified.
    fn qualified(&self, format: &Format) -> String {
        let plain = annotation(self.contract, format);
        let mut text = String::new();
        let mut inside = false;
        for letter in plain.chars() {
            let is_word = letter.is_alphanumeric() || letter == '_';
            if is_word && !inside && letter.is_uppercase() {
                text += "m.";
            }
            inside = is_word;
            text.push(letter);
        }
        text.replace("m.None", "None")
    }
}
