//! A vehicle's jobs: those that are ready wait here, so many run at once, and each brings its outcome back.
//!
//! Their number is bounded by `max_questions_in_flight`, since each is a question that is not answered yet.
//! The channel of the outcomes has room for as many as run at once: no job waits for the owner, and none is
//! lost.

use std::collections::VecDeque;
use tokio::sync::mpsc;

/// Jobs `J` with outcomes `R`.
pub struct Jobs<J, R> {
    ready: VecDeque<J>,
    max_running: usize,
    running: usize,
    sender: mpsc::Sender<R>,
    outcomes: mpsc::Receiver<R>,
}

/// The way back of one job's outcome.
pub struct Completion<R>(mpsc::Sender<R>);

impl<J, R> Jobs<J, R> {
    /// None yet; at most `max_running` will run at once, at least one.
    pub fn new(max_running: usize) -> Jobs<J, R> {
        let max_running = max_running.max(1);
        let (sender, outcomes) = mpsc::channel(max_running);
        Jobs { ready: VecDeque::new(), max_running, running: 0, sender, outcomes }
    }

    /// Adds a job that is ready.
    pub fn push(&mut self, job: J) {
        self.ready.push_back(job);
    }

    /// Starts as many as may run, in the order in which they came.
    pub fn start_ready(&mut self, mut start: impl FnMut(J, Completion<R>)) {
        while self.running < self.max_running {
            let Some(job) = self.ready.pop_front() else { break };
            self.running += 1;
            start(job, Completion(self.sender.clone()));
        }
    }

    /// The next outcome. Cancelled, it takes none.
    pub async fn next_outcome(&mut self) -> Option<R> {
        let outcome = self.outcomes.recv().await?;
        self.running -= 1;
        Some(outcome)
    }

    /// Whether none is ready and none runs.
    pub fn is_empty(&self) -> bool {
        self.ready.is_empty() && self.running == 0
    }
}

impl<R> Completion<R> {
    /// Brings the outcome back; nobody waits.
    pub fn send(self, outcome: R) {
        // There is room for each job that runs. The owner outlives its jobs unless it has failed; then nobody
        // is left to be told.
        let _ = self.0.try_send(outcome);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn there_is_room_for_the_outcome_of_every_job_that_runs() {
        let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
        let mut jobs = Jobs::new(2);
        (0..5).for_each(|job| jobs.push(job));
        let mut outcomes = Vec::new();
        while !jobs.is_empty() {
            // All that run are done before the owner takes the first outcome.
            jobs.start_ready(|job, completion: Completion<i32>| {
                assert!(completion.0.capacity() > 0, "no room for the outcome of job {job}");
                completion.send(job);
            });
            outcomes.extend(runtime.block_on(jobs.next_outcome()));
        }
        assert_eq!(outcomes, [0, 1, 2, 3, 4]);
    }
}
