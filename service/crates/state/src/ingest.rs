//! The order of events: each number is applied once, in order, whatever the order of arrival.
//!
//! An event whose number is due is released at once, with those that waited for it. A later one waits in a
//! buffer that is bounded in events and in bytes. A repeat is ignored if its content is the same, else it is
//! a conflict. What the content of an event is worth is not judged here: a number is consumed whether or not
//! the mission then refuses the content.

use crate::error::StateError;
use crate::event::{EncodedEvent, Event};
use pdn_schemas::codec::CodecError;
use pdn_schemas::record::Kind;
use std::collections::BTreeMap;

/// Progress of one mission's events.
#[derive(Clone, Debug, Default)]
pub struct Ingest {
    fingerprints: Vec<u64>,
    buffered: BTreeMap<u64, Buffered>,
    buffered_bytes: usize,
}

/// How much an [`Ingest`] takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Room {
    /// Events, applied, refused and buffered.
    pub events: u64,
    /// Events that wait for a missing one.
    pub buffered: usize,
    /// Bytes, as sent, of those.
    pub buffered_bytes: usize,
}

/// What became of an arrival.
#[derive(Debug, PartialEq)]
pub enum Arrival {
    /// The events that are due now, in order: this one and those that waited for it.
    Due(Vec<EncodedEvent>),
    /// It waits for a missing event.
    Buffered,
    /// It has been here before, with the same content.
    Repeat,
}

/// An event that waits, as its canonical bytes: decoded it can be several times as large.
#[derive(Clone, Debug)]
struct Buffered {
    kind: Kind,
    bytes: Vec<u8>,
    fingerprint: u64,
    sent_bytes: usize,
}

impl Ingest {
    /// All events below are consumed.
    pub fn next_seq(&self) -> u64 {
        self.fingerprints.len() as u64
    }

    /// Events that wait for a missing one.
    pub fn buffered(&self) -> usize {
        self.buffered.len()
    }

    /// Bytes of those, as sent.
    pub fn buffered_bytes(&self) -> usize {
        self.buffered_bytes
    }

    /// Takes an event of so many bytes as sent, at the cost of a search in the buffer.
    ///
    /// # Errors
    /// [`StateError::SequenceConflict`] if its number came before with other content; if it would have to
    /// wait, [`StateError::BufferBytes`] and [`StateError::BufferFull`] for want of room;
    /// [`StateError::Limit`] from `room.events` on. None of them consumes the number.
    pub fn take(
        &mut self,
        event: EncodedEvent,
        sent_bytes: usize,
        room: Room,
    ) -> Result<Arrival, StateError> {
        let seq = event.event.seq();
        if let Some(fingerprint) = self.fingerprint(seq) {
            let is_repeat = fingerprint == event.fingerprint;
            return if is_repeat { Ok(Arrival::Repeat) } else { Err(StateError::SequenceConflict { seq }) };
        }
        if seq >= room.events {
            return Err(StateError::Limit {
                what: "events of the mission",
                bound: "max_events",
                limit: room.events,
                advice: "complete this mission and configure another",
            });
        }
        if seq > self.next_seq() {
            self.buffer(event, sent_bytes, room)?;
            return Ok(Arrival::Buffered);
        }
        self.fingerprints.push(event.fingerprint);
        let mut due = vec![event];
        while let Some(event) = self.release() {
            self.fingerprints.push(event.fingerprint);
            due.push(event);
        }
        Ok(Arrival::Due(due))
    }

    /// Whether this very event has been taken before; false also where another one has its number.
    pub fn is_repeat(&self, event: &EncodedEvent) -> bool {
        self.fingerprint(event.event.seq()) == Some(event.fingerprint)
    }

    /// The first `max_ranges` gaps below the last event that waits, as `(first, last)`.
    pub fn missing(&self, max_ranges: usize) -> Vec<(u64, u64)> {
        let mut expected = self.next_seq();
        let mut gaps = Vec::new();
        for seq in self.buffered.keys().copied() {
            if gaps.len() == max_ranges {
                break;
            }
            if seq > expected {
                gaps.push((expected, seq - 1));
            }
            expected = seq.saturating_add(1);
        }
        gaps
    }

    fn buffer(&mut self, event: EncodedEvent, sent_bytes: usize, room: Room) -> Result<(), StateError> {
        let seq = event.event.seq();
        if sent_bytes > room.buffered_bytes.saturating_sub(self.buffered_bytes) {
            return Err(StateError::BufferBytes { seq });
        }
        if self.buffered.len() >= room.buffered {
            return Err(StateError::BufferFull { seq, next_seq: self.next_seq(), buffered: room.buffered });
        }
        let EncodedEvent { event, bytes, fingerprint } = event;
        self.buffered.insert(seq, Buffered { kind: event.kind(), bytes, fingerprint, sent_bytes });
        self.buffered_bytes += sent_bytes;
        Ok(())
    }

    /// Takes the next event out of the buffer, if it waits there.
    fn release(&mut self) -> Option<EncodedEvent> {
        let buffered = self.buffered.remove(&self.next_seq())?;
        self.buffered_bytes -= buffered.sent_bytes;
        // What was encoded here can be decoded; otherwise it would count as missing and come again.
        buffered.decode().ok()
    }

    fn fingerprint(&self, seq: u64) -> Option<u64> {
        let consumed = usize::try_from(seq).ok().and_then(|index| self.fingerprints.get(index).copied());
        consumed.or_else(|| self.buffered.get(&seq).map(|buffered| buffered.fingerprint))
    }
}

impl Buffered {
    fn decode(self) -> Result<EncodedEvent, CodecError> {
        let event = Event::decode(self.kind, &self.bytes)?;
        Ok(EncodedEvent { event, bytes: self.bytes, fingerprint: self.fingerprint })
    }
}
