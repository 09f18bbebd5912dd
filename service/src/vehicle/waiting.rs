//! Questions with `after=` that wait for their event.

use super::questions::Prepared;
use pdn_transport::answer::Answer;
use std::time::Instant;

/// The questions that wait, in the order in which they came. Their number is bounded by
/// `max_questions_in_flight`.
#[derive(Default)]
pub struct Waiting {
    parked: Vec<Parked>,
}

/// A question that waits.
pub struct Parked {
    /// What is asked.
    pub prepared: Prepared,
    /// Where the answer goes.
    pub answer: Answer,
    /// The event that must be applied.
    pub after: u64,
    /// When waiting ends.
    pub expires: Instant,
}

/// Why a question waits no longer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Released {
    /// Its event has been applied.
    Applied,
    /// Its time is up; the number that is applied next.
    Expired {
        /// All events below are applied.
        next_seq: u64,
    },
    /// Its mission is kept no longer.
    Forgotten,
}

impl Waiting {
    /// Lets a question wait.
    pub fn park(&mut self, parked: Parked) {
        self.parked.push(parked);
    }

    /// Whether none waits.
    pub fn is_empty(&self) -> bool {
        self.parked.is_empty()
    }

    /// When the first one's time is up.
    pub fn next_expiry(&self) -> Option<Instant> {
        self.parked.iter().map(|parked| parked.expires).min()
    }

    /// Takes out those that wait no longer; `next_seq` tells how far a mission is.
    pub fn release(
        &mut self,
        now: Instant,
        mut next_seq: impl FnMut(&str) -> Option<u64>,
    ) -> Vec<(Parked, Released)> {
        let mut released = Vec::new();
        let mut index = 0;
        while let Some(parked) = self.parked.get(index) {
            let why = match next_seq(&parked.prepared.mission) {
                None => Some(Released::Forgotten),
                Some(next_seq) if next_seq > parked.after => Some(Released::Applied),
                Some(next_seq) if now >= parked.expires => Some(Released::Expired { next_seq }),
                Some(_) => None,
            };
            match why {
                Some(why) => released.push((self.parked.remove(index), why)),
                None => index += 1,
            }
        }
        released
    }

    /// Takes out all.
    pub fn take_all(&mut self) -> Vec<Parked> {
        std::mem::take(&mut self.parked)
    }
}
