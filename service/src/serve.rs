//! The daemon from start to end: open the session, take what comes, say that it is ready; on a signal take nothing
//! more, finish what was accepted, leave.

use crate::admission::Admission;
use crate::planner::Planner;
use crate::recovery::recover_all;
use crate::settings::Settings;
use crate::shutdown::ShutdownDeadline;
use pdn_transport::directory::{AdmissionBounds, Directory};
use pdn_transport::intake::{Intake, declare_ready};
use pdn_transport::session::{self, Config, SessionError};
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::sync::oneshot;

/// Configurations, and heads of events, of unknown vehicles that wait for admission.
const ADMISSION: AdmissionBounds = AdmissionBounds { messages: 256, bytes: 16 * 1024 * 1024 };

/// Time for leaving the network once all is finished, at most; a quarter of `drain_ms` if that is less.
const LEAVE: Duration = Duration::from_secs(1);

/// Serves until SIGTERM or SIGINT; true if all that was accepted could be finished. The end takes `drain_ms` at most,
/// whatever was accepted: three quarters of the time go to finishing, the rest to telling and leaving.
///
/// Vehicles of earlier runs come back before anything is taken.
pub async fn serve(settings: &Settings, zenoh: Config) -> Result<bool, SessionError> {
    let mut signals = Signals::new()?;
    let recovering = {
        let settings = settings.clone();
        tokio::task::spawn_blocking(move || recover_all(&settings))
    };
    let recovered = tokio::select! {
        recovered = recovering => recovered.map_err(|error| internal("state_dir", &error))?,
        cause = signals.next() => {
            tracing::info!(cause, "stopped while journals were read");
            return Ok(true);
        }
    };
    let recovered = recovered.map_err(|error| internal("state_dir", &error))?;
    let shutdown = ShutdownDeadline::default();
    let planner = Planner::new(settings.planner_threads(), shutdown.clone());
    let planner = planner.map_err(|error| internal("planner", &error))?;
    let session = session::open(zenoh, Duration::from_millis(settings.open_timeout_ms)).await?;
    let (directory, unknown_vehicles) = Directory::new(ADMISSION);
    let directory = Arc::new(directory);
    let (close_admission, closed) = oneshot::channel();
    let mut admission = Admission::new(
        session.clone(),
        directory.clone(),
        planner.clone(),
        shutdown.clone(),
        settings.clone(),
    );
    for recovered in recovered {
        admission.spawn(recovered, None).await;
    }
    let intake = Intake::open(&session, directory.clone()).await?;
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

    let cause = signals.next().await;
    let drain = Duration::from_millis(settings.drain_ms);
    tracing::info!(cause, drain_ms = settings.drain_ms, vehicles = directory.len(), "stopping");
    let leave = LEAVE.min(drain / 4);
    shutdown.set(Instant::now() + (drain - leave) * 3 / 4);
    if let Err(error) = ready.undeclare().await {
        tracing::warn!(%error, "the readiness token could not be taken back");
    }
    directory.close();
    let _ = close_admission.send(());
    let finished = async {
        let mut all = true;
        for drained in admission.await.unwrap_or_default() {
            // A thread that has failed has nothing more to finish.
            all &= drained.await.unwrap_or(true);
        }
        all
    };
    let drained = tokio::select! {
        done = tokio::time::timeout(drain - leave, finished) => done.unwrap_or(false),
        cause = signals.next() => {
            tracing::warn!(cause, "stopping at once");
            false
        }
    };
    let left = async {
        intake.close().await;
        session::close(&session, leave).await
    };
    if !tokio::time::timeout(leave, left).await.unwrap_or(false) {
        tracing::warn!("the session could not be closed in time");
    }
    tracing::info!(drained, "stopped");
    Ok(drained)
}

struct Signals {
    terminate: Signal,
    interrupt: Signal,
}

impl Signals {
    fn new() -> Result<Signals, SessionError> {
        let listen = |kind| signal(kind).map_err(|error| internal("signals", &error));
        Ok(Signals {
            terminate: listen(SignalKind::terminate())?,
            interrupt: listen(SignalKind::interrupt())?,
        })
    }

    async fn next(&mut self) -> &'static str {
        tokio::select! {
            _ = self.terminate.recv() => "SIGTERM",
            _ = self.interrupt.recv() => "SIGINT",
        }
    }
}

fn internal(what: &str, cause: &dyn std::error::Error) -> SessionError {
    SessionError::Declare { key: what.to_owned(), cause: cause.to_string() }
}
