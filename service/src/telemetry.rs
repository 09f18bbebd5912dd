//! Log lines: to standard error, for a person or as JSON, and rate-limited where others decide how many there
//! are.

use crate::settings::LogFormat;
use std::borrow::Cow;
use std::io::{self, IsTerminal, Write};
use std::time::{Duration, Instant};
use tracing_subscriber::EnvFilter;

/// Starts logging. A plain level is that of pdnd's own lines; Zenoh's are then told from warnings on. Faults
/// of threads (panics) are logged as errors too.
pub fn start(format: LogFormat, level: &str) {
    let plain = level.chars().all(char::is_alphabetic);
    let filter = if plain { format!("{level},zenoh=warn") } else { level.to_owned() };
    let filter = EnvFilter::try_new(filter).unwrap_or_else(|_| EnvFilter::new("info"));
    let lines =
        tracing_subscriber::fmt().with_env_filter(filter).with_writer(|| Explained(std::io::stderr()));
    match format {
        LogFormat::Human => {
            lines.with_target(false).with_ansi(std::io::stderr().is_terminal()).init();
        }
        LogFormat::Json => lines.json().flatten_event(true).init(),
    }
    std::panic::set_hook(Box::new(|fault| {
        let thread = std::thread::current();
        tracing::error!(thread = thread.name().unwrap_or("unnamed"), %fault, "a thread has failed");
    }));
}

/// What Zenoh says of every connection that it could not accept, whatever the reason.
const FILE_HINT: &str = "Hint: increase the system open file limit.";

/// What is so unless the system says that files are too many.
const HANDSHAKE_HINT: &str = "A client has not got through the TLS handshake: its certificate, key or clock, \
                              the authority on either side, or it speaks no TLS.";

/// Lines on their way to be written, with the right hint where Zenoh's is wrong.
struct Explained<W>(W);

impl<W: Write> Write for Explained<W> {
    /// Takes a whole line, as the formatter gives it.
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        self.0.write_all(explained(&String::from_utf8_lossy(line)).as_bytes())?;
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

fn explained(line: &str) -> Cow<'_, str> {
    if !line.contains(FILE_HINT) || line.contains("os error 24") || line.contains("os error 23") {
        return Cow::Borrowed(line);
    }
    Cow::Owned(line.replace(FILE_HINT, HANDSHAKE_HINT))
}

/// Lets so many lines a second through and counts the others: a limiter with a fixed window.
#[derive(Debug)]
pub struct LogRateLimiter {
    window_start: Option<Instant>,
    lines: u32,
    left_out: u64,
}

const LINES_A_SECOND: u32 = 5;

impl LogRateLimiter {
    /// Lets the first line through.
    pub const fn new() -> LogRateLimiter {
        LogRateLimiter { window_start: None, lines: 0, left_out: 0 }
    }

    /// Whether a line may be written now; if so, how many were left out since the last.
    pub fn allow(&mut self, now: Instant) -> Option<u64> {
        if self.window_start.is_none_or(|start| now.duration_since(start) >= Duration::from_secs(1)) {
            self.window_start = Some(now);
            self.lines = 0;
        }
        if self.lines == LINES_A_SECOND {
            self.left_out += 1;
            return None;
        }
        self.lines += 1;
        Some(std::mem::take(&mut self.left_out))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The lines are those of zenoh-link-tls 1.10.2.
    #[test]
    fn a_refused_certificate_is_not_told_as_a_want_of_files() {
        let refused = "WARN peer sent no certificates. Hint: increase the system open file limit.\n";
        let mut written = Vec::new();
        let mut lines = Explained(&mut written);
        lines.write_all(refused.as_bytes()).expect("memory is written");
        let written = String::from_utf8(written).expect("text");
        assert!(written.contains("peer sent no certificates. A client has not got through"), "{written}");
        assert!(!written.contains("file limit") && written.ends_with('\n'), "{written}");
        for kept in [
            "WARN Too many open files (os error 24). Hint: increase the system open file limit.\n",
            "WARN something else\n",
        ] {
            assert_eq!(explained(kept), kept);
        }
    }

    #[test]
    fn a_flood_is_thinned_and_counted() {
        let start = Instant::now();
        let mut limiter = LogRateLimiter::new();
        let written = (0..100).filter(|_| limiter.allow(start).is_some()).count();
        assert_eq!(written, LINES_A_SECOND as usize);
        assert_eq!(limiter.allow(start + Duration::from_secs(1)), Some(95));
    }
}
