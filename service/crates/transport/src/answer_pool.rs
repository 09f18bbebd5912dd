//! The threads that send a vehicle's answers. Each answer goes to one client, which may not read it, so there
//! are as many threads as answers that wait for their clients, and one more: no client's answer waits for
//! another's. The queue is bounded by the answers that there can be, each of which holds a permit of the
//! inbox.

use std::collections::VecDeque;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A thread without work ends after this time.
const KEEP_ALIVE: Duration = Duration::from_secs(5);

/// Writes an answer and sends it.
pub type SendAnswer = Box<dyn FnOnce() + Send>;

/// The pool of these threads. They end once it is dropped and all is sent.
#[derive(Debug)]
pub struct AnswerPool(Arc<Shared>);

#[derive(Debug)]
struct Shared {
    name: String,
    max_threads: usize,
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Default)]
struct State {
    queue: VecDeque<SendAnswer>,
    threads: usize,
    idle: usize,
    closed: bool,
}

impl AnswerPool {
    /// No thread yet; there will be at most `max_threads`, with that name.
    pub fn new(name: String, max_threads: usize) -> AnswerPool {
        let max_threads = max_threads.max(1);
        AnswerPool(Arc::new(Shared { name, max_threads, state: Mutex::default(), changed: Condvar::new() }))
    }

    /// Has an answer sent.
    pub fn send(&self, answer: SendAnswer) {
        let mut state = self.0.state();
        state.queue.push_back(answer);
        if state.idle < state.queue.len() && state.threads < self.0.max_threads {
            let shared = self.0.clone();
            match std::thread::Builder::new().name(self.0.name.clone()).spawn(move || shared.run()) {
                Ok(_) => state.threads += 1,
                Err(error) if state.threads > 0 => {
                    tracing::warn!(%error, "no further thread for answers; they wait for each other");
                }
                Err(error) => {
                    // Here, rather than never.
                    tracing::warn!(%error, "no thread for answers");
                    let answer = state.queue.pop_back();
                    drop(state);
                    return answer.into_iter().for_each(|send| send());
                }
            }
        }
        drop(state);
        self.0.changed.notify_all();
    }

    /// Waits until all is sent; a client that does not read is waited for until Zenoh closes its link.
    pub fn finish(self) {
        let mut state = self.0.state();
        state.closed = true;
        self.0.changed.notify_all();
        while state.threads > 0 {
            state = self.0.changed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

impl Drop for AnswerPool {
    fn drop(&mut self) {
        self.0.state().closed = true;
        self.0.changed.notify_all();
    }
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        // No answer is sent while it is held, so nothing fails while it is.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn run(&self) {
        let _counted = ThreadCount(self);
        while let Some(send) = self.next() {
            send();
        }
    }

    fn next(&self) -> Option<SendAnswer> {
        let mut state = self.state();
        loop {
            if let Some(answer) = state.queue.pop_front() {
                return Some(answer);
            }
            if state.closed {
                return None;
            }
            state.idle += 1;
            let (again, waited) =
                self.changed.wait_timeout(state, KEEP_ALIVE).unwrap_or_else(PoisonError::into_inner);
            state = again;
            state.idle -= 1;
            if waited.timed_out() && state.queue.is_empty() {
                return None;
            }
        }
    }
}

/// Counts a thread out, also one that has failed.
struct ThreadCount<'a>(&'a Shared);

impl Drop for ThreadCount<'_> {
    fn drop(&mut self) {
        self.0.state().threads -= 1;
        self.0.changed.notify_all();
    }
}

impl std::fmt::Debug for State {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{} answers wait, {} threads, {} idle", self.queue.len(), self.threads, self.idle)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::sync_channel;

    const BOUND: Duration = Duration::from_secs(60);

    #[test]
    fn an_answer_does_not_wait_for_those_that_are_not_read() {
        let pool = AnswerPool::new("answer test".to_owned(), 4);
        let (read, blocked) = sync_channel::<()>(0);
        let blocked = Arc::new(Mutex::new(blocked));
        for _ in 0..3 {
            let blocked = blocked.clone();
            // Ends when the client reads, that is with `read`.
            pool.send(Box::new(move || assert!(blocked.lock().unwrap().recv().is_err())));
        }
        let (sent, heard) = sync_channel(1);
        pool.send(Box::new(move || sent.send("sent").unwrap()));
        assert_eq!(heard.recv_timeout(BOUND), Ok("sent"));
        drop(read);
        pool.finish();
    }

    #[test]
    fn all_is_sent_by_few_threads_and_a_fault_ends_only_its_own() {
        let pool = AnswerPool::new("answer test".to_owned(), 2);
        let (sent, heard) = sync_channel(100);
        for number in 0..100 {
            let sent = sent.clone();
            pool.send(Box::new(move || {
                assert_ne!(number, 50, "a fault on purpose");
                sent.send(number).unwrap();
            }));
        }
        drop(sent);
        pool.finish();
        assert_eq!(heard.iter().count(), 99);
    }
}
