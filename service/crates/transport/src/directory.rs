//! Which vehicle has which inbox. A vehicle stands here from its first accepted `op/configure` on.

use crate::inbox::{Inbox, Refused};
use crate::message::{Event, Incoming, Question};
use pdn_schemas::ids::VehicleId;
use pdn_schemas::problem::{Code, Problem};
use pdn_schemas::topics::Topic;
use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, PoisonError, RwLock};
use tokio::sync::mpsc;

/// Something for a vehicle that is not known yet: a configuration, or an event that came too early.
#[derive(Debug)]
pub struct Knock {
    /// Who.
    pub vehicle: VehicleId,
    /// What; of an event only its head.
    pub incoming: Incoming,
    _room: Room,
}

/// Bytes that a knock takes up in the lobby, given back when it is dropped.
#[derive(Debug)]
struct Room {
    taken: Arc<AtomicUsize>,
    bytes: usize,
}

/// How much may wait in the lobby.
#[derive(Clone, Copy, Debug)]
pub struct LobbyBounds {
    /// Configurations and events.
    pub messages: usize,
    /// Bytes of their payloads.
    pub bytes: usize,
}

/// Where callbacks deliver to.
#[derive(Debug)]
pub struct Directory {
    inboxes: RwLock<Option<BTreeMap<VehicleId, Inbox>>>,
    lobby: mpsc::Sender<Knock>,
    lobby_bytes: usize,
    taken: Arc<AtomicUsize>,
    lost_knocks: AtomicU64,
}

impl Directory {
    /// An empty directory, and the end at which someone answers for vehicles that are not in it.
    pub fn new(bounds: LobbyBounds) -> (Directory, mpsc::Receiver<Knock>) {
        let (lobby, knocks) = mpsc::channel(bounds.messages.max(1));
        let directory = Directory {
            inboxes: RwLock::new(Some(BTreeMap::new())),
            lobby,
            lobby_bytes: bounds.bytes,
            taken: Arc::default(),
            lost_knocks: AtomicU64::new(0),
        };
        (directory, knocks)
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

    /// Delivers, or answers at once why not. An event for which there is no room is left to the client's outbox,
    /// which sends it again because it is not acknowledged; the inbox counts it.
    pub fn deliver(&self, vehicle: VehicleId, incoming: Incoming) {
        let refused = {
            let inboxes = self.inboxes.read().unwrap_or_else(PoisonError::into_inner);
            match inboxes.as_ref() {
                None => Some((Box::new(incoming), not_ready())),
                Some(inboxes) => match inboxes.get(&vehicle) {
                    Some(inbox) => inbox.offer(incoming).err().map(|(incoming, why)| match why {
                        Refused::Full(bound) => (incoming, overloaded(&vehicle, bound)),
                        Refused::Closed => (incoming, not_ready()),
                        Refused::Gone => (incoming, gone(&vehicle)),
                    }),
                    None => self.knock(vehicle, incoming),
                },
            }
        };
        let Some((incoming, problem)) = refused else { return };
        if let Incoming::Question(question) = *incoming {
            question.answer.refuse(&problem);
        }
    }

    /// Events for unknown vehicles that were dropped unseen since the last call.
    pub fn lost_knocks(&self) -> u64 {
        self.lost_knocks.swap(0, Ordering::Relaxed)
    }

    fn knock(&self, vehicle: VehicleId, mut incoming: Incoming) -> Option<(Box<Incoming>, Problem)> {
        match &mut incoming {
            Incoming::Question(question) if question.topic != Topic::OpConfigure => {
                let problem = unknown_vehicle(&vehicle);
                return Some((Box::new(incoming), problem));
            }
            Incoming::Event(event) => event.payload.keep_head(),
            _ => {}
        }
        let bytes = incoming.bytes();
        // Added before it is compared, so that many callbacks at once cannot pass the bound together.
        let taken = self.taken.fetch_add(bytes, Ordering::Relaxed) + bytes;
        let knock = Knock { vehicle, incoming, _room: Room { taken: self.taken.clone(), bytes } };
        let refused =
            if taken > self.lobby_bytes { knock } else { self.lobby.try_send(knock).err()?.into_inner() };
        self.lost_knocks.fetch_add(1, Ordering::Relaxed);
        let problem = overloaded(&refused.vehicle, "the room for vehicles that are not known yet");
        Some((Box::new(refused.incoming), problem))
    }
}

impl Drop for Room {
    fn drop(&mut self) {
        self.taken.fetch_sub(self.bytes, Ordering::Relaxed);
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
