//! The daemon from start to end: build (recover, open the session, take what comes, declare it ready), run
//! until a signal, drain (take nothing more, finish what was accepted, leave).

mod signals;

use crate::admission::Admission;
use crate::journal_writer::JournaledVehicle;
use crate::planner::Planner;
use crate::recovery::recover_all;
use crate::settings::Settings;
use crate::shutdown::ShutdownDeadline;
use pdn_transport::directory::{AdmissionBounds, Directory};
use pdn_transport::intake::{Intake, LivelinessToken, declare_ready};
use pdn_transport::session::{self, Config, Session, SessionError};
use signals::Signals;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::oneshot;
use tokio::task::JoinHandle;

/// Configurations, and heads of events, of unknown vehicles that wait for admission.
const ADMISSION: AdmissionBounds = AdmissionBounds { messages: 256, bytes: 16 * 1024 * 1024 };

/// Time for leaving the network once all is finished, at most; a quarter of `drain_ms` if that is less.
const LEAVE: Duration = Duration::from_secs(1);

/// Serves until SIGTERM or SIGINT; true if all that was accepted could be finished.
///
/// Vehicles of earlier runs come back before anything is taken; a signal meanwhile ends the daemon at once.
pub async fn serve(settings: &Settings, zenoh: Config) -> Result<bool, SessionError> {
    let mut signals = Signals::new().map_err(|error| internal("signals", &error))?;
    let vehicles = tokio::select! {
        vehicles = recover(settings.clone()) => vehicles?,
        cause = signals.next() => {
            tracing::info!(cause, "stopped while journals were read");
            return Ok(true);
        }
    };
    let daemon = Daemon::build(settings, zenoh, vehicles).await?;
    daemon.run(&mut signals).await;
    Ok(daemon.drain(&mut signals).await)
}

async fn recover(settings: Settings) -> Result<Vec<JournaledVehicle>, SessionError> {
    let recovered = tokio::task::spawn_blocking(move || recover_all(&settings)).await;
    let recovered = recovered.map_err(|error| internal("state_dir", &error))?;
    recovered.map_err(|error| internal("state_dir", &error))
}

/// The daemon while it serves.
struct Daemon {
    drain_time: Duration,
    session: Session,
    directory: Arc<Directory>,
    shutdown: ShutdownDeadline,
    intake: Intake,
    ready: LivelinessToken,
    /// Ends once it is closed; gives what tells of each vehicle's thread whether it could finish.
    admission: JoinHandle<Vec<oneshot::Receiver<bool>>>,
    close_admission: oneshot::Sender<()>,
}

impl Daemon {
    /// Opens the session, gives each recovered vehicle its thread, takes what comes, and declares all ready.
    async fn build(
        settings: &Settings,
        zenoh: Config,
        vehicles: Vec<JournaledVehicle>,
    ) -> Result<Daemon, SessionError> {
        let shutdown = ShutdownDeadline::default();
        let planner = Planner::new(settings.planner_threads(), shutdown.clone());
        let planner = planner.map_err(|error| internal("planner", &error))?;
        let session = session::open(zenoh, Duration::from_millis(settings.open_timeout_ms)).await?;
        let (directory, unknown_vehicles) = Directory::new(ADMISSION);
        let directory = Arc::new(directory);
        let mut admission = Admission::new(
            session.clone(),
            directory.clone(),
            planner.clone(),
            shutdown.clone(),
            settings.clone(),
        );
        for vehicle in vehicles {
            admission.spawn(vehicle, None).await;
        }
        let intake = Intake::open(&session, directory.clone()).await?;
        let (close_admission, closed) = oneshot::channel();
        let admission = tokio::spawn(admission.run(unknown_vehicles, closed));
        let ready = declare_ready(&session).await?;
        let locators: Vec<_> = session.info().locators().await.iter().map(ToString::to_string).collect();
        tracing::info!(
            version = env!("CARGO_PKG_VERSION"),
            listening = locators.join(", "),
            planner_threads = planner.jobs_at_once(),
            state_dir = %settings.state_dir.display(),
            vehicles = directory.len(),
            "ready"
        );
        let drain_time = Duration::from_millis(settings.drain_ms);
        Ok(Daemon { drain_time, session, directory, shutdown, intake, ready, admission, close_admission })
    }

    /// Waits for a signal; whatever is served is served by callbacks, tasks and threads.
    async fn run(&self, signals: &mut Signals) {
        let cause = signals.next().await;
        let drain_ms = self.drain_time.as_millis() as u64;
        tracing::info!(cause, drain_ms, vehicles = self.directory.len(), "stopping");
    }

    /// Takes nothing more, finishes what was accepted and leaves; true if all could be finished. It takes
    /// `drain_ms` at most, whatever was accepted: three quarters of the time go to finishing, the rest to
    /// telling and leaving. Another signal ends it at once.
    async fn drain(self, signals: &mut Signals) -> bool {
        let leave = LEAVE.min(self.drain_time / 4);
        let finish = self.drain_time - leave;
        self.shutdown.set(Instant::now() + finish * 3 / 4);
        if let Err(error) = self.ready.undeclare().await {
            tracing::warn!(%error, "the readiness token could not be taken back");
        }
        self.directory.close();
        let _ = self.close_admission.send(());
        let drained = tokio::select! {
            done = tokio::time::timeout(finish, finished(self.admission)) => done.unwrap_or(false),
            cause = signals.next() => {
                tracing::warn!(cause, "stopping at once");
                false
            }
        };
        let left = async {
            self.intake.close().await;
            session::close(&self.session, leave).await
        };
        if !tokio::time::timeout(leave, left).await.unwrap_or(false) {
            tracing::warn!("the session could not be closed in time");
        }
        tracing::info!(drained, "stopped");
        drained
    }
}

/// Waits for every vehicle's thread; true if all could finish what they had accepted.
async fn finished(admission: JoinHandle<Vec<oneshot::Receiver<bool>>>) -> bool {
    let mut all = true;
    for drained in admission.await.unwrap_or_default() {
        // A thread that has failed has nothing more to finish.
        all &= drained.await.unwrap_or(true);
    }
    all
}

fn internal(what: &str, cause: &dyn std::error::Error) -> SessionError {
    SessionError::Declare { key: what.to_owned(), cause: cause.to_string() }
}
