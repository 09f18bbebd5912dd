//! What vehicles publish: read, offered to the mission, and refused aloud.

use super::Owner;
use pdn_schemas::codec::CodecError;
use pdn_schemas::problem::{Code, Problem};
use pdn_schemas::topics::Topic;
use pdn_schemas::{Factor, Keyframe, LinkOutcome};
use pdn_state::{Event, Undecodable};
use pdn_transport::message;
use std::time::Instant;

impl Owner {
    pub(super) fn take_event(&mut self, event: &message::Event) {
        let sent_bytes = event.payload.len();
        let outcome = match read(event) {
            Ok(event) if !self.journal_writer.has_room(event.mission()) => {
                return self.reject_unwritten(event.seq());
            }
            Ok(event) => self.vehicle.offer(event, sent_bytes),
            Err(problem) => return self.reject(problem),
        };
        for refusal in &outcome.refused {
            self.reject(refusal.problem());
        }
        if self.vehicle.mission(Some(&outcome.mission)).is_ok() {
            self.journal_writer.note_event(Instant::now());
            self.acknowledgements.note(&outcome.mission, Instant::now());
        }
    }

    fn reject_unwritten(&mut self, seq: u64) {
        let message = format!(
            "too many events wait for a journal that cannot be written (rpc/mission tells why); send event \
             {seq} again once there is room"
        );
        self.reject(Problem::new(Code::Overloaded, message, Some(seq)));
    }

    pub(super) fn reject(&mut self, problem: Problem) {
        if let Some(left_out) = self.log.allow(Instant::now()) {
            tracing::warn!(
                vehicle = %self.id, code = problem.code, seq = problem.seq, left_out,
                "event refused: {}", problem.message
            );
        }
        self.outgoing.publish(Topic::OutRejected, problem);
    }
}

/// What was published. An event of which only the head can be read takes its place in the order, and is
/// refused there.
fn read(event: &message::Event) -> Result<Event, Problem> {
    decode(event).or_else(|problem| {
        let Some(head) = event.payload.head() else { return Err(problem) };
        let code = Code::from_name(&problem.code).unwrap_or(Code::Invalid);
        let (mission, message) = (head.mission.to_string(), problem.message);
        Ok(Event::Undecodable(Undecodable { mission, seq: head.seq, code, message }))
    })
}

fn decode(event: &message::Event) -> Result<Event, Problem> {
    let decoded = match event.topic {
        Topic::InKeyframe => event.payload.decode::<Keyframe>().map(Event::Keyframe),
        Topic::InFactor => event.payload.decode::<Factor>().map(Event::Factor),
        Topic::InLink => event.payload.decode::<LinkOutcome>().map(Event::Link),
        topic => {
            let message = format!("events of {} are not read by this version", topic.suffix());
            return Err(Problem::new(Code::Unsupported, message, None));
        }
    };
    decoded.map_err(|error: CodecError| error.problem(None))
}
