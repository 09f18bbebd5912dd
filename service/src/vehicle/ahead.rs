//! Events that wait for a missing one: their number is bounded by the mission, their bytes here.

use std::collections::BTreeMap;

/// The bytes of the events that wait, over all missions of a vehicle.
#[derive(Debug)]
pub struct Ahead {
    max_bytes: usize,
    bytes: usize,
    waiting: BTreeMap<String, BTreeMap<u64, usize>>,
}

impl Ahead {
    /// None wait.
    pub fn new(max_bytes: usize) -> Ahead {
        Ahead { max_bytes, bytes: 0, waiting: BTreeMap::new() }
    }

    /// Whether an event of so many bytes may wait as well.
    pub fn has_room(&self, bytes: usize) -> bool {
        self.bytes + bytes <= self.max_bytes
    }

    /// Forgets the events of missions that are kept no longer.
    pub fn keep(&mut self, is_kept: impl Fn(&str) -> bool) {
        self.waiting.retain(|mission, _| is_kept(mission));
        self.bytes = self.waiting.values().flat_map(BTreeMap::values).sum();
    }

    /// Notes that an event of a mission has been taken and that all below `next_seq` are applied: it waits, or it
    /// was the missing one of others.
    pub fn note(&mut self, mission: &str, seq: u64, bytes: usize, next_seq: u64) {
        let waiting = self.waiting.entry(mission.to_owned()).or_default();
        if seq >= next_seq {
            self.bytes += bytes;
            self.bytes -= waiting.insert(seq, bytes).unwrap_or(0);
        }
        while let Some(first) = waiting.first_entry().filter(|first| *first.key() < next_seq) {
            self.bytes -= first.remove();
        }
        if waiting.is_empty() {
            self.waiting.remove(mission);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn room_is_taken_by_what_waits_and_given_back_by_what_is_applied() {
        let mut ahead = Ahead::new(10);
        ahead.note("a", 3, 4, 1);
        ahead.note("b", 9, 4, 0);
        ahead.note("a", 3, 4, 1); // A repeat takes no more.
        assert!(ahead.has_room(2) && !ahead.has_room(3));
        ahead.note("a", 1, 100, 2);
        assert!(!ahead.has_room(3));
        ahead.note("a", 2, 100, 4);
        assert!(ahead.has_room(6) && !ahead.has_room(7));
        ahead.keep(|mission| mission == "a");
        assert!(ahead.has_room(10));
    }
}
