//! Clocks, memory, and what is told of many times.

use serde::Serialize;

/// CPU time of this thread, ms.
pub fn cpu_ms() -> f64 {
    milliseconds(rustix::time::ClockId::ThreadCPUTime)
}

/// Time that passes, ms.
pub fn wall_ms() -> f64 {
    milliseconds(rustix::time::ClockId::Monotonic)
}

fn milliseconds(clock: rustix::time::ClockId) -> f64 {
    let time = rustix::time::clock_gettime(clock);
    time.tv_sec as f64 * 1e3 + time.tv_nsec as f64 * 1e-6
}

/// Result and CPU time of some work.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    let start = cpu_ms();
    let result = work();
    (result, cpu_ms() - start)
}

/// The middle one of an odd number of times, or the mean of the two in the middle.
pub fn median(times_ms: &[f64]) -> f64 {
    let mut sorted = times_ms.to_vec();
    sorted.sort_by(f64::total_cmp);
    match sorted.len() {
        0 => f64::NAN,
        count => 0.5 * (sorted[(count - 1) / 2] + sorted[count / 2]),
    }
}

/// What is told of many times, ms.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Summary {
    pub count: usize,
    pub sum: f64,
    pub median: f64,
    pub p99: f64,
    pub greatest: f64,
}

pub fn summary(times_ms: &[f64]) -> Summary {
    let mut sorted = times_ms.to_vec();
    sorted.sort_by(f64::total_cmp);
    let late = (sorted.len() * 99).div_ceil(100).saturating_sub(1);
    Summary {
        count: sorted.len(),
        sum: sorted.iter().sum(),
        median: median(&sorted),
        p99: sorted.get(late).copied().unwrap_or(f64::NAN),
        greatest: sorted.last().copied().unwrap_or(f64::NAN),
    }
}

/// Memory held now, MB.
pub fn resident_mb() -> f64 {
    status_mb("VmRSS:")
}

/// The most that was ever held, MB.
pub fn peak_mb() -> f64 {
    status_mb("VmHWM:")
}

fn status_mb(field: &str) -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix(field));
    let kilobytes = line.and_then(|rest| rest.trim().trim_end_matches(" kB").parse::<f64>().ok());
    kilobytes.map_or(f64::NAN, |kilobytes| kilobytes * 1024e-6)
}

/// Lets the most that was ever held count from now on.
pub fn forget_peak() -> std::io::Result<()> {
    std::fs::write("/proc/self/clear_refs", "5")
}
