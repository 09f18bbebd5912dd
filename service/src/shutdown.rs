//! The deadline of a shutdown: set once, read by everyone.

use std::sync::{Arc, OnceLock};
use std::time::Instant;

/// The instant from which on nothing new is begun; none until the shutdown begins.
#[derive(Clone, Debug, Default)]
pub struct ShutdownDeadline(Arc<OnceLock<Instant>>);

impl ShutdownDeadline {
    /// From `instant` on nothing new is begun. Only the first call counts.
    pub fn set(&self, instant: Instant) {
        let _ = self.0.set(instant);
    }

    /// Whether that instant has passed.
    pub fn has_passed(&self, now: Instant) -> bool {
        self.0.get().is_some_and(|&instant| now >= instant)
    }
}
