//! What the examples measure with.

/// CPU time of this thread, in milliseconds.
#[cfg(unix)]
pub fn now_ms() -> f64 {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    time.tv_sec as f64 * 1e3 + time.tv_nsec as f64 * 1e-6
}

/// Time since the start, in milliseconds.
#[cfg(not(unix))]
pub fn now_ms() -> f64 {
    static START: std::sync::LazyLock<std::time::Instant> = std::sync::LazyLock::new(std::time::Instant::now);
    START.elapsed().as_secs_f64() * 1e3
}

/// Median, 99th percentile and greatest of some times.
pub fn summary(milliseconds: &mut [f64]) -> String {
    milliseconds.sort_by(f64::total_cmp);
    let at = |share: f64| {
        milliseconds
            .get(((milliseconds.len() as f64 * share) as usize).min(milliseconds.len().saturating_sub(1)))
    };
    let [median, late, greatest] = [0.5, 0.99, 1.0].map(|share| at(share).copied().unwrap_or(f64::NAN));
    format!(
        "{} times, median {median:.3} ms, 99 % {late:.3} ms, greatest {greatest:.3} ms",
        milliseconds.len()
    )
}
