//! Where the messages of the contract meet the types of the method, and nowhere else: what a message says is
//! checked on its way in, and an answer loses nothing on its way out.

pub mod shapes;

pub mod config;
pub mod event;
pub mod planner;
pub mod question;

pub mod reply;
