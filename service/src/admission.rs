//! Admits vehicles that are not known yet: the first accepted `op/configure` makes one.

use crate::journal_writer::{JournalWriter, JournaledVehicle};
use crate::planner::Planner;
use crate::settings::Settings;
use crate::shutdown::ShutdownDeadline;
use crate::telemetry::LogRateLimiter;
use crate::vehicle::{self, Owner};
use pdn_schemas::ids::VehicleId;
use pdn_schemas::problem::{Code, Problem};
use pdn_state::Vehicle;
use pdn_transport::answer::Answer;
use pdn_transport::directory::{Directory, UnknownVehicle, unknown_vehicle};
use pdn_transport::inbox;
use pdn_transport::message::{Incoming, Question};
use pdn_transport::outgoing::{self, Outgoing};
use pdn_transport::session::Session;
use std::sync::Arc;
use std::time::Instant;
use tokio::sync::{mpsc, oneshot};

/// Makes vehicles, and answers for those that are none.
pub struct Admission {
    session: Session,
    directory: Arc<Directory>,
    planner: Planner,
    shutdown: ShutdownDeadline,
    settings: Settings,
    drained: Vec<oneshot::Receiver<bool>>,
    log: LogRateLimiter,
}

impl Admission {
    /// No vehicle is admitted yet.
    pub fn new(
        session: Session,
        directory: Arc<Directory>,
        planner: Planner,
        shutdown: ShutdownDeadline,
        settings: Settings,
    ) -> Admission {
        let log = LogRateLimiter::new();
        Admission { session, directory, planner, shutdown, settings, drained: Vec::new(), log }
    }

    /// Admits until it is closed; then gives a receiver for each vehicle's thread, which hears whether all
    /// that the vehicle had accepted could be finished.
    pub async fn run(
        mut self,
        mut messages: mpsc::Receiver<UnknownVehicle>,
        mut closed: oneshot::Receiver<()>,
    ) -> Vec<oneshot::Receiver<bool>> {
        loop {
            tokio::select! {
                biased;
                _ = &mut closed => break,
                Some(message) = messages.recv() => self.admit(message).await,
            }
        }
        messages.close();
        while let Some(message) = messages.recv().await {
            // The directory is closed by now, and answers so.
            self.directory.deliver(message.vehicle, message.incoming);
        }
        self.drained
    }

    async fn admit(&mut self, UnknownVehicle { vehicle, incoming, .. }: UnknownVehicle) {
        if self.directory.find(&vehicle).is_some() {
            return self.directory.deliver(vehicle, incoming);
        }
        match incoming {
            Incoming::Question(question) => self.configure(vehicle, *question).await,
            Incoming::Event(event) => {
                let seq = event.payload.head().map(|head| head.seq);
                let problem = Problem { seq, ..unknown_vehicle(&vehicle) };
                self.reject(&vehicle, &problem).await;
            }
            Incoming::Unroutable(problem) => self.reject(&vehicle, &problem).await,
        }
    }

    async fn configure(&mut self, id: VehicleId, question: Question) {
        let known = self.directory.len() as u64;
        if known >= self.settings.max_vehicles {
            let message = format!(
                "{known} vehicles have configured missions since the start, which is max_vehicles; raise it \
                 and start pdnd again to serve \"{id}\""
            );
            return question.answer.refuse(&Problem::new(Code::Limit, message, None));
        }
        let mut vehicle = match self.settings.journals() {
            Some(_) => Vehicle::kept(id.as_str(), self.settings.limits()),
            None => Vehicle::new(self.settings.limits()),
        };
        let mut journal_writer = JournalWriter::new(id.clone(), &self.settings);
        if let Err(problem) = vehicle::configure(&mut vehicle, &mut journal_writer, &question) {
            return question.answer.refuse(&problem);
        }
        self.spawn(JournaledVehicle { id, vehicle, journal_writer }, Some(question.answer)).await;
    }

    /// Gives a vehicle its thread; `configured` waits for the answer to the configuration that made it.
    pub async fn spawn(&mut self, vehicle: JournaledVehicle, configured: Option<Answer>) {
        let id = vehicle.id.clone();
        let outgoing = match Outgoing::open(&self.session, &id, self.settings.outgoing()).await {
            Ok(opened) => opened,
            Err(error) => {
                tracing::error!(vehicle = %id, %error, "a vehicle could not be made");
                if let Some(answer) = configured {
                    answer.refuse(&Problem::new(Code::Internal, error.to_string(), None));
                }
                return;
            }
        };
        let (inbox, receiver) = inbox::channel(self.settings.incoming());
        let (planner, shutdown) = (self.planner.clone(), self.shutdown.clone());
        let owner = Owner::new(vehicle, receiver, outgoing, planner, shutdown, &self.settings);
        // Before the configuration is answered: the next command may follow the answer at once.
        self.directory.add(id.clone(), inbox);
        match owner.start(configured) {
            Ok(drained) => {
                tracing::info!(vehicle = %id, "a vehicle has come");
                self.drained.push(drained);
            }
            Err(error) => tracing::error!(vehicle = %id, %error, "a vehicle's thread could not be started"),
        }
    }

    async fn reject(&mut self, vehicle: &VehicleId, problem: &Problem) {
        if let Some(left_out) = self.log.allow(Instant::now()) {
            let lost = self.directory.dropped_unknown();
            let Problem { code, message, .. } = problem;
            tracing::warn!(%vehicle, code, message, left_out, lost, "event refused");
        }
        if let Err(error) = outgoing::reject(&self.session, vehicle, problem).await {
            tracing::warn!(%vehicle, %error, "a refusal could not be published");
        }
    }
}
