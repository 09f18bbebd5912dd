//! Questions: `rpc/*`. Read in full before anything is done, then they wait for their event, are answered from
//! the mission as it stands, or become a job for the pool.

use super::Owner;
use super::waiting::{Parked, Released};
use crate::planner::Job;
use pdn_schemas::EvaluateRequest;
use pdn_schemas::problem::{Code, Problem};
use pdn_schemas::topics::Topic;
use pdn_state::{DecisionRequest, StateError, WhatIf};
use pdn_transport::answer::Answer;
use pdn_transport::message::Question;
use pdn_transport::parameters::Named;
use std::time::{Duration, Instant};

/// Longest `deadline_ms`; longer ones are taken for a mistake in the unit.
const MAX_DEADLINE_MS: u64 = 3_600_000;

/// A question, read.
pub struct Prepared {
    /// Id of the mission that it is about.
    pub mission: String,
    topic: Topic,
    what: What,
    arrived: Instant,
    deadline: Option<Instant>,
}

/// A question that has become a job.
pub struct Asked {
    /// Where the answer goes.
    pub answer: Answer,
    /// Id of the mission that it is about.
    pub mission: String,
    /// What was asked.
    pub topic: Topic,
    /// When it came.
    pub arrived: Instant,
    /// When it stopped waiting for its event.
    pub released: Instant,
    /// When the answer is of no more use.
    pub deadline: Option<Instant>,
    /// Whether the answer is recorded before it is given.
    pub recorded: bool,
}

enum What {
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
    pub(super) fn ask(&mut self, question: Question) {
        let (prepared, after) = match self.prepare(&question) {
            Ok(prepared) => prepared,
            Err(problem) => return self.refuse(question.topic, question.answer, problem),
        };
        let next_seq = self.vehicle.mission(Some(&prepared.mission)).map_or(0, |mission| mission.next_seq());
        match after.filter(|&after| next_seq <= after) {
            None => self.begin(prepared, question.answer),
            Some(after) => {
                let patience = question.arrived + self.wait;
                let expires = prepared.deadline.unwrap_or(patience);
                self.waiting.park(Parked { prepared, answer: question.answer, after, expires });
            }
        }
    }

    pub(super) fn release_waiting(&mut self, now: Instant) {
        if self.waiting.is_empty() {
            return;
        }
        let vehicle = &mut self.vehicle;
        let next_seq = |mission: &str| vehicle.mission(Some(mission)).ok().map(|mission| mission.next_seq());
        for (Parked { prepared, answer, after, .. }, why) in self.waiting.release(now, next_seq) {
            let problem = match why {
                Released::Applied => {
                    self.begin(prepared, answer);
                    continue;
                }
                Released::Expired { next_seq } => {
                    let waited = now.duration_since(prepared.arrived).as_millis();
                    let message = format!(
                        "event {after} was not applied after {waited} ms; {next_seq} is the next one; send what is \
                         missing (rpc/ingest tells) and ask again"
                    );
                    Problem::new(Code::Deadline, message, None)
                }
                Released::Forgotten => {
                    let message = format!("mission \"{}\" is kept no longer", prepared.mission);
                    Problem::new(Code::UnknownMission, message, None)
                }
            };
            self.refuse(prepared.topic, answer, problem);
        }
    }

    pub(super) fn refuse_waiting(&mut self) {
        for Parked { prepared, answer, after, .. } in self.waiting.take_all() {
            let message =
                format!("the service is shutting down, and event {after} has not come; ask again later");
            self.refuse(prepared.topic, answer, Problem::new(Code::NotReady, message, None));
        }
    }

    pub(super) fn refuse(&mut self, topic: Topic, answer: Answer, problem: Problem) {
        if let Some(left_out) = self.log.allow(Instant::now()) {
            let question = topic.suffix();
            tracing::warn!(vehicle = %self.id, question, code = problem.code, left_out, "question refused: {}", problem.message);
        }
        self.outgoing.refuse(answer, problem);
    }

    fn prepare(&mut self, question: &Question) -> Result<(Prepared, Option<u64>), Problem> {
        let topic = question.topic;
        let named = question.parameters.named(topic)?;
        let what = read(question, &named)?;
        let after = named.whole("after")?;
        let deadline = match named.whole("deadline_ms")? {
            Some(deadline_ms) if deadline_ms > MAX_DEADLINE_MS => {
                let message = format!("deadline_ms={deadline_ms} must lie in 0 to {MAX_DEADLINE_MS}");
                return Err(Problem::new(Code::OutOfRange, message, None));
            }
            deadline_ms => {
                deadline_ms.map(|deadline_ms| question.arrived + Duration::from_millis(deadline_ms))
            }
        };
        let mission = self.vehicle.mission(named.text("mission")).map_err(problem)?.id().to_owned();
        Ok((Prepared { mission, topic, what, arrived: question.arrived, deadline }, after))
    }

    fn begin(&mut self, prepared: Prepared, answer: Answer) {
        let Prepared { mission: id, topic, what, arrived, deadline } = prepared;
        let recorded = matches!(&what, What::Decision(request) if !request.what_if.is_any());
        if recorded && let Err(problem) = self.journal_writer.ensure_writable(&mut self.vehicle, Some(&id)) {
            return self.refuse(topic, answer, problem);
        }
        let mission = match self.vehicle.mission(Some(&id)) {
            Ok(mission) => mission,
            Err(error) => return self.refuse(topic, answer, problem(error)),
        };
        let job = match what {
            What::Mission => return self.outgoing.answer(answer, Ok(mission.state())),
            What::Ingest => return self.outgoing.answer(answer, Ok(mission.ingest_status())),
            What::Coverage => return self.outgoing.answer(answer, Ok(mission.coverage())),
            What::LinkModel => return self.outgoing.answer(answer, Ok(mission.link_model())),
            What::Waypoints => mission.begin_waypoints().map(Job::Waypoints),
            What::Graph { from, marginals } => Ok(Job::Graph(mission.begin_graph(from, marginals))),
            What::Decision(request) => mission.begin_decision(request).map(Job::Decision),
            What::Evaluate(paths, request) => mission.begin_evaluate(paths, request).map(Job::Evaluate),
        };
        let asked =
            Asked { answer, mission: id, topic, arrived, released: Instant::now(), deadline, recorded };
        match job {
            Ok(job) => self.ready.push_back((asked, job)),
            Err(error) => self.refuse(topic, asked.answer, problem(error)),
        }
    }
}

fn read(question: &Question, named: &Named) -> Result<What, Problem> {
    if question.topic.payload().is_none() && !question.payload.is_empty() {
        let message = format!("{} takes no payload; send none", question.topic.suffix());
        return Err(Problem::new(Code::Invalid, message, None));
    }
    Ok(match question.topic {
        Topic::RpcMission => What::Mission,
        Topic::RpcIngest => What::Ingest,
        Topic::RpcCoverage => What::Coverage,
        Topic::RpcLinkModel => What::LinkModel,
        Topic::RpcWaypoints => What::Waypoints,
        Topic::RpcGraph => What::Graph { from: named.whole("from")?, marginals: named.yes("marginals")? },
        Topic::RpcDecision => What::Decision(request(named)?),
        Topic::RpcEvaluate => {
            let drawn: EvaluateRequest = question.payload.decode().map_err(|error| error.problem(None))?;
            What::Evaluate(drawn.paths, request(named)?)
        }
        topic => {
            let message = format!("{} is not answered by this version", topic.suffix());
            return Err(Problem::new(Code::Unsupported, message, None));
        }
    })
}

fn request(named: &Named) -> Result<DecisionRequest, Problem> {
    let detail = named.one_of("detail", &["brief", "full", "choice"])?;
    Ok(DecisionRequest {
        what_if: WhatIf {
            alpha: named.number("alpha")?,
            sigma_xy_m: named.number("sigma_xy_m")?,
            sigma_depth_m: named.number("sigma_depth_m")?,
            sigma_tilt_deg: named.number("sigma_tilt_deg")?,
            sigma_heading_deg: named.number("sigma_heading_deg")?,
        },
        full: matches!(detail, Some("full" | "choice")),
        choice_only: detail == Some("choice"),
    })
}

fn problem(error: StateError) -> Problem {
    error.problem(None)
}
