//! The thread that owns a vehicle: events, commands and questions come to it one after the other, and only it
//! changes the vehicle's missions.
//!
//! It is a thread and no task, because solving the graph computes for milliseconds to seconds: it shares a core
//! with others by the system's scheduler, and no vehicle waits for another's. What takes long and changes
//! nothing is computed on the pool (`planner`), and the network has a thread of its own (`pdn_transport::outgoing`).
//!
//! Reading order: here the loop; `events` (what vehicles publish), `commands`, `questions` (from the question to
//! the job), `replies` (from the outcome to the reply), `waiting` (for an event), `acknowledge` (when `out/ack`
//! is due).

mod events;

mod commands;
mod questions;
mod replies;

mod acknowledge;
mod waiting;

pub use commands::configure;

use crate::keeper::Keeper;
use crate::planner::{Computed, Job, Planner};
use crate::returning::Returned;
use crate::settings::Settings;
use crate::stop::Stop;
use crate::telemetry::Sparing;
use acknowledge::Acknowledgements;
use pdn_schemas::ids::VehicleId;
use pdn_schemas::limits::STATE_EVERY_MS;
use pdn_schemas::problem::{Code, Problem};
use pdn_schemas::topics::Topic;
use pdn_state::Vehicle;
use pdn_transport::answer::Answer;
use pdn_transport::inbox::Mail;
use pdn_transport::message::Incoming;
use pdn_transport::outgoing::Outgoing;
use questions::Asked;
use std::collections::VecDeque;
use std::time::{Duration, Instant, SystemTime};
use tokio::sync::{mpsc, oneshot};
use waiting::Waiting;

/// A vehicle with all that its thread needs.
pub struct Owner {
    id: VehicleId,
    vehicle: Vehicle,
    keeper: Keeper,
    mail: Mail,
    outgoing: Outgoing,
    planner: Planner,
    stop: Stop,
    wait: Duration,

    waiting: Waiting,
    ready: VecDeque<(Asked, Job)>,
    running: usize,
    finish: mpsc::UnboundedSender<(Asked, Computed)>,
    finished: mpsc::UnboundedReceiver<(Asked, Computed)>,

    acknowledgements: Acknowledgements,
    state_changed: bool,
    state_due: Instant,
    log: Sparing,
    turned_away: u64,
}

impl Owner {
    /// The owner of a vehicle that has just been configured, or has come back.
    pub fn new(
        Returned { id, vehicle, keeper }: Returned,
        mail: Mail,
        outgoing: Outgoing,
        planner: Planner,
        stop: Stop,
        settings: &Settings,
    ) -> Owner {
        let (finish, finished) = mpsc::unbounded_channel();
        Owner {
            id,
            vehicle,
            keeper,
            mail,
            outgoing,
            planner,
            stop,
            wait: Duration::from_millis(settings.wait_ms),
            waiting: Waiting::default(),
            ready: VecDeque::new(),
            running: 0,
            finish,
            finished,
            acknowledgements: Acknowledgements::default(),
            state_changed: true,
            state_due: Instant::now(),
            log: Sparing::new(),
            turned_away: 0,
        }
    }

    /// Starts the thread, which first answers the configuration that made the vehicle, if one did. The receiver hears when all
    /// is sent, and whether all that was accepted could be finished.
    pub fn start(self, configured: Option<Answer>) -> std::io::Result<oneshot::Receiver<bool>> {
        let (end, ended) = oneshot::channel();
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build()?;
        std::thread::Builder::new().name(format!("own {}", self.id)).spawn(move || {
            let (finished, outgoing) = runtime.block_on(self.run(configured));
            outgoing.finish();
            let _ = end.send(finished);
        })?;
        Ok(ended)
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
                Some((asked, computed)) = self.finished.recv() => self.conclude(asked, computed),
                incoming = self.mail.next(), if open => match incoming {
                    Some(incoming) if self.stop.has_come(Instant::now()) => self.turn_away(incoming),
                    Some(incoming) => self.take(incoming),
                    None => {
                        open = false;
                        self.refuse_waiting();
                    }
                },
                () = tokio::time::sleep_until(wake.into()) => {}
            }
        }
        self.sync();
        self.publish_acknowledgements(self.acknowledgements.all());
        self.publish_state();
        self.keeper.close(&mut self.vehicle);
        if self.turned_away > 0 {
            tracing::warn!(vehicle = %self.id, events = self.turned_away, "no time: events were left to be sent again");
        }
        (self.turned_away == 0, self.outgoing)
    }

    fn take(&mut self, incoming: Incoming) {
        match incoming {
            Incoming::Event(event) => self.take_event(&event),
            Incoming::Stray(problem) => self.reject(problem),
            Incoming::Question(question) if question.topic.suffix().starts_with("op/") => {
                self.command(*question)
            }
            Incoming::Question(question) => self.ask(*question),
        }
    }

    /// What there is no time for: an event is not acknowledged and so will be sent again, a question is told.
    fn turn_away(&mut self, incoming: Incoming) {
        match incoming {
            Incoming::Event(_) | Incoming::Stray(_) => self.turned_away += 1,
            Incoming::Question(question) => {
                let message = "the service is shutting down; ask again once it is back";
                self.refuse(question.topic, question.answer, Problem::new(Code::NotReady, message, None));
            }
        }
    }

    /// Does what is due by the clock or by what has just come.
    fn tick(&mut self, now: Instant) {
        let refused = self.mail.refused();
        let told = if refused > 0 { self.log.allow(now) } else { None };
        if let Some(left_out) = told {
            tracing::warn!(vehicle = %self.id, refused, left_out, "no room: questions were told, events will be sent again");
        }
        let left_out = self.outgoing.left_out();
        if left_out > 0 {
            tracing::warn!(vehicle = %self.id, left_out, "publications were left out: a client does not read them");
        }
        self.release_waiting(now);
        while self.running < self.planner.jobs_at_once() {
            let Some((asked, job)) = self.ready.pop_front() else { break };
            self.running += 1;
            let finish = self.finish.clone();
            self.planner.start(job, asked.deadline, move |computed| {
                // The owner outlives its jobs unless it has failed; then nobody is left to be told.
                let _ = finish.send((asked, computed));
            });
        }
        if self.keeper.is_due(now) {
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

    fn next_wake(&self) -> Instant {
        [self.acknowledgements.next_due(), self.waiting.next_expiry(), self.keeper.next_due()]
            .into_iter()
            .flatten()
            .fold(self.state_due, Instant::min)
    }

    /// Makes durable what has happened, and has it told.
    fn sync(&mut self) {
        let now = Instant::now();
        for mission in self.keeper.sync(&mut self.vehicle) {
            self.acknowledgements.hasten(&mission, now);
        }
    }

    fn is_idle(&self) -> bool {
        self.waiting.is_empty() && self.ready.is_empty() && self.running == 0
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

/// The daemon's clock, ns since the Unix epoch; for people who read when a phase began, never for a decision.
pub fn now_ns() -> u64 {
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
    u64::try_from(since.as_nanos()).unwrap_or(u64::MAX)
}
