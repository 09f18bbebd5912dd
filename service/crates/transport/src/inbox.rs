//! The hand-over from Zenoh's callbacks to the thread that owns a vehicle: bounded by count and by bytes, and
//! never waiting on the side of the callback.
//!
//! Messages are taken in the order in which they came, but for questions about how things stand now: such a one
//! waits at most [`PATIENCE`] behind events that take long to apply, then it goes first. Questions and commands are
//! counted from here until their answer is sent, each class against a bound of its own, so that neither events nor
//! questions nor commands can take the room of the others.

use crate::message::{Class, Incoming};
use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::Notify;

/// How long a question about how things stand now lets what came before it go first.
pub const PATIENCE: Duration = Duration::from_millis(20);

/// How much may wait, or be under way.
#[derive(Clone, Copy, Debug)]
pub struct InboxBounds {
    /// Events that wait.
    pub events: usize,
    /// Bytes of payload that wait.
    pub bytes: usize,
    /// Questions of [`Class::Long`] that are not answered yet.
    pub questions: usize,
    /// Questions of [`Class::Status`] that are not answered yet.
    pub status_questions: usize,
    /// Commands that are not answered yet.
    pub commands: usize,
}

/// The end that callbacks offer to.
#[derive(Clone, Debug)]
pub struct Inbox(Arc<Shared>);

/// The end that the owner takes from.
#[derive(Debug)]
pub struct Mail(Arc<Shared>);

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

/// Counts a question or command until it is dropped, which is when its answer is sent.
#[derive(Debug)]
pub struct Permit {
    shared: Arc<Shared>,
    class: Class,
}

#[derive(Debug)]
struct Shared {
    bounds: InboxBounds,
    queues: Mutex<Queues>,
    come: Notify,
    under_way: [AtomicUsize; Class::COUNT],
    refused: AtomicU64,
}

#[derive(Debug, Default)]
struct Queues {
    in_order: VecDeque<Waiting>,
    about_now: VecDeque<Waiting>,
    taken: u64,
    events: usize,
    bytes: usize,
    closed: bool,
    gone: bool,
}

#[derive(Debug)]
struct Waiting {
    ticket: u64,
    since: Instant,
    incoming: Incoming,
}

/// A new inbox.
pub fn inbox(bounds: InboxBounds) -> (Inbox, Mail) {
    let shared = Arc::new(Shared {
        bounds,
        queues: Mutex::default(),
        come: Notify::new(),
        under_way: Default::default(),
        refused: AtomicU64::new(0),
    });
    (Inbox(shared.clone()), Mail(shared))
}

impl Inbox {
    /// Hands over, or gives back what there is no room for. Nobody waits.
    pub fn offer(&self, mut incoming: Incoming) -> Result<(), (Box<Incoming>, Refused)> {
        let class = incoming.class();
        let mut queues = self.0.queues();
        if let Err(why) = self.0.check(&queues, class, incoming.bytes()) {
            drop(queues);
            self.0.refused.fetch_add(1, Ordering::Relaxed);
            return Err((Box::new(incoming), why));
        }
        if let (Incoming::Question(question), Some(class)) = (&mut incoming, class) {
            self.0.under_way[class as usize].fetch_add(1, Ordering::Relaxed);
            question.answer.hold(Permit { shared: self.0.clone(), class });
        }
        queues.push(incoming.is_about_now(), incoming, Instant::now());
        drop(queues);
        self.0.come.notify_one();
        Ok(())
    }

    /// Takes nothing more; what waits can still be taken.
    pub fn close(&self) {
        self.0.queues().closed = true;
        self.0.come.notify_one();
    }
}

impl Mail {
    /// The next message; none once the inbox is closed and all has been taken.
    pub async fn next(&mut self) -> Option<Incoming> {
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
            self.0.come.notified().await;
        }
    }

    /// Messages that there was no room for, since the last call.
    pub fn refused(&self) -> u64 {
        self.0.refused.swap(0, Ordering::Relaxed)
    }
}

impl Drop for Mail {
    fn drop(&mut self) {
        let left = {
            let mut queues = self.0.queues();
            queues.gone = true;
            (std::mem::take(&mut queues.in_order), std::mem::take(&mut queues.about_now))
        };
        // Outside of the lock: questions among them answer, and give back their permits.
        drop(left);
    }
}

impl Drop for Permit {
    fn drop(&mut self) {
        self.shared.under_way[self.class as usize].fetch_sub(1, Ordering::Relaxed);
    }
}

impl Shared {
    fn queues(&self) -> MutexGuard<'_, Queues> {
        // No code that can fail runs while it is held.
        self.queues.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Whether there is room. Only callers that hold the lock add, so no bound is passed together.
    fn check(&self, queues: &Queues, class: Option<Class>, bytes: usize) -> Result<(), Refused> {
        let bounds = &self.bounds;
        let (count, bound, name) = match class {
            None => (queues.events, bounds.events, "incoming_messages"),
            Some(class) => {
                let under_way = self.under_way[class as usize].load(Ordering::Relaxed);
                match class {
                    Class::Long => (under_way, bounds.questions, "max_questions_in_flight"),
                    Class::Status => (under_way, bounds.status_questions, "max_status_questions"),
                    Class::Command => (under_way, bounds.commands, "max_commands"),
                }
            }
        };
        if queues.gone {
            Err(Refused::Gone)
        } else if queues.closed {
            Err(Refused::Closed)
        } else if count >= bound.max(1) {
            Err(Refused::Full(name))
        } else if queues.bytes + bytes > bounds.bytes {
            Err(Refused::Full("incoming_bytes"))
        } else {
            Ok(())
        }
    }
}

impl Queues {
    fn push(&mut self, is_about_now: bool, incoming: Incoming, since: Instant) {
        self.events += usize::from(incoming.class().is_none());
        self.bytes += incoming.bytes();
        self.taken += 1;
        let waiting = Waiting { ticket: self.taken, since, incoming };
        let queue = if is_about_now { &mut self.about_now } else { &mut self.in_order };
        queue.push_back(waiting);
    }

    fn pop(&mut self, now: Instant) -> Option<Incoming> {
        let goes_first = match (self.about_now.front(), self.in_order.front()) {
            (Some(about_now), Some(next)) => {
                about_now.ticket < next.ticket || now.duration_since(about_now.since) >= PATIENCE
            }
            (about_now, _) => about_now.is_some(),
        };
        let queue = if goes_first { &mut self.about_now } else { &mut self.in_order };
        let Waiting { incoming, .. } = queue.pop_front()?;
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

    fn stray(bytes: usize) -> Incoming {
        Incoming::Stray(Problem::new(Code::Invalid, "x".repeat(bytes), None))
    }

    fn runtime() -> tokio::runtime::Runtime {
        tokio::runtime::Builder::new_current_thread().build().unwrap()
    }

    #[test]
    fn neither_bound_of_events_is_passed_and_room_comes_back() {
        runtime().block_on(async {
            let (inbox, mut mail) = inbox(BOUNDS);
            inbox.offer(stray(60)).unwrap();
            assert_eq!(inbox.offer(stray(41)).unwrap_err().1, Refused::Full("incoming_bytes"));
            inbox.offer(stray(40)).unwrap();
            inbox.offer(stray(0)).unwrap();
            assert_eq!(inbox.offer(stray(0)).unwrap_err().1, Refused::Full("incoming_messages"));
            assert_eq!((mail.refused(), mail.refused()), (2, 0));
            assert_eq!(mail.next().await.unwrap().bytes(), 60);
            inbox.offer(stray(60)).unwrap();
            inbox.close();
            assert_eq!(inbox.offer(stray(0)).unwrap_err().1, Refused::Closed);
            let mut left = 0;
            while mail.next().await.is_some() {
                left += 1;
            }
            assert_eq!(left, 3);
            drop(mail);
            assert_eq!(inbox.offer(stray(0)).unwrap_err().1, Refused::Gone);
        });
    }

    #[test]
    fn a_question_about_now_keeps_its_place_but_not_for_long() {
        let (mut queues, start) = (Queues::default(), Instant::now());
        for (bytes, is_about_now) in [(1, false), (2, true), (3, false), (4, true), (5, false)] {
            queues.push(is_about_now, stray(bytes), start);
        }
        let mut pop = |now| queues.pop(now).map(|incoming| incoming.bytes());
        assert_eq!([pop(start), pop(start)], [Some(1), Some(2)]);
        let late = start + PATIENCE;
        assert_eq!([pop(late), pop(late), pop(late), pop(late)], [Some(4), Some(3), Some(5), None]);
        assert_eq!((queues.events, queues.bytes), (0, 0));
    }
}
