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
        let bytes = event.payload.len();
        let (offered, seq) = match (read(event), event.payload.head()) {
            (Ok(event), _) if self.has_no_room_for(&event, bytes) => return self.reject_ahead(event.seq()),
            (Ok(event), _) if !self.journal_writer.has_room(event.mission()) => {
                return self.reject_unwritten(event.seq());
            }
            (Ok(event), _) => {
                let seq = event.seq();
                (self.vehicle.offer(event), seq)
            }
            (Err(problem), Some(head)) => {
                let code = Code::from_name(&problem.code).unwrap_or(Code::Invalid);
                let mission = head.mission.as_str();
                (self.vehicle.refuse_undecodable(mission, head.seq, code, problem.message), head.seq)
            }
            (Err(problem), None) => return self.reject(problem),
        };
        if offered.refused.iter().all(|refusal| refusal.seq != seq) {
            self.ahead.note(&offered.mission, seq, bytes, offered.next_seq);
        }
        for refusal in &offered.refused {
            self.reject(refusal.problem());
        }
        if self.vehicle.mission(Some(&offered.mission)).is_ok() {
            self.journal_writer.note_event(Instant::now());
            self.acknowledgements.note(&offered.mission, Instant::now());
        }
    }

    fn has_no_room_for(&mut self, event: &Event, bytes: usize) -> bool {
        let next_seq = self.vehicle.mission(Some(event.mission())).map_or(0, |mission| mission.next_seq());
        event.seq() > next_seq && !self.ahead.has_room(bytes)
    }

    fn reject_unwritten(&mut self, seq: u64) {
        let message = format!(
            "too many events wait for a journal that cannot be written (rpc/mission tells why); send event {seq} again \
             once there is room"
        );
        self.reject(Problem::new(Code::Overloaded, message, Some(seq)));
    }

    fn reject_ahead(&mut self, seq: u64) {
        let message = format!(
            "the events that wait for a missing one take up ahead_bytes; send the missing ones (rpc/ingest tells), \
             then event {seq} again"
        );
        self.reject(Problem::new(Code::Overloaded, message, Some(seq)));
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
