//! Zenoh's callbacks: they look at the key and hand over.

use crate::answer::Answer;
use crate::directory::Directory;
use crate::message::{Event, Incoming, Question};
use crate::parameters::Parameters;
use crate::payload::Payload;
use crate::session::SessionError;
use pdn_schemas::ids::VehicleId;
use pdn_schemas::keys::{Key, every_vehicle, every_vehicle_and_topic};
use pdn_schemas::problem::{Code, Problem};
use pdn_schemas::topics::{Role, Topic};
use std::sync::Arc;
use std::time::Instant;
use zenoh::Session;
use zenoh::pubsub::Subscriber;
use zenoh::query::{Query, Queryable};
use zenoh::sample::Sample;

pub use zenoh::liveliness::LivelinessToken;

/// The declarations through which everything comes in. Dropping it undeclares them.
pub struct Intake {
    events: Subscriber<()>,
    questions: Queryable<()>,
    commands: Queryable<()>,
}

impl Intake {
    /// Declares, once for all vehicles: `pdn/*/v1/in/*`, `pdn/*/v1/rpc/*`, `pdn/*/v1/op/*`.
    pub async fn open(session: &Session, directory: Arc<Directory>) -> Result<Intake, SessionError> {
        let keys = [Role::Event, Role::Question, Role::Command].map(every_vehicle_and_topic);
        let refused = |key: &str, cause: zenoh::Error| SessionError::Declare {
            key: key.to_owned(),
            cause: cause.to_string(),
        };
        let to = directory.clone();
        let events =
            session.declare_subscriber(keys[0].clone()).callback(move |sample| on_event(&to, &sample));
        let events = events.await.map_err(|cause| refused(&keys[0], cause))?;
        let to = directory.clone();
        let questions = session
            .declare_queryable(keys[1].clone())
            .callback(move |query| on_query(&to, query, Role::Question));
        let questions = questions.await.map_err(|cause| refused(&keys[1], cause))?;
        let to = directory;
        let commands = session
            .declare_queryable(keys[2].clone())
            .callback(move |query| on_query(&to, query, Role::Command));
        let commands = commands.await.map_err(|cause| refused(&keys[2], cause))?;
        Ok(Intake { events, questions, commands })
    }

    /// Undeclares: nothing more comes in.
    pub async fn close(self) {
        let undeclared = (
            self.events.undeclare().await,
            self.questions.undeclare().await,
            self.commands.undeclare().await,
        );
        if let (Err(error), ..) | (_, Err(error), _) | (.., Err(error)) = undeclared {
            tracing::warn!(%error, "a declaration could not be taken back");
        }
    }
}

/// Declares that the service is ready, for every vehicle at once: `pdn/*/v1/alive/planner`. A client that
/// looks for `pdn/<its id>/v1/alive/planner` finds it before and after it configures a mission.
pub async fn declare_ready(session: &Session) -> Result<LivelinessToken, SessionError> {
    let key = every_vehicle(Topic::AlivePlanner);
    let token = session.liveliness().declare_token(key.clone()).await;
    token.map_err(|cause| SessionError::Declare { key, cause: cause.to_string() })
}

fn on_event(directory: &Directory, sample: &Sample) {
    let key = sample.key_expr().as_str();
    match Key::parse(key) {
        Ok(Key { vehicle, topic, .. }) if topic.role() == Role::Event => {
            let payload = Payload::new(sample.payload(), sample.encoding());
            directory.deliver(vehicle, Event { topic, payload }.into());
        }
        _ => match vehicle_of(key) {
            Some(vehicle) => directory.deliver(vehicle, Incoming::Unroutable(no_such_key(key, Role::Event))),
            None => tracing::warn!(%key, "an event under a key without a vehicle's id was refused"),
        },
    }
}

fn on_query(directory: &Directory, query: Query, role: Role) {
    let arrived = Instant::now();
    let parameters = Parameters::new(query.parameters().as_str());
    let answer = |query| Answer::new(query, &parameters);
    match Key::parse(query.key_expr().as_str()) {
        Ok(Key { vehicle, topic, .. }) if topic.role() == role => {
            let payload = match (query.payload(), query.encoding()) {
                (Some(bytes), Some(encoding)) => Payload::new(bytes, encoding),
                _ => Payload::default(),
            };
            let answer = answer(query);
            directory.deliver(vehicle, Question { topic, parameters, payload, arrived, answer }.into());
        }
        _ => {
            let problem = no_such_key(query.key_expr().as_str(), role);
            answer(query).refuse(&problem);
        }
    }
}

fn vehicle_of(key: &str) -> Option<VehicleId> {
    VehicleId::new(key.split('/').nth(1)?).ok()
}

fn no_such_key(key: &str, role: Role) -> Problem {
    let listed: Vec<_> =
        Topic::ALL.iter().filter(|topic| topic.role() == role).map(|topic| topic.suffix()).collect();
    let message = format!(
        "{:?} is no key of this service; under pdn/<vehicle>/v1/, with the vehicle's id of a-z, 0-9, \
         _ and -, it takes {}",
        key.chars().take(200).collect::<String>(),
        listed.join(", ")
    );
    Problem::new(Code::Invalid, message, None)
}
