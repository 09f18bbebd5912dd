//! Two decisions, compared bit for bit.

use super::Verdict;
use pdn_schemas::codec::{Format, encode};
use pdn_schemas::reply::{Candidate, Decision, Timing};
use serde_json::Value;

/// The first field in which two decisions differ.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Its path.
    pub field: String,
    /// What was recorded.
    pub recorded: String,
    /// What comes out now.
    pub computed: String,
}

/// Compares a decision with the recorded one. Its number and its timing are not part of what is decided.
pub(super) fn compare(recorded: &Decision, computed: Decision) -> Verdict {
    let recorded = Decision { timing: Timing::default(), ..recorded.clone() };
    let mut computed = Decision { decision: recorded.decision, timing: Timing::default(), ..computed };
    let complete = recorded.complete;
    if !complete {
        // What the clock decided is taken as it was.
        let was_evaluated = |candidate: &Candidate| {
            recorded.candidates.iter().any(|known| known.candidate == candidate.candidate)
        };
        computed.candidates.retain(was_evaluated);
        computed.complete = false;
        computed.action = recorded.action;
        computed.not_evaluated.clone_from(&recorded.not_evaluated);
        computed.reason.clone_from(&recorded.reason);
    }
    if bytes(&recorded) == bytes(&computed) {
        return if complete { Verdict::Same } else { Verdict::SameAsFarAsItGot };
    }
    let unnamed = || Difference {
        field: "some number that text cannot tell apart".to_owned(),
        recorded: String::new(),
        computed: String::new(),
    };
    let values = (value(&recorded), value(&computed));
    Verdict::Differs(first("", &values.0, &values.1).unwrap_or_else(unnamed))
}

fn bytes(decision: &Decision) -> Option<Vec<u8>> {
    encode(decision, Format::Bincode).ok()
}

fn value(decision: &Decision) -> Value {
    serde_json::to_value(decision).unwrap_or(Value::Null)
}

fn first(path: &str, recorded: &Value, computed: &Value) -> Option<Difference> {
    match (recorded, computed) {
        (Value::Object(one), Value::Object(other)) if one.keys().eq(other.keys()) => {
            one.iter().zip(other.values()).find_map(|((name, one), other)| {
                let dot = if path.is_empty() { "" } else { "." };
                first(&format!("{path}{dot}{name}"), one, other)
            })
        }
        (Value::Array(one), Value::Array(other)) if one.len() == other.len() => one
            .iter()
            .zip(other)
            .enumerate()
            .find_map(|(index, (one, other))| first(&format!("{path}[{index}]"), one, other)),
        _ => {
            let (recorded, computed) = (shown(recorded), shown(computed));
            let field = path.to_owned();
            (recorded != computed).then_some(Difference { field, recorded, computed })
        }
    }
}

/// A number with all of its digits; of what is long its beginning.
fn shown(value: &Value) -> String {
    match value {
        Value::Array(items) => format!("{} elements", items.len()),
        value => value.to_string().chars().take(200).collect(),
    }
}
