//! Where vehicles come in that are not known yet: the first accepted `op/configure` makes one.

use crate::keeper::Keeper;
use crate::planner::Planner;
use crate::returning::Returned;
use crate::settings::Settings;
use crate::stop::Stop;
use crate::telemetry::Sparing;
use crate::vehicle::{self, Owner};
use pdn_schemas::ids::VehicleId;
use pdn_schemas::problem::{Code, Problem};
use pdn_state::Vehicle;
use pdn_transport::answer::Answer;
use pdn_transport::directory::{Directory, Knock, unknown_vehicle};
use pdn_transport::inbox::inbox;
use pdn_transport::message::{Incoming, Question};
use pdn_transport::outgoing::{self, Outgoing};
use pdn_transport::session::Session;
use std::sync::Arc;
use std::time::Instant;
use tokio::sync::{mpsc, oneshot};

/// Makes vehicles, and answers for those that are none.
pub struct Lobby {
    session: Session,
    directory: Arc<Directory>,
    planner: Planner,
    stop: Stop,
    settings: Settings,
    ends: Vec<oneshot::Receiver<bool>>,
    log: Sparing,
}

impl Lobby {
    /// A lobby without guests.
    pub fn new(
        session: Session,
        directory: Arc<Directory>,
        planner: Planner,
        stop: Stop,
        settings: Settings,
    ) -> Lobby {
        Lobby { session, directory, planner, stop, settings, ends: Vec::new(), log: Sparing::new() }
    }

    /// Serves until it is closed; then gives what tells that each vehicle's thread has finished.
    pub async fn run(
        mut self,
        mut knocks: mpsc::Receiver<Knock>,
        mut closed: oneshot::Receiver<()>,
    ) -> Vec<oneshot::Receiver<bool>> {
        loop {
            tokio::select! {
                biased;
                _ = &mut closed => break,
                Some(knock) = knocks.recv() => self.open(knock).await,
            }
        }
        knocks.close();
        while let Some(knock) = knocks.recv().await {
            // The directory is closed by now, and answers so.
            self.directory.deliver(knock.vehicle, knock.incoming);
        }
        self.ends
    }

    async fn open(&mut self, Knock { vehicle, incoming, .. }: Knock) {
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
            Incoming::Stray(problem) => self.reject(&vehicle, &problem).await,
        }
    }

    async fn configure(&mut self, id: VehicleId, question: Question) {
        let known = self.directory.len() as u64;
        if known >= self.settings.max_vehicles {
            let message = format!(
                "{known} vehicles have configured missions since the start, which is max_vehicles; raise it and \
                 start pdnd again to serve \"{id}\""
            );
            return question.answer.refuse(&Problem::new(Code::Limit, message, None));
        }
        let mut vehicle = match self.settings.journals() {
            Some(_) => Vehicle::kept(id.as_str(), self.settings.limits()),
            None => Vehicle::new(self.settings.limits()),
        };
        let mut keeper = Keeper::new(id.clone(), &self.settings);
        if let Err(problem) = vehicle::configure(&mut vehicle, &mut keeper, &question) {
            return question.answer.refuse(&problem);
        }
        self.welcome(Returned { id, vehicle, keeper }, Some(question.answer)).await;
    }

    /// Gives a vehicle its thread; `configured` waits for the answer to the configuration that made it.
    pub async fn welcome(&mut self, returned: Returned, configured: Option<Answer>) {
        let id = returned.id.clone();
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
        let (inbox, mail) = inbox(self.settings.incoming());
        let (planner, stop) = (self.planner.clone(), self.stop.clone());
        let owner = Owner::new(returned, mail, outgoing, planner, stop, &self.settings);
        // Before the configuration is answered: the next command may follow the answer at once.
        self.directory.add(id.clone(), inbox);
        match owner.start(configured) {
            Ok(end) => {
                tracing::info!(vehicle = %id, "a vehicle has come");
                self.ends.push(end);
            }
            Err(error) => tracing::error!(vehicle = %id, %error, "a vehicle's thread could not be started"),
        }
    }

    async fn reject(&mut self, vehicle: &VehicleId, problem: &Problem) {
        if let Some(left_out) = self.log.allow(Instant::now()) {
            let lost = self.directory.lost_knocks();
            tracing::warn!(%vehicle, code = problem.code, message = problem.message, left_out, lost, "event refused");
        }
        if let Err(error) = outgoing::reject(&self.session, vehicle, problem).await {
            tracing::warn!(%vehicle, %error, "a refusal could not be published");
        }
    }
}
