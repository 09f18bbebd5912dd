//! The order of events: each number is applied once, in order, whatever the order of arrival.
//!
//! An event whose number is due is handed on at once, with those that waited for it. A later one waits in a
//! bounded buffer. A repeat is ignored if its content is the same, else it is a conflict. What the content of an
//! event is worth is not judged here: a number is consumed whether or not the mission then refuses the content.

use crate::error::StateError;
use crate::event::Event;
use std::collections::BTreeMap;

/// Progress of one mission's events.
#[derive(Clone, Debug, Default)]
pub struct Ingest {
    fingerprints: Vec<u64>,
    buffered: BTreeMap<u64, (u64, Event)>,
}

/// What became of an arrival.
#[derive(Debug, PartialEq)]
pub enum Arrival {
    /// The events that are due now, in order: this one and those that waited for it.
    Due(Vec<Event>),
    /// It waits for a missing event.
    Buffered,
    /// It has been here before, with the same content.
    Repeat,
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

    /// Takes an event, at the cost of its fingerprint and a search in the buffer.
    ///
    /// # Errors
    /// [`StateError::SequenceConflict`] if its number came before with other content;
    /// [`StateError::BufferFull`] if it would have to wait and `max_buffered` already do;
    /// [`StateError::Limit`] from `max_events` on. None of them consumes the number.
    pub fn take(
        &mut self,
        event: Event,
        max_buffered: usize,
        max_events: u64,
    ) -> Result<Arrival, StateError> {
        let seq = event.seq();
        let fingerprint = event
            .fingerprint()
            .map_err(|error| StateError::Internal { evidence: format!("encoding an event: {error}") })?;
        if let Some(known) = self.known(seq) {
            return if known == fingerprint {
                Ok(Arrival::Repeat)
            } else {
                Err(StateError::SequenceConflict { seq })
            };
        }
        if seq >= max_events {
            return Err(StateError::Limit {
                what: "events of the mission",
                bound: "max_events",
                limit: max_events,
                advice: "complete this mission and configure another",
            });
        }
        if seq > self.next_seq() {
            if self.buffered.len() >= max_buffered {
                return Err(StateError::BufferFull {
                    seq,
                    next_seq: self.next_seq(),
                    buffered: max_buffered,
                });
            }
            self.buffered.insert(seq, (fingerprint, event));
            return Ok(Arrival::Buffered);
        }
        self.fingerprints.push(fingerprint);
        let mut due = vec![event];
        while let Some((fingerprint, event)) = self.buffered.remove(&self.next_seq()) {
            self.fingerprints.push(fingerprint);
            due.push(event);
        }
        Ok(Arrival::Due(due))
    }

    /// Whether this very event has been taken before; false also where another one has its number.
    pub fn is_repeat(&self, event: &Event) -> bool {
        event.fingerprint().is_ok_and(|fingerprint| self.known(event.seq()) == Some(fingerprint))
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

    fn known(&self, seq: u64) -> Option<u64> {
        let consumed = usize::try_from(seq).ok().and_then(|index| self.fingerprints.get(index).copied());
        consumed.or_else(|| self.buffered.get(&seq).map(|(fingerprint, _)| *fingerprint))
    }
}
