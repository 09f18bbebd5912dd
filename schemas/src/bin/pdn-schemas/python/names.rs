//! `names.py` (topics, codes, hashes) and `limits.py`.

use super::header;
use pdn_schemas::codec::{Message, MessageVisitor, visit_messages};
use pdn_schemas::keys::{ROOT, VERSION};
use pdn_schemas::limits;
use pdn_schemas::problem::Code;
use pdn_schemas::registry::layout_hash;
use pdn_schemas::topics::Topic;
use std::fmt::Write;

/// `names.py`.
pub fn module() -> String {
    let mut text = header("Topics, codes of refusals, and the layout hash and size limit of every message.");
    text += "# fmt: off\n\nfrom enum import StrEnum\n\n";
    let _ = writeln!(text, "ROOT = \"{ROOT}\"\nVERSION = \"{VERSION}\"\n\n");
    text +=
        "class Topic(StrEnum):\n    \"\"\"What is spoken about: the part of a key after the version.\"\"\"\n";
    for topic in Topic::ALL {
        let name = topic.suffix().trim_end_matches("/*").replace('/', "_").to_uppercase();
        let _ = write!(text, "\n    {name} = \"{}\"\n    \"\"\"{}\"\"\"\n", topic.suffix(), topic.doc());
    }
    text += "\n\nclass Code(StrEnum):\n    \"\"\"Why something was refused.\"\"\"\n";
    for code in Code::ALL {
        let name = code.name().to_uppercase();
        let (meaning, remedy) = (code.meaning(), code.remedy());
        let _ = write!(text, "\n    {name} = \"{code}\"\n    \"\"\"{meaning}\n\n    {remedy}\n    \"\"\"\n");
    }
    text += "\n\nLAYOUT_HASHES: dict[str, str] = {\n";
    text += &table(|hash, _| format!("\"{hash:016x}\""));
    text += "}\n\nMAX_BYTES: dict[str, int] = {\n";
    text += &table(|_, bytes| bytes.to_string());
    text += "}\n";
    text
}

/// `limits.py`.
pub fn limits_module() -> String {
    let mut text = header("The bounds of the contract, by name; schemas/src/limits.rs says what each means.");
    for (name, value) in limits::ALL {
        let _ = writeln!(text, "{name} = {}", grouped(*value));
    }
    text
}

/// A number with underscores between thousands.
fn grouped(value: u64) -> String {
    let digits = value.to_string();
    let mut text = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index) % 3 == 0 {
            text.push('_');
        }
        text.push(digit);
    }
    text
}

fn table(cell: impl Fn(u64, usize) -> String) -> String {
    struct Rows<F>(String, F);
    impl<F: Fn(u64, usize) -> String> MessageVisitor for Rows<F> {
        fn visit<T: Message>(&mut self) {
            let cell = (self.1)(layout_hash::<T>(), T::BOUND.max_bytes());
            let _ = writeln!(self.0, "    \"{}\": {cell},", T::NAME);
        }
    }
    let mut rows = Rows(String::new(), cell);
    visit_messages(&mut rows);
    rows.0
}
