//! When a shutdown ends what goes on: told once, read by everyone.

use std::sync::{Arc, OnceLock};
use std::time::Instant;

/// The instant from which on nothing new is begun; none until the shutdown begins.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<OnceLock<Instant>>);

impl Stop {
    /// From `instant` on nothing new is begun.
    pub fn at(&self, instant: Instant) {
        // Only the first call of a shutdown counts.
        let _ = self.0.set(instant);
    }

    /// Whether that instant has come.
    pub fn has_come(&self, now: Instant) -> bool {
        self.0.get().is_some_and(|&instant| now >= instant)
    }
}
