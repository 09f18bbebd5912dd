//! pdn on Zenoh and nothing else: the session, what comes in, what goes out.
//!
//! Reading order: [`session`] (configuration, opening, closing), [`message`] (what comes in), [`parameters`]
//! and [`payload`] (how it is read), [`inbox`] (the bounded hand-over to the thread that owns a vehicle),
//! [`directory`] (which vehicle's inbox), [`intake`] (the callbacks), [`answer`] (the reply to one question),
//! [`outgoing`] and [`answer_pool`] (publications and replies, sent by threads of their own).
//!
//! A callback runs on the task that receives from a link: were it to wait, everything on that link would
//! stand still. So a callback looks at the key, counts bytes and hands over, or answers `overloaded` at once.

pub mod session;

pub mod message;
pub mod parameters;
pub mod payload;

pub mod directory;
pub mod inbox;
pub mod intake;

pub mod answer;
pub mod answer_pool;
pub mod outgoing;
