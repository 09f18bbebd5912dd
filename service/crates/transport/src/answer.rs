//! The answer to one question: exactly one reply, whatever happens.

use crate::parameters::Parameters;
use pdn_schemas::codec::{self, Format, Message};
use pdn_schemas::problem::{Code, Problem};
use std::fmt;
use tokio::sync::OwnedSemaphorePermit;
use zenoh::Wait;
use zenoh::bytes::Encoding;
use zenoh::query::Query;

/// A question that waits for its answer. Dropped without one, it answers `internal`: no client waits in vain.
pub struct Answer {
    query: Option<Query>,
    format: Format,
    permit: Option<OwnedSemaphorePermit>,
}

impl Answer {
    /// The place for the answer to `query`, whose parameters say in which format.
    pub fn new(query: Query, parameters: &Parameters) -> Answer {
        let format = if parameters.wants_bincode() { Format::Bincode } else { Format::Json };
        Answer { query: Some(query), format, permit: None }
    }

    /// Counts the question as in flight until its answer is sent.
    pub fn hold(&mut self, permit: OwnedSemaphorePermit) {
        self.permit = Some(permit);
    }

    /// Writes the reply and sends it. Waits while the link is congested, at most `wait_before_close`.
    pub fn send<T: Message>(mut self, reply: &Result<T, Problem>) {
        let Some(query) = self.query.take() else { return };
        let written = match reply {
            Ok(reply) => codec::encode(reply, self.format).map_err(|error| error.problem(None)),
            Err(problem) => Err(problem.clone()),
        };
        match written {
            Ok(bytes) => {
                let encoding = Encoding::from(codec::encoding::<T>(self.format));
                tell(&query, query.reply(query.key_expr(), bytes).encoding(encoding).wait());
            }
            Err(problem) => refuse(&query, &problem),
        }
    }

    /// Refuses at once, from wherever one is.
    pub fn refuse(mut self, problem: &Problem) {
        if let Some(query) = self.query.take() {
            refuse(&query, problem);
        }
    }
}

impl Drop for Answer {
    fn drop(&mut self) {
        if let Some(query) = self.query.take() {
            tracing::error!(key = %query.key_expr(), "a question was left without an answer");
            let problem = Problem::new(Code::Internal, "the question was lost; see the service's log", None);
            refuse(&query, &problem);
        }
    }
}

impl fmt::Debug for Answer {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_struct("Answer").field("format", &self.format).finish_non_exhaustive()
    }
}

fn refuse(query: &Query, problem: &Problem) {
    // A problem is strings and a number, which JSON always has a form for.
    let bytes = codec::encode(problem, Format::Json).unwrap_or_default();
    tell(query, query.reply_err(bytes).encoding(Encoding::APPLICATION_JSON).wait());
}

fn tell(query: &Query, sent: zenoh::Result<()>) {
    if let Err(error) = sent {
        tracing::warn!(key = %query.key_expr(), %error, "a reply could not be sent");
    }
}
