//! From what was computed to the reply: decisions are recorded, announced and told, in the order in which they
//! were computed.

use super::Owner;
use super::questions::Asked;
use crate::planner::{Computed, Outcome};
use pdn_schemas::reply::{Action, Decision, Timing};
use pdn_schemas::topics::Topic;
use pdn_state::DecisionOutcome;
use std::time::{Duration, Instant};

impl Owner {
    pub(super) fn conclude(&mut self, asked: Asked, computed: Computed) {
        self.running -= 1;
        let timing = timing(&asked, &computed);
        match computed.outcome {
            Ok(Outcome::Decision(outcome)) => self.conclude_decision(asked, *outcome, timing),
            Ok(Outcome::Evaluate(mut reply)) => {
                reply.timing = timing;
                self.outgoing.answer(asked.answer, Ok(*reply));
            }
            Ok(Outcome::Graph(reply)) => self.outgoing.answer(asked.answer, Ok(reply)),
            Ok(Outcome::Waypoints(reply)) => self.outgoing.answer(asked.answer, Ok(reply)),
            Err(problem) => self.refuse(asked.topic, asked.answer, problem),
        }
    }

    fn conclude_decision(&mut self, asked: Asked, outcome: DecisionOutcome, timing: Timing) {
        // What cannot be recorded is not counted either.
        if asked.recorded
            && let Err(problem) = self.journal_writer.ensure_writable(&mut self.vehicle, Some(&asked.mission))
        {
            return self.refuse(asked.topic, asked.answer, problem);
        }
        let mission = match self.vehicle.mission(Some(&asked.mission)) {
            Ok(mission) => mission,
            Err(error) => return self.refuse(asked.topic, asked.answer, error.problem(None)),
        };
        let decision = match mission.record(outcome, timing) {
            Ok(decision) => decision,
            Err(error) => return self.refuse(asked.topic, asked.answer, error.problem(None)),
        };
        if asked.recorded {
            self.sync();
            if let Err(problem) = self.journal_writer.check(&asked.mission, "the decision is not given") {
                return self.refuse(asked.topic, asked.answer, problem);
            }
        }
        self.log_decision(&decision);
        if decision.decision.is_some() {
            self.state_changed = true;
            self.outgoing.publish(Topic::OutDecided, decision.clone());
        }
        self.outgoing.answer(asked.answer, Ok(decision));
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

fn timing(asked: &Asked, computed: &Computed) -> Timing {
    Timing {
        wait_ms: ms(asked.released.duration_since(asked.arrived)),
        queue_ms: ms(computed.began.duration_since(asked.released)),
        evaluate_ms: ms(computed.ended.duration_since(computed.began)),
        total_ms: ms(Instant::now().duration_since(asked.arrived)),
    }
}

fn ms(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}

/// As exact as a person reads it.
fn rounded(ms: f64) -> f64 {
    (ms * 10.0).round() / 10.0
}
