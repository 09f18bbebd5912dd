//! Who sent an event, and which one, when its body cannot be read: such an event is refused but consumes its
//! number, so that the rest of the mission goes on.

use super::Format;
use crate::ids::MissionId;
use crate::limits::{MAX_ID_CHARS, MAX_REQUEST_BYTES};
use serde::de::{Error, IgnoredAny, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::fmt;

/// What every event begins with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Head {
    /// Its mission.
    pub mission: MissionId,
    /// Its number.
    pub seq: u64,
}

/// The head of an event, if it can be told whatever follows it: in bincode the first two fields, in JSON the
/// fields of those names before the first fault in syntax. Reads no further than it must.
pub fn decode_head(bytes: &[u8], format: Format) -> Option<Head> {
    let bytes = &bytes[..bytes.len().min(MAX_REQUEST_BYTES)];
    match format {
        Format::Json => json_head(bytes),
        Format::Bincode => bincode_head(bytes),
    }
}

fn bincode_head(bytes: &[u8]) -> Option<Head> {
    let (length, rest) = bytes.split_first_chunk::<8>()?;
    let length =
        usize::try_from(u64::from_le_bytes(*length)).ok().filter(|&length| length <= MAX_ID_CHARS)?;
    let (mission, rest) = rest.split_at_checked(length)?;
    let (seq, _) = rest.split_first_chunk::<8>()?;
    let mission = MissionId::new(std::str::from_utf8(mission).ok()?).ok()?;
    Some(Head { mission, seq: u64::from_le_bytes(*seq) })
}

fn json_head(bytes: &[u8]) -> Option<Head> {
    let mut found = Found::default();
    // What was found before a fault counts; the fault itself is told by the full decoding.
    let _ = serde_json::Deserializer::from_slice(bytes).deserialize_map(&mut found);
    Some(Head { mission: MissionId::new(found.mission?).ok()?, seq: found.seq? })
}

#[derive(Default)]
struct Found {
    mission: Option<String>,
    seq: Option<u64>,
}

#[derive(Deserialize)]
#[serde(field_identifier, rename_all = "snake_case")]
enum Field {
    Mission,
    Seq,
    #[serde(other)]
    Other,
}

impl<'de> Visitor<'de> for &mut Found {
    type Value = ();

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str("an event")
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        while self.mission.is_none() || self.seq.is_none() {
            match map.next_key::<Field>()? {
                Some(Field::Mission) => self.mission = Some(map.next_value()?),
                Some(Field::Seq) => self.seq = Some(map.next_value()?),
                Some(Field::Other) => drop(map.next_value::<IgnoredAny>()?),
                None => return Ok(()),
            }
        }
        Err(A::Error::custom("the head is complete"))
    }
}

#[cfg(test)]
mod tests {
    use super::super::encode;
    use super::*;
    use crate::event::LinkOutcome;

    fn event() -> LinkOutcome {
        LinkOutcome { mission: "m-1".into(), seq: u64::MAX, stamp_ns: 5, from: 1, to: 2, registered: true }
    }

    #[test]
    fn the_head_survives_a_broken_body() {
        let head = Head { mission: MissionId::new("m-1").unwrap(), seq: u64::MAX };
        let bincode = encode(&event(), Format::Bincode).unwrap();
        for end in 0..=bincode.len() {
            let expected = (end >= 8 + 3 + 8).then_some(&head);
            assert_eq!(decode_head(&bincode[..end], Format::Bincode).as_ref(), expected, "{end} bytes");
        }
        let json = r#"{"extra": [{"x": 1}], "mission": "m-1", "from": null, "seq": 18446744073709551615,
            "to": nonsense"#;
        assert_eq!(decode_head(json.as_bytes(), Format::Json), Some(head));
    }

    #[test]
    fn no_head_is_made_up() {
        let texts = [
            "",
            "null",
            "[]",
            r#"{"mission": "m", "seq": -1}"#,
            r#"{"mission": "m", "seq": 1.0}"#,
            r#"{"mission": "NO", "seq": 1}"#,
            r#"{"mission": "m", nonsense, "seq": 1}"#,
            r#"{"seq": 1}"#,
            r#"{"body": {"mission": "m", "seq": 1}}"#,
        ];
        for text in texts {
            assert_eq!(decode_head(text.as_bytes(), Format::Json), None, "{text}");
        }
        assert_eq!(decode_head(&[0xff; 100], Format::Bincode), None);
        assert_eq!(decode_head(&[0; 100], Format::Bincode), None);
    }
}
