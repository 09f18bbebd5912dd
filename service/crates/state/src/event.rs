//! What a mission is a fold of: the closed list of its events.

use pdn_schemas::codec::{self, CodecError, Format};
use pdn_schemas::event::{Factor, Keyframe, LinkOutcome};
use pdn_schemas::problem::Code;

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

    /// 64-bit FNV-1a over the kind and the canonical bytes (the contract's bincode) of the event, by which a
    /// repeat is told from a conflict. JSON and bincode of the same event agree, as do all encodings of a number.
    ///
    /// It guards against mistakes, not against an adversary: 2^-64 of the conflicts pass as repeats, and a
    /// repeat is ignored, so nothing false ever enters the graph.
    ///
    /// # Errors
    /// [`CodecError::TooLarge`] for what no reader would take.
    pub fn fingerprint(&self) -> Result<u64, CodecError> {
        let (kind, bytes) = match self {
            Event::Keyframe(keyframe) => (b'k', codec::encode(keyframe, Format::Bincode)),
            Event::Factor(factor) => (b'f', codec::encode(factor, Format::Bincode)),
            Event::Link(link) => (b'l', codec::encode(link, Format::Bincode)),
            Event::Undecodable(event) => (b'u', Ok(event.message.clone().into_bytes())),
        };
        Ok(fnv1a([kind].iter().chain(&bytes?)))
    }
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
            Event::Link(event).fingerprint().expect("a plain event can be encoded")
        };
        assert_eq!(link(0, 1, true), link(0, 1, true));
        for other in [link(1, 1, true), link(0, 3, true), link(0, 1, false)] {
            assert_ne!(other, link(0, 1, true));
        }
    }
}
