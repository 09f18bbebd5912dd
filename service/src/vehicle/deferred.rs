//! Questions with `after=` that are deferred until their event is applied.

use super::questions::ParsedQuestion;
use pdn_transport::answer::Answer;
use std::time::Instant;

/// The deferred questions, in the order in which they came. Their number is bounded by
/// `max_questions_in_flight` and `max_status_questions`.
#[derive(Default)]
pub struct DeferredQuestions {
    questions: Vec<DeferredQuestion>,
}

/// A question that waits for its event.
pub struct DeferredQuestion {
    /// What is asked.
    pub question: ParsedQuestion,
    /// Where the answer goes.
    pub answer: Answer,
    /// The event that must be applied.
    pub after: u64,
    /// When the question waits no longer.
    pub expires: Instant,
}

/// Why a question waits no longer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Released {
    /// Its event has been applied.
    Applied,
    /// Its time is up; the number that is applied next.
    Expired {
        /// All events below are applied.
        next_seq: u64,
    },
    /// The vehicle no longer holds its mission.
    Forgotten,
}

impl DeferredQuestions {
    /// Defers a question.
    pub fn push(&mut self, question: DeferredQuestion) {
        self.questions.push(question);
    }

    /// Whether none is deferred.
    pub fn is_empty(&self) -> bool {
        self.questions.is_empty()
    }

    /// When the first one's time is up.
    pub fn next_expiry(&self) -> Option<Instant> {
        self.questions.iter().map(|deferred| deferred.expires).min()
    }

    /// Removes those that wait no longer; `next_seq` tells how far a mission is.
    pub fn release(
        &mut self,
        now: Instant,
        mut next_seq: impl FnMut(&str) -> Option<u64>,
    ) -> Vec<(DeferredQuestion, Released)> {
        let mut released = Vec::new();
        let mut index = 0;
        while let Some(deferred) = self.questions.get(index) {
            let why = match next_seq(&deferred.question.mission) {
                None => Some(Released::Forgotten),
                Some(next_seq) if next_seq > deferred.after => Some(Released::Applied),
                Some(next_seq) if now >= deferred.expires => Some(Released::Expired { next_seq }),
                Some(_) => None,
            };
            match why {
                Some(why) => released.push((self.questions.remove(index), why)),
                None => index += 1,
            }
        }
        released
    }

    /// Removes all.
    pub fn take_all(&mut self) -> Vec<DeferredQuestion> {
        std::mem::take(&mut self.questions)
    }
}
