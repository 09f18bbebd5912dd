//! Questions: `rpc/*`. Each is read in full before anything is done; then it waits for its event, is answered
//! from the mission as it stands, or becomes a job for the pool.

use super::Owner;
use super::deferred::{DeferredQuestion, Released};
use crate::planner::Job;
use pdn_schemas::EvaluateRequest;
use pdn_schemas::problem::{Code, Problem};
use pdn_schemas::topics::Topic;
use pdn_state::{DecisionRequest, StateError, WhatIf};
use pdn_transport::answer::Answer;
use pdn_transport::message::Question;
use pdn_transport::parameters::ParsedParameters;
use std::time::{Duration, Instant};

/// Longest `deadline_ms`; longer ones are taken for a mistake in the unit.
const MAX_DEADLINE_MS: u64 = 3_600_000;

/// A question that has been read in full.
pub struct ParsedQuestion {
    /// Id of the mission that it is about.
    pub mission: String,
    topic: Topic,
    request: Request,
    arrived: Instant,
    deadline: Option<Instant>,
}

/// The reply that a job's question waits for.
pub struct PendingReply {
    /// Where the answer goes.
    pub answer: Answer,
    /// Id of the mission that it is about.
    pub mission: String,
    /// What was asked.
    pub topic: Topic,
    /// When the question came.
    pub arrived: Instant,
    /// When the question had its event.
    pub released: Instant,
    /// When the answer is of no more use.
    pub deadline: Option<Instant>,
    /// Whether the answer is recorded before it is given.
    pub recorded: bool,
}

enum Request {
    Mission,
    Ingest,
    Coverage,
    LinkModel,
    Waypoints,
    Graph { from: Option<u64>, marginals: bool },
    Decision(DecisionRequest),
    Evaluate(Vec<Vec<[f64; 3]>>, DecisionRequest),
}

impl Owner {
    pub(super) fn take_question(&mut self, question: Question) {
        let (parsed, after) = match self.parse(&question) {
            Ok(parsed) => parsed,
            Err(problem) => return self.refuse(question.topic, question.answer, problem),
        };
        let next_seq = self.vehicle.mission(Some(&parsed.mission)).map_or(0, |mission| mission.next_seq());
        match after.filter(|&after| next_seq <= after) {
            None => self.dispatch(parsed, question.answer),
            Some(after) => {
                let expires = parsed.deadline.unwrap_or(question.arrived + self.wait);
                self.deferred.push(DeferredQuestion {
                    question: parsed,
                    answer: question.answer,
                    after,
                    expires,
                });
            }
        }
    }

    pub(super) fn release_deferred(&mut self, now: Instant) {
        if self.deferred.is_empty() {
            return;
        }
        let vehicle = &mut self.vehicle;
        let next_seq = |mission: &str| vehicle.mission(Some(mission)).ok().map(|mission| mission.next_seq());
        for (DeferredQuestion { question, answer, after, .. }, why) in self.deferred.release(now, next_seq) {
            let problem = match why {
                Released::Applied => {
                    self.dispatch(question, answer);
                    continue;
                }
                Released::Expired { next_seq } => {
                    let waited = now.duration_since(question.arrived).as_millis();
                    let message = format!(
                        "event {after} was not applied after {waited} ms; {next_seq} is the next one; send \
                         what is missing (rpc/ingest tells) and ask again"
                    );
                    Problem::new(Code::Deadline, message, None)
                }
                Released::Forgotten => {
                    let message = format!("mission \"{}\" is kept no longer", question.mission);
                    Problem::new(Code::UnknownMission, message, None)
                }
            };
            self.refuse(question.topic, answer, problem);
        }
    }

    pub(super) fn refuse_deferred(&mut self) {
        for DeferredQuestion { question, answer, after, .. } in self.deferred.take_all() {
            let message =
                format!("the service is shutting down, and event {after} has not come; ask again later");
            self.refuse(question.topic, answer, Problem::new(Code::NotReady, message, None));
        }
    }

    pub(super) fn refuse(&mut self, topic: Topic, answer: Answer, problem: Problem) {
        if let Some(left_out) = self.log.allow(Instant::now()) {
            let (question, Problem { code, message, .. }) = (topic.suffix(), &problem);
            tracing::warn!(vehicle = %self.id, question, code, left_out, "question refused: {message}");
        }
        self.outgoing.refuse(answer, problem);
    }

    /// The question, and the event that it waits for.
    fn parse(&mut self, question: &Question) -> Result<(ParsedQuestion, Option<u64>), Problem> {
        let topic = question.topic;
        let parameters = question.parameters.parse(topic)?;
        let request = parse_request(question, &parameters)?;
        let after = parameters.whole("after")?;
        let deadline = match parameters.whole("deadline_ms")? {
            Some(deadline_ms) if deadline_ms > MAX_DEADLINE_MS => {
                let message = format!("deadline_ms={deadline_ms} must lie in 0 to {MAX_DEADLINE_MS}");
                return Err(Problem::new(Code::OutOfRange, message, None));
            }
            deadline_ms => {
                deadline_ms.map(|deadline_ms| question.arrived + Duration::from_millis(deadline_ms))
            }
        };
        let mission = self.vehicle.mission(parameters.text("mission")).map_err(problem)?.id().to_owned();
        Ok((ParsedQuestion { mission, topic, request, arrived: question.arrived, deadline }, after))
    }

    /// Answers at once, or makes a job of it.
    fn dispatch(&mut self, question: ParsedQuestion, answer: Answer) {
        let ParsedQuestion { mission: id, topic, request, arrived, deadline } = question;
        let recorded = matches!(&request, Request::Decision(request) if !request.what_if.is_any());
        if recorded && let Err(problem) = self.journal_writer.ensure_writable(&mut self.vehicle, Some(&id)) {
            return self.refuse(topic, answer, problem);
        }
        let mission = match self.vehicle.mission(Some(&id)) {
            Ok(mission) => mission,
            Err(error) => return self.refuse(topic, answer, problem(error)),
        };
        let job = match request {
            Request::Mission => return self.outgoing.answer(answer, Ok(mission.state())),
            Request::Ingest => return self.outgoing.answer(answer, Ok(mission.ingest_status())),
            Request::Coverage => return self.outgoing.answer(answer, Ok(mission.coverage())),
            Request::LinkModel => return self.outgoing.answer(answer, Ok(mission.link_model())),
            Request::Waypoints => mission.begin_waypoints().map(Job::Waypoints),
            Request::Graph { from, marginals } => Ok(Job::Graph(mission.begin_graph(from, marginals))),
            Request::Decision(request) => mission.begin_decision(request).map(Job::Decision),
            Request::Evaluate(paths, request) => mission.begin_evaluate(paths, request).map(Job::Evaluate),
        };
        let released = Instant::now();
        let pending = PendingReply { answer, mission: id, topic, arrived, released, deadline, recorded };
        match job {
            Ok(job) => self.jobs.push((pending, job)),
            Err(error) => self.refuse(topic, pending.answer, problem(error)),
        }
    }
}

fn parse_request(question: &Question, parameters: &ParsedParameters) -> Result<Request, Problem> {
    if question.topic.payload().is_none() && !question.payload.is_empty() {
        let message = format!("{} takes no payload; send none", question.topic.suffix());
        return Err(Problem::new(Code::Invalid, message, None));
    }
    Ok(match question.topic {
        Topic::RpcMission => Request::Mission,
        Topic::RpcIngest => Request::Ingest,
        Topic::RpcCoverage => Request::Coverage,
        Topic::RpcLinkModel => Request::LinkModel,
        Topic::RpcWaypoints => Request::Waypoints,
        Topic::RpcGraph => {
            let (from, marginals) = (parameters.whole("from")?, parameters.flag("marginals")?);
            Request::Graph { from, marginals }
        }
        Topic::RpcDecision => Request::Decision(decision_request(parameters)?),
        Topic::RpcEvaluate => {
            let drawn: EvaluateRequest = question.payload.decode().map_err(|error| error.problem(None))?;
            Request::Evaluate(drawn.paths, decision_request(parameters)?)
        }
        topic => {
            let message = format!("{} is not answered by this version", topic.suffix());
            return Err(Problem::new(Code::Unsupported, message, None));
        }
    })
}

fn decision_request(parameters: &ParsedParameters) -> Result<DecisionRequest, Problem> {
    let detail = parameters.one_of("detail", &["brief", "full", "choice"])?;
    Ok(DecisionRequest {
        what_if: WhatIf {
            alpha: parameters.number("alpha")?,
            sigma_xy_m: parameters.number("sigma_xy_m")?,
            sigma_depth_m: parameters.number("sigma_depth_m")?,
            sigma_tilt_deg: parameters.number("sigma_tilt_deg")?,
            sigma_heading_deg: parameters.number("sigma_heading_deg")?,
        },
        full: matches!(detail, Some("full" | "choice")),
        choice_only: detail == Some("choice"),
    })
}

fn problem(error: StateError) -> Problem {
    error.problem(None)
}
