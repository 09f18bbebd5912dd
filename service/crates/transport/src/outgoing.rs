//! What goes out of one vehicle, sent by threads of its own: a client that does not read holds up one of
//! these threads until Zenoh closes its link (`wait_before_close`), never the mission and never another
//! vehicle.
//!
//! What the next publication supersedes (`out/ack`, `out/state`) never waits for a client and has a thread to
//! itself, so that acknowledgements flow whoever else does not read. Other publications wait for slow
//! clients, and answers for theirs only.
//!
//! Zenoh queues what goes to a client by priority, and whoever waits for room in such a queue keeps every
//! other sender from it, even one that would not wait. Hence each of the three kinds has a priority of its
//! own: answers that of their questions, which is `Data`, and events on their way to other listeners
//! `Background` (deploy/zenoh.json5).

use crate::answer::Answer;
use crate::answer_pool::AnswerPool;
use crate::session::SessionError;
use pdn_schemas::codec::{self, CodecError, Format, Message};
use pdn_schemas::ids::VehicleId;
use pdn_schemas::keys::key;
use pdn_schemas::problem::Problem;
use pdn_schemas::topics::{Role, Topic};
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::thread::JoinHandle;
use zenoh::bytes::Encoding;
use zenoh::pubsub::Publisher;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::{Session, Wait};

/// How much may wait for the network.
#[derive(Clone, Copy, Debug)]
pub struct OutgoingBounds {
    /// Publications of each of the two kinds.
    pub publications: usize,
    /// Answers; as many as there can be questions and commands in flight.
    pub answers: usize,
}

/// The queues towards the sending threads.
#[derive(Debug)]
pub struct Outgoing {
    superseded: SyncSender<Publication>,
    lasting: SyncSender<Publication>,
    publishing: [JoinHandle<()>; 2],
    answer_pool: AnswerPool,
    left_out: AtomicU64,
}

/// Messages are written by the sending threads: a graph of 100,000 keyframes takes a while.
struct Publication {
    topic: Topic,
    write: Box<dyn FnOnce() -> Result<Vec<u8>, CodecError> + Send>,
}

impl Outgoing {
    /// Declares the vehicle's publishers and starts the threads.
    pub async fn open(
        session: &Session,
        vehicle: &VehicleId,
        bounds: OutgoingBounds,
    ) -> Result<Outgoing, SessionError> {
        let (to_supersede, superseded) = sync_channel(bounds.publications.max(1));
        let (to_last, lasting) = sync_channel(bounds.publications.max(1));
        let states = publishers(session, vehicle, true).await?;
        let news = publishers(session, vehicle, false).await?;
        Ok(Outgoing {
            superseded: to_supersede,
            lasting: to_last,
            publishing: [
                spawn(format!("state {vehicle}"), move || publish_all(&superseded, &states))?,
                spawn(format!("news {vehicle}"), move || publish_all(&lasting, &news))?,
            ],
            answer_pool: AnswerPool::new(format!("answer {vehicle}"), bounds.answers),
            left_out: AtomicU64::new(0),
        })
    }

    /// Publishes, or leaves it out where too many wait for a client that does not read. What lasts is counted
    /// then ([`Self::left_out`]); it can still be asked for, or is counted where it can be asked for.
    pub fn publish<T: Message + Send + 'static>(&self, topic: Topic, message: T) {
        let write = Box::new(move || codec::encode(&message, Format::Json));
        let queue = if is_superseded(topic) { &self.superseded } else { &self.lasting };
        match queue.try_send(Publication { topic, write }) {
            Ok(()) => {}
            Err(TrySendError::Full(_)) if is_superseded(topic) => {}
            Err(TrySendError::Full(_)) => {
                self.left_out.fetch_add(1, Ordering::Relaxed);
            }
            Err(TrySendError::Disconnected(_)) => tracing::error!("a publishing thread has ended"),
        }
    }

    /// Publications that last and were left out since the last call.
    pub fn left_out(&self) -> u64 {
        self.left_out.swap(0, Ordering::Relaxed)
    }

    /// Sends an answer.
    pub fn answer<T: Message + Send + 'static>(&self, answer: Answer, reply: Result<T, Problem>) {
        self.answer_pool.send(Box::new(move || answer.send(&reply)));
    }

    /// Sends a refusal.
    pub fn refuse(&self, answer: Answer, problem: Problem) {
        self.answer_pool.send(Box::new(move || answer.refuse(&problem)));
    }

    /// Waits until all is sent. A client that does not read is waited for until Zenoh closes its link.
    pub fn finish(self) {
        let Outgoing { superseded, lasting, publishing, answer_pool, .. } = self;
        drop((superseded, lasting));
        answer_pool.finish();
        for thread in publishing {
            if thread.join().is_err() {
                tracing::error!("a publishing thread had failed");
            }
        }
    }
}

/// Publishes a refusal on behalf of a vehicle that is not known, and so has no thread that sends. Nobody
/// waits: what was refused was not acknowledged either, and is sent again.
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

async fn publishers(
    session: &Session,
    vehicle: &VehicleId,
    superseded: bool,
) -> Result<BTreeMap<Topic, Publisher<'static>>, SessionError> {
    let (congestion, priority) = if superseded {
        (CongestionControl::Drop, Priority::DataHigh)
    } else {
        (CongestionControl::Block, Priority::DataLow)
    };
    let mut publishers = BTreeMap::new();
    for &topic in Topic::ALL {
        if topic.role() != Role::Publication || is_superseded(topic) != superseded {
            continue;
        }
        let key = key(vehicle, topic);
        let publisher = session
            .declare_publisher(key.clone())
            .encoding(Encoding::APPLICATION_JSON)
            .congestion_control(congestion)
            .priority(priority)
            .await
            .map_err(|cause| SessionError::Declare { key, cause: cause.to_string() })?;
        publishers.insert(topic, publisher);
    }
    Ok(publishers)
}

fn spawn(name: String, run: impl FnOnce() + Send + 'static) -> Result<JoinHandle<()>, SessionError> {
    let thread = std::thread::Builder::new().name(name.clone()).spawn(run);
    thread.map_err(|cause| SessionError::Declare { key: name, cause: cause.to_string() })
}

fn publish_all(publications: &Receiver<Publication>, publishers: &BTreeMap<Topic, Publisher<'static>>) {
    while let Ok(Publication { topic, write }) = publications.recv() {
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
