//! The wall clock, which is read nowhere else: what is measured or waited for goes by the monotonic clock.

use std::time::SystemTime;

/// Time since the Unix epoch, ns; 0 if the clock stands before it. It tells people when something happened
/// and decides nothing.
#[allow(clippy::disallowed_methods, reason = "the one place that reads the wall clock")]
pub fn now_ns() -> u64 {
    let since_epoch = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since_epoch.as_nanos()).unwrap_or(u64::MAX)
}
