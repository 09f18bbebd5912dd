//! What a mission is a fold of: the closed list of its events.

use pdn_schemas::codec::{self, CodecError, Format, Message};
use pdn_schemas::event::{Factor, Keyframe, LinkOutcome};
use pdn_schemas::problem::Code;
use pdn_schemas::record::{Kind, UnreadEvent};

/// An event as it arrived; together with the configuration these are all that a decision depends on.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// `in/keyframe`.
    Keyframe(Keyframe),
    /// `in/factor`.
    Factor(Factor),
    /// `in/link`.
    Link(LinkOutcome),
    /// Something whose head could be read, but not its body.
    Undecodable(Undecodable),
}

/// An event of which only the head could be read. It takes its place in the order, and is refused there.
#[derive(Clone, Debug, PartialEq)]
pub struct Undecodable {
    /// Id of the mission.
    pub mission: String,
    /// Number of the event.
    pub seq: u64,
    /// Why: `invalid`, `schema_mismatch` or `too_large`.
    pub code: Code,
    /// What the decoder found and what to do.
    pub message: String,
}

impl Event {
    /// Id of the mission that the event belongs to.
    pub fn mission(&self) -> &str {
        match self {
            Event::Keyframe(keyframe) => &keyframe.mission,
            Event::Factor(factor) => &factor.mission,
            Event::Link(link) => &link.mission,
            Event::Undecodable(event) => &event.mission,
        }
    }

    /// Number of the event in its mission.
    pub fn seq(&self) -> u64 {
        match self {
            Event::Keyframe(keyframe) => keyframe.seq,
            Event::Factor(factor) => factor.seq,
            Event::Link(link) => link.seq,
            Event::Undecodable(event) => event.seq,
        }
    }

    /// What it is in the journal.
    pub(crate) fn kind(&self) -> Kind {
        match self {
            Event::Keyframe(_) => Kind::Keyframe,
            Event::Factor(_) => Kind::Factor,
            Event::Link(_) => Kind::Link,
            Event::Undecodable(_) => Kind::Unread,
        }
    }

    /// Its bytes in either format of the contract; its canonical ones are in bincode.
    ///
    /// # Errors
    /// [`CodecError::TooLarge`] for what no reader would take; [`CodecError::NotFinite`] for what JSON cannot
    /// say.
    pub(crate) fn encode(&self, format: Format) -> Result<Vec<u8>, CodecError> {
        match self {
            Event::Keyframe(message) => codec::encode(message, format),
            Event::Factor(message) => codec::encode(message, format),
            Event::Link(message) => codec::encode(message, format),
            Event::Undecodable(event) => codec::encode(&event.as_record(), format),
        }
    }

    /// The event of canonical bytes.
    ///
    /// # Errors
    /// What does not belong to an event of that kind.
    pub(crate) fn decode(kind: Kind, bytes: &[u8]) -> Result<Event, CodecError> {
        let format = Format::Bincode;
        Ok(match kind {
            Kind::Keyframe => Event::Keyframe(codec::decode(bytes, format)?),
            Kind::Factor => Event::Factor(codec::decode(bytes, format)?),
            Kind::Link => Event::Link(codec::decode(bytes, format)?),
            Kind::Unread => Event::Undecodable(Undecodable::of_record(codec::decode(bytes, format)?)?),
            other => {
                let reason = "it is no event".to_owned();
                return Err(CodecError::Bincode { message: other.schema(), reason });
            }
        })
    }
}

impl Undecodable {
    fn as_record(&self) -> UnreadEvent {
        UnreadEvent {
            mission: self.mission.clone(),
            seq: self.seq,
            code: self.code.name().to_owned(),
            message: self.message.clone(),
        }
    }

    fn of_record(record: UnreadEvent) -> Result<Undecodable, CodecError> {
        let UnreadEvent { mission, seq, code, message } = record;
        let reason = format!("no code is named {code:?}");
        let code =
            Code::from_name(&code).ok_or(CodecError::Bincode { message: UnreadEvent::NAME, reason })?;
        Ok(Undecodable { mission, seq, code, message })
    }
}

/// An event with its canonical bytes (the contract's bincode), which are made once: the fingerprint is
/// theirs, and the journal keeps them.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct EncodedEvent {
    /// What it says.
    pub(crate) event: Event,
    /// The bytes.
    pub(crate) bytes: Vec<u8>,
    /// See [`fingerprint`].
    pub(crate) fingerprint: u64,
}

impl EncodedEvent {
    /// Encodes an event.
    ///
    /// # Errors
    /// [`CodecError::TooLarge`] for what no reader would take.
    pub(crate) fn new(event: Event) -> Result<EncodedEvent, CodecError> {
        let bytes = event.encode(Format::Bincode)?;
        let fingerprint = fingerprint(event.kind(), &bytes);
        Ok(EncodedEvent { event, bytes, fingerprint })
    }
}

/// 64-bit FNV-1a over the kind and the canonical bytes of an event, by which a repeat is told from a
/// conflict. JSON and bincode of the same event agree, as do all spellings of a number.
///
/// It guards against mistakes, not against an adversary: 2^-64 of the conflicts pass as repeats, and a repeat
/// is ignored, so nothing false ever enters the graph.
fn fingerprint(kind: Kind, bytes: &[u8]) -> u64 {
    fnv1a(kind.number().to_le_bytes().iter().chain(bytes))
}

fn fnv1a<'a>(bytes: impl Iterator<Item = &'a u8>) -> u64 {
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Published values of FNV-1a, 64 bit.
    #[test]
    fn fnv1a_has_its_published_values() {
        assert_eq!(fnv1a(b"".iter()), 0xcbf2_9ce4_8422_2325);
        assert_eq!(fnv1a(b"a".iter()), 0xaf63_dc4c_8601_ec8c);
        assert_eq!(fnv1a(b"foobar".iter()), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn a_fingerprint_differs_with_any_content() {
        let link = |stamp_ns, from, registered| {
            let event = LinkOutcome { mission: "m".into(), seq: 4, stamp_ns, from, to: 2, registered };
            EncodedEvent::new(Event::Link(event)).expect("a plain event can be encoded").fingerprint
        };
        assert_eq!(link(0, 1, true), link(0, 1, true));
        for other in [link(1, 1, true), link(0, 3, true), link(0, 1, false)] {
            assert_ne!(other, link(0, 1, true));
        }
    }

    /// A JSON text that spells its numbers in other ways, and the bincode of the same event.
    #[test]
    fn json_and_bincode_of_one_event_have_one_fingerprint() {
        let json = br#"{"registered": true, "to": 2, "from": 1, "stamp_ns": 5, "seq": 7, "mission": "m"}"#;
        let spelled: LinkOutcome = codec::decode(json, Format::Json).expect("a link outcome");
        let bytes = codec::encode(&spelled, Format::Bincode).expect("a plain event can be encoded");
        let sent: LinkOutcome = codec::decode(&bytes, Format::Bincode).expect("what was encoded");
        let [one, other] =
            [spelled, sent].map(|event| EncodedEvent::new(Event::Link(event)).expect("a plain event"));
        assert_eq!((one.fingerprint, &one.bytes), (other.fingerprint, &bytes));
    }

    #[test]
    fn an_event_is_what_its_bytes_say() {
        let event = Event::Undecodable(Undecodable {
            mission: "m".into(),
            seq: 3,
            code: Code::SchemaMismatch,
            message: "another layout".into(),
        });
        let encoded = EncodedEvent::new(event.clone()).expect("a plain event can be encoded");
        assert_eq!(Event::decode(event.kind(), &encoded.bytes), Ok(event));
        assert!(Event::decode(Kind::Refused, &encoded.bytes).is_err());
    }
}
