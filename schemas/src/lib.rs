//! The contract of pdn: every message, key, code and limit that another program may rely on.
//!
//! The Rust types here are the single source. The registry of layouts, the JSON Schemas, the Python codec,
//! the golden vectors and the lists of keys and codes in `schemas/` are generated from them and checked in.
//!
//! Reading order: [`shared`] (poses, covariances), [`event`] (what a vehicle sends), [`config`] (what a
//! mission is), [`command`] and [`reply`] (what is asked and answered), then how they travel: [`ids`],
//! [`topics`] and [`keys`] (under which name), [`codec`] (as which bytes), [`registry`] (with which layout),
//! [`history`] (with which earlier ones), [`problem`] (what is refused, and why) and [`limits`]; [`record`]
//! is what the journal keeps besides.
//!
//! Conventions: the world frame is north-east-down in metres, `z` is depth; a pose is `world_from_body`; a
//! tangent vector is `[rho (m); phi (rad)]`, translation first, perturbing on the right in the body frame;
//! every covariance is in that order, row-major. A unit closes a name.

pub mod shared;

pub mod event;

pub mod config;

pub mod command;
pub mod reply;

pub mod ids;
pub mod keys;
pub mod topics;

pub mod codec;
pub mod history;
pub mod registry;

pub mod limits;
pub mod problem;

pub mod record;

pub use command::{Command, EvaluateRequest};
pub use config::MissionConfig;
pub use event::{Factor, FactorKind, Keyframe, LinkOutcome};
pub use reply::{Decision, IngestStatus, MissionState};
pub use shared::{Covariance6, Pose};
