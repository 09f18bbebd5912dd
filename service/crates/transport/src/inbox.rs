//! The hand-over from Zenoh's callbacks to the thread that owns a vehicle: bounded by count and by bytes, and
//! never waiting on the side of the callback.

use crate::message::Incoming;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use tokio::sync::mpsc::{self, error::TrySendError};

/// How much may wait.
#[derive(Clone, Copy, Debug)]
pub struct InboxBounds {
    /// Events and questions.
    pub messages: usize,
    /// Bytes of their payloads.
    pub bytes: usize,
}

/// The end that callbacks offer to.
#[derive(Clone, Debug)]
pub struct Inbox {
    sender: mpsc::Sender<Waiting>,
    load: Arc<Load>,
    max_bytes: usize,
}

/// Why a message was given back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refused {
    /// There is no room for it now.
    Full,
    /// The owner is no more, by a fault.
    Gone,
}

/// The end that the owner takes from.
#[derive(Debug)]
pub struct Mail {
    receiver: mpsc::Receiver<Waiting>,
    load: Arc<Load>,
}

#[derive(Debug, Default)]
struct Load {
    bytes: AtomicUsize,
    refused: AtomicU64,
}

#[derive(Debug)]
struct Waiting {
    incoming: Incoming,
    bytes: usize,
}

/// A new inbox.
pub fn inbox(bounds: InboxBounds) -> (Inbox, Mail) {
    let (sender, receiver) = mpsc::channel(bounds.messages.max(1));
    let load = Arc::new(Load::default());
    (Inbox { sender, load: load.clone(), max_bytes: bounds.bytes }, Mail { receiver, load })
}

impl Inbox {
    /// Hands over, or gives back what there is no room for. Nobody waits.
    pub fn offer(&self, incoming: Incoming) -> Result<(), (Box<Incoming>, Refused)> {
        let bytes = incoming.bytes();
        // Added before it is compared, so that many callbacks at once cannot pass the bound together.
        if self.load.bytes.fetch_add(bytes, Ordering::Relaxed) + bytes > self.max_bytes {
            return Err((self.give_back(incoming, bytes), Refused::Full));
        }
        self.sender.try_send(Waiting { incoming, bytes }).map_err(|error| {
            let why = match error {
                TrySendError::Full(_) => Refused::Full,
                TrySendError::Closed(_) => Refused::Gone,
            };
            let Waiting { incoming, bytes } = error.into_inner();
            (self.give_back(incoming, bytes), why)
        })
    }

    fn give_back(&self, incoming: Incoming, bytes: usize) -> Box<Incoming> {
        self.load.bytes.fetch_sub(bytes, Ordering::Relaxed);
        self.load.refused.fetch_add(1, Ordering::Relaxed);
        Box::new(incoming)
    }
}

impl Mail {
    /// The next message; none once every [`Inbox`] is gone and all has been taken.
    pub async fn next(&mut self) -> Option<Incoming> {
        let waiting = self.receiver.recv().await?;
        self.load.bytes.fetch_sub(waiting.bytes, Ordering::Relaxed);
        Some(waiting.incoming)
    }

    /// Messages that there was no room for, since the last call.
    pub fn refused(&self) -> u64 {
        self.load.refused.swap(0, Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pdn_schemas::problem::{Code, Problem};

    fn stray(bytes: usize) -> Incoming {
        Incoming::Stray(Problem::new(Code::Invalid, "x".repeat(bytes), None))
    }

    #[test]
    fn neither_bound_is_passed_and_room_comes_back() {
        let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
        runtime.block_on(async {
            let (inbox, mut mail) = inbox(InboxBounds { messages: 3, bytes: 100 });
            inbox.offer(stray(60)).unwrap();
            assert!(inbox.offer(stray(41)).is_err());
            inbox.offer(stray(40)).unwrap();
            inbox.offer(stray(0)).unwrap();
            assert_eq!(inbox.offer(stray(0)).unwrap_err().1, Refused::Full);
            assert_eq!((mail.refused(), mail.refused()), (2, 0));
            assert_eq!(mail.next().await.unwrap().bytes(), 60);
            inbox.offer(stray(60)).unwrap();
            let again = inbox.clone();
            drop(inbox);
            drop(again);
            let mut left = 0;
            while mail.next().await.is_some() {
                left += 1;
            }
            assert_eq!(left, 3);

            let (orphan, mail) = super::inbox(InboxBounds { messages: 3, bytes: 100 });
            drop(mail);
            assert_eq!(orphan.offer(stray(0)).unwrap_err().1, Refused::Gone);
        });
    }
}
