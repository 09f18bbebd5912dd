//! The thread that owns a vehicle: events, commands and questions come to it one after the other, and only it
//! changes the vehicle's missions.
//!
//! It is a thread and no task, because solving the graph computes for milliseconds to seconds: it shares a
//! core with others by the system's scheduler, and no vehicle waits for another's. What takes long and
//! changes nothing is computed on the pool (`planner`), and the network has threads of its own
//! (`pdn_transport::outgoing`).
//!
//! Reading order: here the loop; `events` (what vehicles publish), `commands`, `questions` (from the question to the job), `jobs` (how many run at once), `replies`
//! (from the outcome to the reply), `deferred` (questions that wait for an event), `acknowledge` (when
//! `out/ack` is due).

mod events;

mod commands;
mod jobs;
mod questions;
mod replies;

mod acknowledge;
mod deferred;

pub use commands::configure;

use crate::journal_writer::{JournalWriter, JournaledVehicle};
use crate::planner::{Computed, Job, Planner};
use crate::settings::Settings;
use crate::shutdown::ShutdownDeadline;
use crate::telemetry::LogRateLimiter;
use acknowledge::Acknowledgements;
use deferred::DeferredQuestions;
use jobs::Jobs;
use pdn_schemas::ids::VehicleId;
use pdn_schemas::limits::STATE_EVERY_MS;
use pdn_schemas::problem::{Code, Problem};
use pdn_schemas::topics::Topic;
use pdn_state::Vehicle;
use pdn_transport::answer::Answer;
use pdn_transport::inbox::InboxReceiver;
use pdn_transport::message::Incoming;
use pdn_transport::outgoing::Outgoing;
use questions::PendingReply;
use std::time::{Duration, Instant};
use tokio::sync::oneshot;

/// A vehicle with all that its thread needs.
pub struct Owner {
    id: VehicleId,
    vehicle: Vehicle,
    journal_writer: JournalWriter,
    inbox: InboxReceiver,
    outgoing: Outgoing,
    planner: Planner,
    shutdown: ShutdownDeadline,
    wait: Duration,

    deferred: DeferredQuestions,
    jobs: Jobs<(PendingReply, Job), (PendingReply, Computed)>,

    acknowledgements: Acknowledgements,
    state_changed: bool,
    state_due: Instant,
    log: LogRateLimiter,
    shed_events: u64,
}

impl Owner {
    /// The owner of a vehicle that has just been configured, or has come back.
    pub fn new(
        JournaledVehicle { id, vehicle, journal_writer }: JournaledVehicle,
        inbox: InboxReceiver,
        outgoing: Outgoing,
        planner: Planner,
        shutdown: ShutdownDeadline,
        settings: &Settings,
    ) -> Owner {
        let jobs = Jobs::new(planner.jobs_at_once());
        Owner {
            id,
            vehicle,
            journal_writer,
            inbox,
            outgoing,
            planner,
            shutdown,
            wait: Duration::from_millis(settings.wait_ms),
            deferred: DeferredQuestions::default(),
            jobs,
            acknowledgements: Acknowledgements::default(),
            state_changed: true,
            state_due: Instant::now(),
            log: LogRateLimiter::new(),
            shed_events: 0,
        }
    }

    /// Starts the thread, which first answers the configuration that made the vehicle, if one did. The
    /// receiver hears when all is sent, and whether all that was accepted could be finished.
    pub fn start(self, configured: Option<Answer>) -> std::io::Result<oneshot::Receiver<bool>> {
        let (end, drained) = oneshot::channel();
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build()?;
        std::thread::Builder::new().name(format!("own {}", self.id)).spawn(move || {
            let (drained, outgoing) = runtime.block_on(self.run(configured));
            outgoing.finish();
            let _ = end.send(drained);
        })?;
        Ok(drained)
    }

    /// Whether all that was accepted could be finished, and what is still to be sent.
    async fn run(mut self, configured: Option<Answer>) -> (bool, Outgoing) {
        if let Some(answer) = configured {
            self.answer_with_state(answer, None);
        }
        let mut open = true;
        loop {
            self.tick(Instant::now());
            if !open && self.is_idle() {
                break;
            }
            let wake = self.next_wake();
            tokio::select! {
                biased;
                Some((pending, computed)) = self.jobs.next_outcome() => self.conclude(pending, computed),
                incoming = self.inbox.recv(), if open => match incoming {
                    Some(incoming) if self.shutdown.has_passed(Instant::now()) => self.shed(incoming),
                    Some(incoming) => self.take(incoming),
                    None => {
                        open = false;
                        self.refuse_deferred();
                    }
                },
                () = tokio::time::sleep_until(wake.into()) => {}
            }
        }
        self.sync();
        self.publish_acknowledgements(self.acknowledgements.all());
        self.publish_state();
        self.journal_writer.close(&mut self.vehicle);
        if self.shed_events > 0 {
            let events = self.shed_events;
            tracing::warn!(vehicle = %self.id, events, "no time: events were left to be sent again");
        }
        (self.shed_events == 0, self.outgoing)
    }

    fn take(&mut self, incoming: Incoming) {
        match incoming {
            Incoming::Event(event) => self.take_event(&event),
            Incoming::Unroutable(problem) => self.reject(problem),
            Incoming::Question(question) if question.topic.suffix().starts_with("op/") => {
                self.take_command(*question)
            }
            Incoming::Question(question) => self.take_question(*question),
        }
    }

    /// What there is no time for: an event is not acknowledged and so will be sent again, a question is told.
    fn shed(&mut self, incoming: Incoming) {
        match incoming {
            Incoming::Event(_) | Incoming::Unroutable(_) => self.shed_events += 1,
            Incoming::Question(question) => {
                let message = "the service is shutting down; ask again once it is back";
                self.refuse(question.topic, question.answer, Problem::new(Code::NotReady, message, None));
            }
        }
    }

    /// Does what is due by the clock or by what has just come.
    fn tick(&mut self, now: Instant) {
        self.log_losses(now);
        self.release_deferred(now);
        self.jobs.start_ready(|(pending, job), completion| {
            let deadline = pending.deadline;
            self.planner.start(job, deadline, move |computed| completion.send((pending, computed)));
        });
        if self.journal_writer.is_due(now) {
            self.sync();
        }
        let due = self.acknowledgements.due(Instant::now());
        self.publish_acknowledgements(due);
        if self.state_changed || now >= self.state_due {
            self.publish_state();
            // Counted from its end, so that a state that takes long to compute leaves time for events.
            self.state_due = Instant::now() + Duration::from_millis(STATE_EVERY_MS);
        }
    }

    /// Tells what found no room in the inbox or was not published.
    fn log_losses(&mut self, now: Instant) {
        let id = &self.id;
        let refused = self.inbox.refused();
        if refused > 0
            && let Some(left_out) = self.log.allow(now)
        {
            tracing::warn!(
                vehicle = %id, refused, left_out, "no room: questions were told, events will be sent again"
            );
        }
        let left_out = self.outgoing.left_out();
        if left_out > 0 {
            tracing::warn!(
                vehicle = %id, left_out, "publications were left out: a client does not read them"
            );
        }
    }

    fn next_wake(&self) -> Instant {
        [self.acknowledgements.next_due(), self.deferred.next_expiry(), self.journal_writer.next_due()]
            .into_iter()
            .flatten()
            .fold(self.state_due, Instant::min)
    }

    /// Makes durable what has happened, and has it told.
    fn sync(&mut self) {
        let now = Instant::now();
        for mission in self.journal_writer.sync(&mut self.vehicle) {
            self.acknowledgements.make_due(&mission, now);
        }
    }

    fn is_idle(&self) -> bool {
        self.deferred.is_empty() && self.jobs.is_empty()
    }

    fn publish_state(&mut self) {
        self.state_changed = false;
        if let Ok(mission) = self.vehicle.mission(None) {
            self.outgoing.publish(Topic::OutState, mission.state());
        }
    }

    fn publish_acknowledgements(&mut self, missions: Vec<String>) {
        for id in missions {
            if let Ok(mission) = self.vehicle.mission(Some(&id)) {
                self.outgoing.publish(Topic::OutAck, mission.ack());
            }
        }
    }
}
