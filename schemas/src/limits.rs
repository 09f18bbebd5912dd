//! Every bound of the contract, by name. What is larger is refused before memory is taken for it.

/// Bytes of the payload of an event, a question or a command.
pub const MAX_REQUEST_BYTES: usize = 4 * 1024 * 1024;

/// Bytes of the payload of a reply or a publication of the service: room for the graph of 100,000 keyframes
/// with their marginals.
pub const MAX_REPLY_BYTES: usize = 64 * 1024 * 1024;

/// Characters of the id of a vehicle, a mission or a console.
pub const MAX_ID_CHARS: usize = 64;

/// Characters of the parameters of a query.
pub const MAX_PARAMETERS_CHARS: usize = 4096;

/// Events of a mission that a sender may have under way, that is not yet known to be durable.
pub const EVENT_WINDOW: u64 = 512;

/// Events that wait in the service for a missing one, for each mission.
pub const MAX_BUFFERED_EVENTS: u64 = 2 * EVENT_WINDOW;

/// `out/ack` is published at least every so many events.
pub const ACK_EVERY_EVENTS: u64 = 64;

/// `out/ack` is published at least so often while events come, ms.
pub const ACK_EVERY_MS: u64 = 50;

/// `out/state` is published at least so often, ms.
pub const STATE_EVERY_MS: u64 = 1000;

/// A sender that has seen no progress for so long asks `rpc/ingest` and sends again, ms.
pub const RESEND_AFTER_MS: u64 = 750;

/// Ranges of missing events that `rpc/ingest` lists.
pub const MAX_MISSING_RANGES: usize = 64;

/// Keyframes of a mission.
pub const MAX_KEYFRAMES: u64 = 100_000;

/// Factors of a mission.
pub const MAX_FACTORS: u64 = 1_000_000;

/// Facets of a target.
pub const MAX_FACETS: usize = 1024;

/// Cells of the coverage raster over all facets.
pub const MAX_COVERAGE_CELLS: u64 = 100_000_000;

/// Points of a survey.
pub const MAX_SURVEY_POINTS: usize = 10_000;

/// Bins of each saliency in the table of link probabilities.
pub const MAX_LINK_BINS: u32 = 64;

/// Paths of one `rpc/evaluate`.
pub const MAX_EVALUATED_PATHS: usize = 256;

/// Points of one path of `rpc/evaluate`.
pub const MAX_PATH_POINTS: usize = 10_000;

/// Bytes of the `reason` of a command.
pub const MAX_REASON_BYTES: usize = 1024;

/// Every bound with its name, for the other language and the documents.
pub const ALL: &[(&str, u64)] = &[
    ("MAX_REQUEST_BYTES", MAX_REQUEST_BYTES as u64),
    ("MAX_REPLY_BYTES", MAX_REPLY_BYTES as u64),
    ("MAX_ID_CHARS", MAX_ID_CHARS as u64),
    ("MAX_PARAMETERS_CHARS", MAX_PARAMETERS_CHARS as u64),
    ("EVENT_WINDOW", EVENT_WINDOW),
    ("MAX_BUFFERED_EVENTS", MAX_BUFFERED_EVENTS),
    ("ACK_EVERY_EVENTS", ACK_EVERY_EVENTS),
    ("ACK_EVERY_MS", ACK_EVERY_MS),
    ("STATE_EVERY_MS", STATE_EVERY_MS),
    ("RESEND_AFTER_MS", RESEND_AFTER_MS),
    ("MAX_MISSING_RANGES", MAX_MISSING_RANGES as u64),
    ("MAX_KEYFRAMES", MAX_KEYFRAMES),
    ("MAX_FACTORS", MAX_FACTORS),
    ("MAX_FACETS", MAX_FACETS as u64),
    ("MAX_COVERAGE_CELLS", MAX_COVERAGE_CELLS),
    ("MAX_SURVEY_POINTS", MAX_SURVEY_POINTS as u64),
    ("MAX_LINK_BINS", MAX_LINK_BINS as u64),
    ("MAX_EVALUATED_PATHS", MAX_EVALUATED_PATHS as u64),
    ("MAX_PATH_POINTS", MAX_PATH_POINTS as u64),
    ("MAX_REASON_BYTES", MAX_REASON_BYTES as u64),
];
