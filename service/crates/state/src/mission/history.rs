//! What changes a mission, as it happens and noted in its history, or replayed from there.

use super::{GroupStart, Mission, encode};
use crate::answer::DecisionOutcome;
use crate::checkpoint::Checkpoint;
use crate::error::StateError;
use crate::event::Event;
use crate::history::{Entry, Record, SOFTWARE};
use crate::ingest::{Arrival, Room};
use crate::lifecycle::{self, Operation};
use crate::outcome::Refusal;
use pdn_schemas::problem::{Code, Problem};
use pdn_schemas::record::{CommandTaken, Configured, DecisionTaken, Reopened};
use pdn_schemas::reply::{Action, Decision, Phase, Timing};

impl Mission {
    /// Records of its history so far.
    pub fn records(&self) -> u64 {
        self.log.records()
    }

    /// From now on its history is kept, `configured` being the last record so far.
    pub(crate) fn keep_history(&mut self, configured: Configured) -> Result<(), StateError> {
        let before = self.records() - 1;
        self.log.keep(before);
        self.log.add(&Entry::Configured(Box::new(configured)))
    }

    /// From now on its history is kept again, all of it so far being durable.
    pub(crate) fn go_on(&mut self) {
        self.log.keep(self.records());
        self.log.mark_durable(self.next_seq());
    }

    /// What of its history is still to be written; from now on it is the caller's.
    pub(crate) fn take_unwritten(&mut self) -> Vec<Record> {
        self.log.take_unwritten()
    }

    /// Every event below is durable.
    pub fn set_durable(&mut self, durable_seq: u64) {
        self.log.mark_durable(durable_seq);
    }

    /// Numbers, counts and notes a decision, in the order of the calls; a what-if stays without a number.
    /// `timing` is told with it.
    ///
    /// # Errors
    /// [`StateError::Internal`] if it is too large to be recorded; nothing has changed then.
    pub fn record(&mut self, outcome: DecisionOutcome, timing: Timing) -> Result<Decision, StateError> {
        let DecisionOutcome { mut decision, request, basis, link_model } = outcome;
        decision.timing = timing;
        if request.what_if.is_any() {
            return Ok(decision);
        }
        decision.decision = Some(self.decisions);
        self.log.push(|| {
            let decision = Decision { link_model: Some(link_model), ..decision.clone() };
            let (full, choice_only) = (request.full, request.choice_only);
            let taken = DecisionTaken { basis, full, choice_only, software: SOFTWARE.to_owned(), decision };
            Entry::Decided(Box::new(taken)).record()
        })?;
        self.count(&decision);
        Ok(decision)
    }

    pub(crate) fn command(
        &mut self,
        operation: Operation,
        reason: &str,
        at_ns: u64,
    ) -> Result<(), StateError> {
        self.obey(operation, reason, at_ns)?;
        let (operation, reason) = (operation.name().to_owned(), reason.to_owned());
        self.log.add(&Entry::Command(CommandTaken { operation, reason, at_ns }))
    }

    /// The daemon was started anew: what was under way is held until someone resumes.
    pub(crate) fn reopen(&mut self, at_ns: u64) -> Result<(), StateError> {
        let reopened = Reopened { at_ns, software: SOFTWARE.to_owned() };
        self.hold_after_restart(&reopened);
        self.log.add(&Entry::Reopened(reopened))
    }

    pub(super) fn note_refused(&mut self, refused: &[Refusal]) {
        for refusal in refused {
            // A problem is two short texts and a number, which can always be written.
            let _ = self.log.add(&Entry::Refused(refusal.problem()));
        }
    }

    /// Notes an event that was refused without consuming its number; not for want of room, which will come
    /// again.
    pub(super) fn note_turned_away(&mut self, refusal: &Refusal) {
        if refusal.error.code() == Code::Overloaded {
            return;
        }
        let _ = self.log.turn_away(&Entry::TurnedAway(refusal.problem()));
    }

    /// From now on nothing of its history is solved for, until it is at the checkpoint.
    pub(crate) fn begin_fast_forward(&mut self) {
        self.forward = Some(Box::default());
    }

    /// Arrives at a checkpoint, whose event is the last that was read.
    ///
    /// # Errors
    /// Why it cannot be a checkpoint of this history.
    pub(crate) fn finish_fast_forward(&mut self, checkpoint: Checkpoint) -> Result<(), String> {
        let Checkpoint { record, rejected, solved } = checkpoint;
        let forward = self.forward.take().ok_or("it comes too late")?;
        if let [refusal, ..] = self.fold.finish_fast_forward(*forward, solved)?.as_slice() {
            return Err(format!("its event {} is refused", refusal.seq));
        }
        self.rejected = rejected;
        self.group = self.fold.group_seq().map(|seq| GroupStart { seq, record, rejected });
        Ok(())
    }

    /// Takes an entry of its history again. Returns what it makes the mission refuse.
    ///
    /// # Errors
    /// Why the mission cannot have had this history.
    pub(crate) fn replay(&mut self, entry: Entry) -> Result<Vec<Problem>, StateError> {
        let kind = entry.kind();
        let refused = match entry {
            Entry::Event(event) => self.replay_event(event)?,
            Entry::Command(taken) => {
                let named = Operation::named(&taken.operation);
                let operation = named.ok_or_else(|| impossible(&format!("op/{}", taken.operation)))?;
                self.obey(operation, &taken.reason, taken.at_ns)?;
                Vec::new()
            }
            Entry::Decided(taken) if taken.decision.decision == Some(self.decisions) => {
                self.count(&taken.decision);
                Vec::new()
            }
            Entry::Decided(_) => return Err(impossible("a decision whose number is not the next")),
            Entry::Configured(_) => return Err(impossible("a configuration in its midst")),
            Entry::Reopened(reopened) => {
                self.hold_after_restart(&reopened);
                Vec::new()
            }
            Entry::Refused(problem) => {
                if let (Some(seq), Some(code)) = (problem.seq, Code::from_name(&problem.code)) {
                    self.recent.refuse(seq, code);
                }
                if let (Some(forward), Some(seq)) = (&mut self.forward, problem.seq) {
                    forward.refuse(seq);
                }
                Vec::new()
            }
            Entry::TurnedAway(_) => Vec::new(),
        };
        self.log.skip(kind);
        Ok(refused)
    }

    fn replay_event(&mut self, event: Event) -> Result<Vec<Problem>, StateError> {
        if event.mission() != self.id() {
            return Err(impossible(&format!("an event of mission \"{}\"", event.mission())));
        }
        if lifecycle::has_ended(self.phase) {
            return Err(impossible("an event after its end"));
        }
        let (seq, next_seq) = (event.seq(), self.next_seq());
        let room = Room { buffered: 0, ..self.room() };
        match self.ingest.take(encode(event)?, 0, room)? {
            Arrival::Due(mut due) if due.len() == 1 => {
                let record = self.records();
                let refused = due.pop().map(|event| self.consume(event.event, record)).unwrap_or_default();
                Ok(refused.iter().map(Refusal::problem).collect())
            }
            _ => Err(impossible(&format!("event {seq} where {next_seq} is the next"))),
        }
    }

    fn obey(&mut self, operation: Operation, reason: &str, at_ns: u64) -> Result<(), StateError> {
        if reason.len() > self.limits.max_reason_bytes {
            return Err(StateError::TooLong {
                field: "reason".to_string(),
                count: reason.len() as u64,
                bound: "max_reason_bytes",
                limit: self.limits.max_reason_bytes as u64,
            });
        }
        self.phase = lifecycle::transition(self.phase, operation).map_err(StateError::IllegalTransition)?;
        let by_itself = || format!("{} by \"{}\"", lifecycle::name(self.phase), operation.name());
        self.reason = if reason.is_empty() { by_itself() } else { reason.to_string() };
        self.since_ns = at_ns;
        Ok(())
    }

    fn hold_after_restart(&mut self, reopened: &Reopened) {
        if lifecycle::is_active(self.phase) {
            let before = lifecycle::name(self.phase);
            self.reason = format!("pdnd was started anew, the mission was {before}; resume it to go on");
            self.phase = Phase::Held;
            self.since_ns = reopened.at_ns;
        }
    }

    fn count(&mut self, decision: &Decision) {
        self.decisions += 1;
        self.revisits += u64::from(matches!(decision.action, Action::Revisit { .. }));
    }
}

fn impossible(what: &str) -> StateError {
    StateError::Invalid { field: "history".to_string(), problem: format!("it cannot have {what}") }
}
