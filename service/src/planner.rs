//! The pool that computes answers, over immutable views of missions, for all vehicles.
//!
//! A vehicle has at most as many jobs in the pool as it has threads; what else it was asked waits with its
//! own thread. So no vehicle waits for more than one job a thread of each other, however much one of them is
//! asked.

use crate::shutdown::ShutdownDeadline;
use pdn_schemas::problem::{Code, Problem};
use pdn_schemas::reply::{EvaluateReply, GraphReply, WaypointsReply};
use pdn_state::{DecisionJob, DecisionOutcome, EvaluateJob, GraphJob, StateError, WaypointsJob};
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::Instant;

/// The pool, shared.
#[derive(Clone)]
pub struct Planner {
    pool: Arc<ThreadPool>,
    shutdown: ShutdownDeadline,
}

/// What takes long to answer.
pub enum Job {
    /// `rpc/decision`.
    Decision(DecisionJob),
    /// `rpc/evaluate`.
    Evaluate(EvaluateJob),
    /// `rpc/graph`.
    Graph(GraphJob),
    /// `rpc/waypoints`.
    Waypoints(WaypointsJob),
}

/// What came of it.
pub enum Outcome {
    /// To be recorded by the vehicle's thread before it is told.
    Decision(Box<DecisionOutcome>),
    /// The reply.
    Evaluate(Box<EvaluateReply>),
    /// The reply.
    Graph(GraphReply),
    /// The reply.
    Waypoints(WaypointsReply),
}

/// An outcome with its times.
pub struct Computed {
    /// The outcome, or why there is none.
    pub outcome: Result<Outcome, Problem>,
    /// When a thread began.
    pub began: Instant,
    /// When it was done.
    pub ended: Instant,
}

impl Planner {
    /// A pool of so many threads; once `shutdown` has passed every job stops as if its deadline had.
    pub fn new(threads: usize, shutdown: ShutdownDeadline) -> Result<Planner, ThreadPoolBuildError> {
        let pool = ThreadPoolBuilder::new()
            .num_threads(threads.max(1))
            .thread_name(|index| format!("plan {index}"))
            .build()?;
        Ok(Planner { pool: Arc::new(pool), shutdown })
    }

    /// Jobs that one vehicle may have in the pool.
    pub fn jobs_at_once(&self) -> usize {
        self.pool.current_num_threads()
    }

    /// Runs a job on the pool and hands what came of it to `done`, whatever happens: a fault in the job is an
    /// `internal` problem of this question only.
    pub fn start(&self, job: Job, deadline: Option<Instant>, done: impl FnOnce(Computed) + Send + 'static) {
        let Planner { pool, shutdown } = self.clone();
        self.pool.spawn(move || {
            let began = Instant::now();
            let stop = move || {
                let now = Instant::now();
                deadline.is_some_and(|deadline| now >= deadline) || shutdown.has_passed(now)
            };
            let outcome = guarded(|| job.run(&pool, &stop));
            done(Computed { outcome, began, ended: Instant::now() });
        });
    }
}

/// A fault becomes a problem of the question; the job owns all that it changes, so nothing is left half done.
fn guarded(run: impl FnOnce() -> Result<Outcome, StateError>) -> Result<Outcome, Problem> {
    match catch_unwind(AssertUnwindSafe(run)) {
        Ok(outcome) => outcome.map_err(|error| error.problem(None)),
        Err(_) => {
            let message =
                "computing the answer failed; the mission goes on; please report this with the service's log";
            Err(Problem::new(Code::Internal, message, None))
        }
    }
}

impl Job {
    fn run(&self, pool: &ThreadPool, stop: &(dyn Fn() -> bool + Sync)) -> Result<Outcome, StateError> {
        match self {
            // A decision that is stopped before it begins still has an answer: what is left is exploring.
            Job::Decision(job) => job.run(pool, stop).map(|outcome| Outcome::Decision(Box::new(outcome))),
            _ if stop() => Err(StateError::Stopped),
            Job::Evaluate(job) => job.run(pool, stop).map(|reply| Outcome::Evaluate(Box::new(reply))),
            Job::Graph(job) => job.run().map(Outcome::Graph),
            Job::Waypoints(job) => job.run().map(Outcome::Waypoints),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_in_a_job_is_a_problem_of_its_question() {
        let problem = guarded(|| panic!("a fault on purpose")).err().expect("no outcome");
        assert_eq!(problem.code, "internal");
        let refused = guarded(|| Err(StateError::Stopped)).err().expect("no outcome");
        assert_eq!(refused.code, "deadline");
    }
}
