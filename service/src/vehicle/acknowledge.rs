//! When `out/ack` is due: after every 64 events, or soon after the first that no acknowledgement tells of.

use pdn_schemas::limits::{ACK_EVERY_EVENTS, ACK_EVERY_MS};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Half of what the contract allows: the rest is for a thread that is busy when the time comes.
const SOON: Duration = Duration::from_millis(ACK_EVERY_MS / 2);

/// The missions with events that no acknowledgement has told of yet.
#[derive(Debug, Default)]
pub struct Acknowledgements {
    pending: BTreeMap<String, Pending>,
}

#[derive(Debug)]
struct Pending {
    events: u64,
    due: Instant,
}

impl Acknowledgements {
    /// Notes an event of a mission, new or repeated: a repeat means that the sender missed an
    /// acknowledgement.
    pub fn note(&mut self, mission: &str, now: Instant) {
        if let Some(pending) = self.pending.get_mut(mission) {
            pending.events += 1;
            if pending.events >= ACK_EVERY_EVENTS {
                pending.due = now;
            }
        } else {
            self.pending.insert(mission.to_owned(), Pending { events: 1, due: now + SOON });
        }
    }

    /// There is more to tell of a mission: its acknowledgement is due at once.
    pub fn make_due(&mut self, mission: &str, now: Instant) {
        let pending = self.pending.entry(mission.to_owned()).or_insert(Pending { events: 0, due: now });
        pending.due = now;
    }

    /// Removes and returns the missions whose acknowledgement is due.
    pub fn due(&mut self, now: Instant) -> Vec<String> {
        if self.pending.values().all(|pending| pending.due > now) {
            return Vec::new();
        }
        let due: Vec<_> = self
            .pending
            .iter()
            .filter(|(_, pending)| pending.due <= now)
            .map(|(mission, _)| mission.clone())
            .collect();
        self.pending.retain(|_, pending| pending.due > now);
        due
    }

    /// The missions with any event that no acknowledgement has told of.
    pub fn all(&self) -> Vec<String> {
        self.pending.keys().cloned().collect()
    }

    /// When the next one is due.
    pub fn next_due(&self) -> Option<Instant> {
        self.pending.values().map(|pending| pending.due).min()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_due_after_64_events_or_soon_after_the_first() {
        let start = Instant::now();
        let mut acknowledgements = Acknowledgements::default();
        acknowledgements.note("a", start);
        assert!(acknowledgements.due(start).is_empty());
        assert_eq!(acknowledgements.next_due(), Some(start + SOON));
        assert_eq!(acknowledgements.due(start + SOON), ["a"]);
        assert_eq!(acknowledgements.next_due(), None);
        for event in 1..=ACK_EVERY_EVENTS {
            assert!(acknowledgements.due(start).is_empty(), "{event}");
            acknowledgements.note("b", start);
        }
        acknowledgements.note("c", start);
        assert_eq!(acknowledgements.due(start), ["b"]);
        assert_eq!(acknowledgements.all(), ["c"]);
    }
}
