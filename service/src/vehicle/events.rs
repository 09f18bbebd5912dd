//! What vehicles publish: read, offered to the mission, and refused aloud.

use super::Owner;
use pdn_schemas::codec::CodecError;
use pdn_schemas::problem::{Code, Problem};
use pdn_schemas::topics::Topic;
use pdn_schemas::{Factor, Keyframe, LinkOutcome};
use pdn_state::Event;
use pdn_transport::message;
use std::time::Instant;

impl Owner {
    pub(super) fn take_event(&mut self, event: &message::Event) {
        let offered = match (read(event), event.payload.head()) {
            (Ok(event), _) => self.vehicle.offer(event),
            (Err(problem), Some(head)) => {
                let code = Code::from_name(&problem.code).unwrap_or(Code::Invalid);
                self.vehicle.refuse_undecodable(head.mission.as_str(), head.seq, code, problem.message)
            }
            (Err(problem), None) => return self.reject(problem),
        };
        for refusal in &offered.refused {
            self.reject(refusal.problem());
        }
        if self.vehicle.mission(Some(&offered.mission)).is_ok() {
            self.acknowledgements.note(&offered.mission, Instant::now());
        }
    }

    pub(super) fn reject(&mut self, problem: Problem) {
        if let Some(left_out) = self.log.allow(Instant::now()) {
            tracing::warn!(
                vehicle = %self.id, code = problem.code, seq = problem.seq, left_out, "event refused: {}", problem.message
            );
        }
        self.outgoing.publish(Topic::OutRejected, problem);
    }
}

fn read(event: &message::Event) -> Result<Event, Problem> {
    let read = match event.topic {
        Topic::InKeyframe => event.payload.decode::<Keyframe>().map(Event::Keyframe),
        Topic::InFactor => event.payload.decode::<Factor>().map(Event::Factor),
        Topic::InLink => event.payload.decode::<LinkOutcome>().map(Event::Link),
        topic => {
            let message = format!("events of {} are not read by this version", topic.suffix());
            return Err(Problem::new(Code::Unsupported, message, None));
        }
    };
    read.map_err(|error: CodecError| error.problem(None))
}
