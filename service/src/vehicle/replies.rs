//! From the outcome of a job to the reply: decisions are recorded, announced and told, in the order in which
//! they were computed.

use super::Owner;
use super::questions::PendingReply;
use crate::planner::{Computed, Outcome};
use pdn_schemas::reply::{Action, Decision, Timing};
use pdn_schemas::topics::Topic;
use pdn_state::DecisionOutcome;
use std::time::{Duration, Instant};

impl Owner {
    pub(super) fn conclude(&mut self, pending: PendingReply, computed: Computed) {
        let timing = timing(&pending, &computed);
        match computed.outcome {
            Ok(Outcome::Decision(outcome)) => self.conclude_decision(pending, *outcome, timing),
            Ok(Outcome::Evaluate(mut reply)) => {
                reply.timing = timing;
                self.outgoing.answer(pending.answer, Ok(*reply));
            }
            Ok(Outcome::Graph(reply)) => self.outgoing.answer(pending.answer, Ok(reply)),
            Ok(Outcome::Waypoints(reply)) => self.outgoing.answer(pending.answer, Ok(reply)),
            Err(problem) => self.refuse(pending.topic, pending.answer, problem),
        }
    }

    fn conclude_decision(&mut self, pending: PendingReply, outcome: DecisionOutcome, timing: Timing) {
        // What cannot be recorded is not counted either.
        if pending.recorded {
            let mission = Some(pending.mission.as_str());
            if let Err(problem) = self.journal_writer.ensure_writable(&mut self.vehicle, mission) {
                return self.refuse(pending.topic, pending.answer, problem);
            }
        }
        let mission = match self.vehicle.mission(Some(&pending.mission)) {
            Ok(mission) => mission,
            Err(error) => return self.refuse(pending.topic, pending.answer, error.problem(None)),
        };
        let decision = match mission.record(outcome, timing) {
            Ok(decision) => decision,
            Err(error) => return self.refuse(pending.topic, pending.answer, error.problem(None)),
        };
        if pending.recorded {
            self.sync();
            if let Err(problem) = self.journal_writer.check(&pending.mission, "the decision is not given") {
                return self.refuse(pending.topic, pending.answer, problem);
            }
        }
        self.log_decision(&decision);
        if decision.decision.is_some() {
            self.state_changed = true;
            self.outgoing.publish(Topic::OutDecided, decision.clone());
        }
        self.outgoing.answer(pending.answer, Ok(decision));
    }

    fn log_decision(&self, decision: &Decision) {
        let action = match decision.action {
            Action::Explore {} => "explore".to_owned(),
            Action::Revisit { keyframe, .. } => format!("revisit {keyframe}"),
        };
        tracing::info!(
            vehicle = %self.id,
            mission = decision.mission,
            decision = decision.decision,
            graph_seq = decision.graph_seq,
            action,
            candidates = decision.candidates.len(),
            complete = decision.complete,
            evaluate_ms = rounded(decision.timing.evaluate_ms),
            total_ms = rounded(decision.timing.total_ms),
            "decision"
        );
    }
}

fn timing(pending: &PendingReply, computed: &Computed) -> Timing {
    Timing {
        wait_ms: ms(pending.released.duration_since(pending.arrived)),
        queue_ms: ms(computed.began.duration_since(pending.released)),
        evaluate_ms: ms(computed.ended.duration_since(computed.began)),
        total_ms: ms(Instant::now().duration_since(pending.arrived)),
    }
}

fn ms(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}

/// As exact as a person reads it.
fn rounded(ms: f64) -> f64 {
    (ms * 10.0).round() / 10.0
}
