//! What goes out of one vehicle, sent by a thread of its own: a client that does not read holds up this thread
//! only, never the mission and never another vehicle.

use crate::answer::Answer;
use crate::session::SessionError;
use pdn_schemas::codec::{self, CodecError, Format, Message};
use pdn_schemas::ids::VehicleId;
use pdn_schemas::keys::key;
use pdn_schemas::problem::Problem;
use pdn_schemas::topics::{Role, Topic};
use std::collections::BTreeMap;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use zenoh::bytes::Encoding;
use zenoh::pubsub::Publisher;
use zenoh::qos::CongestionControl;
use zenoh::{Session, Wait};

/// The queue towards the sending thread. The thread ends once every clone is gone.
#[derive(Clone, Debug)]
pub struct Outgoing {
    queue: SyncSender<Parcel>,
}

/// Messages are written by the sending thread too: a graph of 100,000 keyframes takes a while.
enum Parcel {
    Publication(Topic, Box<dyn FnOnce() -> Result<Vec<u8>, CodecError> + Send>),
    Answer(Box<dyn FnOnce() + Send>),
}

impl Outgoing {
    /// Declares the vehicle's publishers and starts the thread.
    pub async fn open(
        session: &Session,
        vehicle: &VehicleId,
        capacity: usize,
    ) -> Result<(Outgoing, JoinHandle<()>), SessionError> {
        let mut publishers = BTreeMap::new();
        for &topic in Topic::ALL.iter().filter(|topic| topic.role() == Role::Publication) {
            let key = key(vehicle, topic);
            let congestion =
                if is_superseded(topic) { CongestionControl::Drop } else { CongestionControl::Block };
            let publisher = session
                .declare_publisher(key.clone())
                .encoding(Encoding::APPLICATION_JSON)
                .congestion_control(congestion)
                .await
                .map_err(|cause| SessionError::Declare { key, cause: cause.to_string() })?;
            publishers.insert(topic, publisher);
        }
        let (queue, parcels) = sync_channel(capacity.max(1));
        let thread = std::thread::Builder::new()
            .name(format!("send {vehicle}"))
            .spawn(move || send_all(&parcels, &publishers))
            .map_err(|cause| SessionError::Declare { key: vehicle.to_string(), cause: cause.to_string() })?;
        Ok((Outgoing { queue }, thread))
    }

    /// Publishes. What the next publication of its topic supersedes is left out while the queue is full; anything
    /// else waits for room, at most until Zenoh closes the link that is not read (`wait_before_close`).
    pub fn publish<T: Message + Send + 'static>(&self, topic: Topic, message: T) {
        let write = Box::new(move || codec::encode(&message, Format::Json));
        self.put(Parcel::Publication(topic, write), !is_superseded(topic));
    }

    /// Sends an answer.
    pub fn answer<T: Message + Send + 'static>(&self, answer: Answer, reply: Result<T, Problem>) {
        self.put(Parcel::Answer(Box::new(move || answer.send(&reply))), true);
    }

    /// Sends a refusal.
    pub fn refuse(&self, answer: Answer, problem: Problem) {
        self.put(Parcel::Answer(Box::new(move || answer.refuse(&problem))), true);
    }

    fn put(&self, parcel: Parcel, wait_for_room: bool) {
        match self.queue.try_send(parcel) {
            Ok(()) => {}
            Err(TrySendError::Full(parcel)) if wait_for_room => {
                tracing::warn!(
                    "outgoing_messages wait for the network; a client does not read what it asked for"
                );
                if self.queue.send(parcel).is_err() {
                    tracing::error!("the sending thread has ended");
                }
            }
            Err(TrySendError::Full(_)) => {}
            Err(TrySendError::Disconnected(_)) => tracing::error!("the sending thread has ended"),
        }
    }
}

/// Publishes a refusal on behalf of a vehicle that is not known, and so has no thread that sends. Nobody waits: what
/// was refused was not acknowledged either, and is sent again.
pub async fn reject(session: &Session, vehicle: &VehicleId, problem: &Problem) -> Result<(), SessionError> {
    let key = key(vehicle, Topic::OutRejected);
    let bytes = codec::encode(problem, Format::Json).unwrap_or_default();
    let put = session.put(key.clone(), bytes).encoding(Encoding::APPLICATION_JSON).await;
    put.map_err(|cause| SessionError::Declare { key, cause: cause.to_string() })
}

/// Whether the next publication of the topic says all that this one does.
fn is_superseded(topic: Topic) -> bool {
    matches!(topic, Topic::OutAck | Topic::OutState)
}

fn send_all(parcels: &Receiver<Parcel>, publishers: &BTreeMap<Topic, Publisher<'static>>) {
    while let Ok(parcel) = parcels.recv() {
        match parcel {
            Parcel::Answer(send) => send(),
            Parcel::Publication(topic, write) => {
                let Some(publisher) = publishers.get(&topic) else { continue };
                let sent = match write() {
                    Ok(bytes) => publisher.put(bytes).wait().map_err(|error| error.to_string()),
                    Err(error) => Err(error.to_string()),
                };
                if let Err(error) = sent {
                    tracing::error!(topic = topic.suffix(), %error, "a publication could not be sent");
                }
            }
        }
    }
}
