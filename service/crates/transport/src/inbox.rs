//! The hand-over from Zenoh's callbacks to the thread that owns a vehicle: a channel that is bounded by count
//! and by bytes, whose senders never wait.
//!
//! Messages are received in the order in which they were sent, but for questions about how things stand now:
//! such a one waits at most [`OVERTAKE_AFTER`] behind events that take long to apply, then it goes first.
//! Questions and commands are counted from here until their answer is sent, each class against a bound of its
//! own, so that neither events nor questions nor commands can take the room of the others.

use crate::message::{Class, Incoming};
use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::{Notify, OwnedSemaphorePermit, Semaphore};

/// How long a question about how things stand now lets what came before it go first.
pub const OVERTAKE_AFTER: Duration = Duration::from_millis(20);

/// How much may be queued, or in flight.
#[derive(Clone, Copy, Debug)]
pub struct InboxBounds {
    /// Events that are queued.
    pub events: usize,
    /// Bytes of payload that are queued.
    pub bytes: usize,
    /// Questions of [`Class::Long`] that are not answered yet.
    pub questions: usize,
    /// Questions of [`Class::Status`] that are not answered yet.
    pub status_questions: usize,
    /// Commands that are not answered yet.
    pub commands: usize,
}

/// The end of the callbacks.
#[derive(Clone, Debug)]
pub struct Inbox(Arc<Shared>);

/// The end of the owner.
#[derive(Debug)]
pub struct InboxReceiver(Arc<Shared>);

/// Why a message was given back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Refused {
    /// There is no room for it now; the name of the bound that is reached.
    Full(&'static str),
    /// The service is shutting down.
    Closed,
    /// The owner is no more, by a fault.
    Gone,
}

#[derive(Debug)]
struct Shared {
    bounds: InboxBounds,
    queues: Mutex<Queues>,
    sent: Notify,
    /// For each class, the permits of the questions or commands that may be in flight.
    in_flight: [Arc<Semaphore>; Class::ALL.len()],
    refused: AtomicU64,
}

#[derive(Debug, Default)]
struct Queues {
    in_order: VecDeque<Queued>,
    overtaking: VecDeque<Queued>,
    sent: u64,
    events: usize,
    bytes: usize,
    closed: bool,
    gone: bool,
}

#[derive(Debug)]
struct Queued {
    ticket: u64,
    since: Instant,
    incoming: Incoming,
}

/// A new inbox.
pub fn channel(bounds: InboxBounds) -> (Inbox, InboxReceiver) {
    let permits = |class| match class {
        Class::Status => bounds.status_questions,
        Class::Long => bounds.questions,
        Class::Command => bounds.commands,
    };
    let shared = Arc::new(Shared {
        bounds,
        queues: Mutex::default(),
        sent: Notify::new(),
        in_flight: Class::ALL.map(|class| Arc::new(Semaphore::new(permits(class).max(1)))),
        refused: AtomicU64::new(0),
    });
    (Inbox(shared.clone()), InboxReceiver(shared))
}

impl Inbox {
    /// Hands over, or gives back what there is no room for. Nobody waits.
    pub fn try_send(&self, mut incoming: Incoming) -> Result<(), (Box<Incoming>, Refused)> {
        let mut queues = self.0.queues();
        let permit = match self.0.admit(&queues, &incoming) {
            Ok(permit) => permit,
            Err(why) => {
                drop(queues);
                self.0.refused.fetch_add(1, Ordering::Relaxed);
                return Err((Box::new(incoming), why));
            }
        };
        if let (Incoming::Question(question), Some(permit)) = (&mut incoming, permit) {
            question.answer.hold(permit);
        }
        queues.push(incoming.may_overtake(), incoming, Instant::now());
        drop(queues);
        self.0.sent.notify_one();
        Ok(())
    }

    /// Takes nothing more; what is queued can still be received.
    pub fn close(&self) {
        self.0.queues().closed = true;
        self.0.sent.notify_one();
    }
}

impl InboxReceiver {
    /// The next message; none once the inbox is closed and all has been received.
    pub async fn recv(&mut self) -> Option<Incoming> {
        loop {
            {
                let mut queues = self.0.queues();
                if let Some(incoming) = queues.pop(Instant::now()) {
                    return Some(incoming);
                }
                if queues.closed {
                    return None;
                }
            }
            self.0.sent.notified().await;
        }
    }

    /// Messages that there was no room for, since the last call.
    pub fn refused(&self) -> u64 {
        self.0.refused.swap(0, Ordering::Relaxed)
    }
}

impl Drop for InboxReceiver {
    fn drop(&mut self) {
        let left = {
            let mut queues = self.0.queues();
            queues.gone = true;
            (std::mem::take(&mut queues.in_order), std::mem::take(&mut queues.overtaking))
        };
        // Outside of the lock: questions among them answer, and give back their permits.
        drop(left);
    }
}

impl Shared {
    fn queues(&self) -> MutexGuard<'_, Queues> {
        // No code that can fail runs while it is held.
        self.queues.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Checks that there is room; gives the permit of a question or command.
    fn admit(&self, queues: &Queues, incoming: &Incoming) -> Result<Option<OwnedSemaphorePermit>, Refused> {
        if queues.gone {
            return Err(Refused::Gone);
        }
        if queues.closed {
            return Err(Refused::Closed);
        }
        let permit = match incoming.class() {
            None if queues.events >= self.bounds.events.max(1) => {
                return Err(Refused::Full("incoming_messages"));
            }
            None => None,
            Some(class) => {
                let permit = self.in_flight[class as usize].clone().try_acquire_owned();
                Some(permit.map_err(|_| Refused::Full(class.bound()))?)
            }
        };
        if queues.bytes + incoming.bytes() > self.bounds.bytes {
            return Err(Refused::Full("incoming_bytes"));
        }
        Ok(permit)
    }
}

impl Queues {
    fn push(&mut self, may_overtake: bool, incoming: Incoming, since: Instant) {
        self.events += usize::from(incoming.class().is_none());
        self.bytes += incoming.bytes();
        self.sent += 1;
        let queued = Queued { ticket: self.sent, since, incoming };
        let queue = if may_overtake { &mut self.overtaking } else { &mut self.in_order };
        queue.push_back(queued);
    }

    fn pop(&mut self, now: Instant) -> Option<Incoming> {
        let overtakes = match (self.overtaking.front(), self.in_order.front()) {
            (Some(overtaking), Some(next)) => {
                overtaking.ticket < next.ticket || now.duration_since(overtaking.since) >= OVERTAKE_AFTER
            }
            (overtaking, _) => overtaking.is_some(),
        };
        let queue = if overtakes { &mut self.overtaking } else { &mut self.in_order };
        let Queued { incoming, .. } = queue.pop_front()?;
        self.events -= usize::from(incoming.class().is_none());
        self.bytes -= incoming.bytes();
        Some(incoming)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pdn_schemas::problem::{Code, Problem};

    const BOUNDS: InboxBounds =
        InboxBounds { events: 3, bytes: 100, questions: 2, status_questions: 1, commands: 1 };

    fn unroutable(bytes: usize) -> Incoming {
        Incoming::Unroutable(Problem::new(Code::Invalid, "x".repeat(bytes), None))
    }

    fn runtime() -> tokio::runtime::Runtime {
        tokio::runtime::Builder::new_current_thread().build().unwrap()
    }

    #[test]
    fn neither_bound_of_events_is_passed_and_room_comes_back() {
        runtime().block_on(async {
            let (inbox, mut receiver) = channel(BOUNDS);
            inbox.try_send(unroutable(60)).unwrap();
            assert_eq!(inbox.try_send(unroutable(41)).unwrap_err().1, Refused::Full("incoming_bytes"));
            inbox.try_send(unroutable(40)).unwrap();
            inbox.try_send(unroutable(0)).unwrap();
            assert_eq!(inbox.try_send(unroutable(0)).unwrap_err().1, Refused::Full("incoming_messages"));
            assert_eq!((receiver.refused(), receiver.refused()), (2, 0));
            assert_eq!(receiver.recv().await.unwrap().bytes(), 60);
            inbox.try_send(unroutable(60)).unwrap();
            inbox.close();
            assert_eq!(inbox.try_send(unroutable(0)).unwrap_err().1, Refused::Closed);
            let mut left = 0;
            while receiver.recv().await.is_some() {
                left += 1;
            }
            assert_eq!(left, 3);
            drop(receiver);
            assert_eq!(inbox.try_send(unroutable(0)).unwrap_err().1, Refused::Gone);
        });
    }

    #[test]
    fn a_question_about_now_keeps_its_place_but_not_for_long() {
        let (mut queues, start) = (Queues::default(), Instant::now());
        for (bytes, may_overtake) in [(1, false), (2, true), (3, false), (4, true), (5, false)] {
            queues.push(may_overtake, unroutable(bytes), start);
        }
        let mut pop = |now| queues.pop(now).map(|incoming| incoming.bytes());
        assert_eq!([pop(start), pop(start)], [Some(1), Some(2)]);
        let late = start + OVERTAKE_AFTER;
        assert_eq!([pop(late), pop(late), pop(late), pop(late)], [Some(4), Some(3), Some(5), None]);
        assert_eq!((queues.events, queues.bytes), (0, 0));
    }
}
