//! Which vehicle has which inbox. A vehicle stands here from its first accepted `op/configure` on.

use crate::inbox::{Inbox, Refused};
use crate::message::{Event, Incoming, Question};
use pdn_schemas::ids::VehicleId;
use pdn_schemas::problem::{Code, Problem};
use pdn_schemas::topics::Topic;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, PoisonError, RwLock};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc};

/// A message for a vehicle that is not known yet: a configuration, or an event that came too early.
#[derive(Debug)]
pub struct UnknownVehicle {
    /// Id of the vehicle.
    pub vehicle: VehicleId,
    /// The message; of an event only its head.
    pub incoming: Incoming,
    _bytes: OwnedSemaphorePermit,
}

/// How much may wait for admission.
#[derive(Clone, Copy, Debug)]
pub struct AdmissionBounds {
    /// Configurations and events.
    pub messages: usize,
    /// Bytes of their payloads.
    pub bytes: usize,
}

/// Where callbacks deliver to.
#[derive(Debug)]
pub struct Directory {
    inboxes: RwLock<Option<BTreeMap<VehicleId, Inbox>>>,
    admission: mpsc::Sender<UnknownVehicle>,
    bytes: Arc<Semaphore>,
    dropped_unknown: AtomicU64,
}

impl Directory {
    /// An empty directory, and the receiver of what comes for vehicles that are not in it.
    pub fn new(bounds: AdmissionBounds) -> (Directory, mpsc::Receiver<UnknownVehicle>) {
        let (admission, messages) = mpsc::channel(bounds.messages.max(1));
        let directory = Directory {
            inboxes: RwLock::new(Some(BTreeMap::new())),
            admission,
            bytes: Arc::new(Semaphore::new(bounds.bytes)),
            dropped_unknown: AtomicU64::new(0),
        };
        (directory, messages)
    }

    /// Adds a vehicle; false if the directory is closed.
    pub fn add(&self, vehicle: VehicleId, inbox: Inbox) -> bool {
        let mut inboxes = self.inboxes.write().unwrap_or_else(PoisonError::into_inner);
        inboxes.as_mut().map(|inboxes| inboxes.insert(vehicle, inbox)).is_some()
    }

    /// Vehicles known.
    pub fn len(&self) -> usize {
        let inboxes = self.inboxes.read().unwrap_or_else(PoisonError::into_inner);
        inboxes.as_ref().map_or(0, BTreeMap::len)
    }

    /// Whether no vehicle is known.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The inbox of a vehicle.
    pub fn find(&self, vehicle: &VehicleId) -> Option<Inbox> {
        let inboxes = self.inboxes.read().unwrap_or_else(PoisonError::into_inner);
        inboxes.as_ref()?.get(vehicle).cloned()
    }

    /// Closes every inbox: what is in them is still taken, what comes now is answered `not_ready`.
    pub fn close(&self) {
        let closed = self.inboxes.write().unwrap_or_else(PoisonError::into_inner).take();
        closed.iter().flat_map(BTreeMap::values).for_each(Inbox::close);
    }

    /// Delivers, or answers at once why not. An event for which there is no room is left to the client's
    /// outbox, which sends it again because it is not acknowledged; the inbox counts it.
    pub fn deliver(&self, vehicle: VehicleId, incoming: Incoming) {
        let refused = {
            let inboxes = self.inboxes.read().unwrap_or_else(PoisonError::into_inner);
            match inboxes.as_ref() {
                None => Some((Box::new(incoming), not_ready())),
                Some(inboxes) => match inboxes.get(&vehicle) {
                    Some(inbox) => inbox.try_send(incoming).err().map(|(incoming, why)| match why {
                        Refused::Full(bound) => (incoming, overloaded(&vehicle, bound)),
                        Refused::Closed => (incoming, not_ready()),
                        Refused::Gone => (incoming, gone(&vehicle)),
                    }),
                    None => self.deliver_to_admission(vehicle, incoming),
                },
            }
        };
        let Some((incoming, problem)) = refused else { return };
        if let Incoming::Question(question) = *incoming {
            question.answer.refuse(&problem);
        }
    }

    /// Events for unknown vehicles that were dropped unseen since the last call.
    pub fn dropped_unknown(&self) -> u64 {
        self.dropped_unknown.swap(0, Ordering::Relaxed)
    }

    fn deliver_to_admission(
        &self,
        vehicle: VehicleId,
        mut incoming: Incoming,
    ) -> Option<(Box<Incoming>, Problem)> {
        match &mut incoming {
            Incoming::Question(question) if question.topic != Topic::OpConfigure => {
                let problem = unknown_vehicle(&vehicle);
                return Some((Box::new(incoming), problem));
            }
            Incoming::Event(event) => event.payload.truncate_to_head(),
            _ => {}
        }
        let bytes = u32::try_from(incoming.bytes()).unwrap_or(u32::MAX);
        let refused = match self.bytes.clone().try_acquire_many_owned(bytes) {
            Ok(permit) => {
                let message = UnknownVehicle { vehicle: vehicle.clone(), incoming, _bytes: permit };
                self.admission.try_send(message).err()?.into_inner().incoming
            }
            Err(_) => incoming,
        };
        self.dropped_unknown.fetch_add(1, Ordering::Relaxed);
        let problem = overloaded(&vehicle, "the room for vehicles that are not known yet");
        Some((Box::new(refused), problem))
    }
}

/// What is said of a vehicle that never configured a mission.
pub fn unknown_vehicle(vehicle: &VehicleId) -> Problem {
    let message =
        format!("vehicle \"{vehicle}\" is not known; send a MissionConfig to its op/configure first");
    Problem::new(Code::UnknownVehicle, message, None)
}

fn overloaded(vehicle: &VehicleId, bound: &str) -> Problem {
    let message =
        format!("vehicle \"{vehicle}\" has no room for more now: {bound} is reached; ask again in a while");
    Problem::new(Code::Overloaded, message, None)
}

fn gone(vehicle: &VehicleId) -> Problem {
    let message =
        format!("the thread of vehicle \"{vehicle}\" has ended by a fault; see the log and start pdnd again");
    Problem::new(Code::Internal, message, None)
}

fn not_ready() -> Problem {
    Problem::new(Code::NotReady, "the service is shutting down; ask again once it is back", None)
}

impl From<Event> for Incoming {
    fn from(event: Event) -> Incoming {
        Incoming::Event(event)
    }
}

impl From<Question> for Incoming {
    fn from(question: Question) -> Incoming {
        Incoming::Question(Box::new(question))
    }
}
