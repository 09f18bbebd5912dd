//! `schemas/keys.md`, `schemas/errors.md`, `schemas/messages.md` and `schemas/journal.md`.

mod journal;

use crate::contract::{Content, Contract, Field, Shape};
use crate::files::{Files, MEND};
use pdn_schemas::keys::{ROOT, VERSION};
use pdn_schemas::limits;
use pdn_schemas::problem::Code;
use pdn_schemas::registry::{describe_format, layout_hashes, message_names};
use pdn_schemas::topics::{COMMON_PARAMETERS, Parameter, Topic};
use std::fmt::Write;

/// Adds the documents.
pub fn add(contract: &Contract, files: &mut Files) {
    files.add("schemas/keys.md", keys());
    files.add("schemas/errors.md", errors());
    files.add("schemas/messages.md", messages(contract));
    files.add("schemas/journal.md", journal::journal());
}

fn head(title: &str) -> String {
    format!("# {title}\n\nGenerated from the types in `schemas/src` by `{MEND}`.\n\n")
}

fn keys() -> String {
    let mut text = head("Keys");
    let _ = write!(
        text,
        "Every key begins with `{ROOT}/{{vehicle}}/{VERSION}/`; ids of vehicles, missions and consoles match \
         `[a-z0-9_-]{{1,{}}}`.\n\n| key | role | payload | reply | what for |\n|---|---|---|---|---|\n",
        limits::MAX_ID_CHARS
    );
    let linked = |name: Option<&str>| {
        name.map_or(String::new(), |name| format!("[{name}](messages.md#{})", anchor(name)))
    };
    for topic in Topic::ALL {
        let suffix = topic.suffix().replace('*', "{name}");
        let role = format!("{:?}", topic.role()).to_lowercase();
        let (payload, reply) = (linked(topic.payload()), linked(topic.reply()));
        let _ = writeln!(text, "| `{suffix}` | {role} | {payload} | {reply} | {} |", topic.doc());
    }
    text += "\n## Parameters\n\nOf every question and command, separated by `;` as in \
             `after=12;deadline_ms=500`:\n\n";
    parameters(&mut text, COMMON_PARAMETERS);
    for topic in Topic::ALL.iter().filter(|topic| !topic.parameters().is_empty()) {
        let _ = write!(text, "\nOf `{}` besides:\n\n", topic.suffix());
        parameters(&mut text, topic.parameters());
    }
    text += "\n## Encodings\n\nJSON is `application/json`. bincode (little-endian, fixed-width integers, \
             64-bit lengths, 32-bit variant tags) is `application/octet-stream` with the schema of the \
             table; the part from `#` on, the hash of the message's layout, may be left out, but a wrong one \
             is refused.\n\n| message | schema |\n|---|---|\n";
    for name in message_names() {
        let hash = layout_hashes()[name];
        let _ = writeln!(text, "| {name} | `{ROOT}.{VERSION}.{name}+bincode#{hash:016x}` |");
    }
    text += "\n## Limits\n\n| name | value |\n|---|---|\n";
    for (name, value) in limits::ALL {
        let _ = writeln!(text, "| `{name}` | {value} |");
    }
    text
}

fn parameters(text: &mut String, parameters: &[Parameter]) {
    for Parameter { name, meaning } in parameters {
        let _ = writeln!(text, "- `{name}`: {meaning}");
    }
}

fn errors() -> String {
    let mut text = head("Codes of refusals");
    text += "An error reply, and what is published on `out/rejected`, is a [Problem](messages.md#problem) \
             with one of these codes. The codes are stable; the message beside them is for people.\n\n\
             | code | what it means | what to do |\n|---|---|---|\n";
    for code in Code::ALL {
        let _ = writeln!(text, "| `{code}` | {} | {} |", code.meaning(), code.remedy());
    }
    text
}

fn messages(contract: &Contract) -> String {
    let mut text = head("Messages");
    text += "Frames: the world is north-east-down in metres; a pose is `world_from_body`; a tangent vector \
             is `[rho (m); phi (rad)]`, perturbing on the right in the body frame; covariances are full \
             matrices row by row in that order. A type `T?` may be null, `T*` is a list, `[T;n]` a list of \
             exactly n. A field with a default may be left out of JSON and TOML; a field of no message's \
             table is refused.\n\nEnums are externally tagged: `{\"odometry\": {...}}`, or just the name if \
             the variant has no content. In bincode the fields follow each other in the order of the tables, \
             and a variant is its number.\n";
    let messages = message_names();
    let parts = contract.names_in_order().into_iter().filter(|name| !messages.contains(name));
    text += "\n## What travels by itself\n";
    messages.iter().for_each(|name| container(contract, name, &mut text));
    text += "\n## What they are made of\n";
    parts.collect::<Vec<_>>().into_iter().for_each(|name| container(contract, name, &mut text));
    text
}

fn container(contract: &Contract, name: &str, text: &mut String) {
    let _ = write!(text, "\n### {name}\n\n{}\n\n", one_line(contract.doc(name)));
    match contract.shape(name) {
        Shape::Struct(fields) => {
            *text += "| field | type | default | meaning |\n|---|---|---|---|\n";
            fields.iter().for_each(|field| row("", field, text));
        }
        Shape::Enum(variants) => {
            *text += "| variant | number | type | meaning |\n|---|---|---|---|\n";
            for variant in variants {
                let (number, doc) = (variant.tag, one_line(variant.doc));
                let of = match &variant.content {
                    Content::One(format) => format!("`{}`", describe_format(format)),
                    _ => String::new(),
                };
                let _ = writeln!(text, "| `{}` | {number} | {of} | {doc} |", variant.name);
                if let Content::Fields(fields) = &variant.content {
                    for field in fields {
                        let (format, doc) = (describe_format(field.format), one_line(field.doc));
                        let _ =
                            writeln!(text, "| `{}.{}` | | `{format}` | {doc} |", variant.name, field.name);
                    }
                }
            }
        }
    }
}

fn row(prefix: &str, field: &Field, text: &mut String) {
    let default = match &field.default {
        None => String::new(),
        Some(value) => match value.to_string() {
            long if long.len() > 60 => "see its type".to_owned(),
            short => format!("`{short}`"),
        },
    };
    let (format, doc) = (describe_format(field.format), one_line(field.doc));
    let _ = writeln!(text, "| `{prefix}{}` | `{format}` | {default} | {doc} |", field.name);
}

fn one_line(doc: &str) -> String {
    doc.split_whitespace().collect::<Vec<_>>().join(" ").replace('|', "\\|")
}

fn anchor(name: &str) -> String {
    name.to_lowercase()
}
