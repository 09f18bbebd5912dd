//! Perception-driven navigation: from a snapshot of a mission to a decision [PDN12, III].
//!
//! Reading order. What goes in: [`settings`], [`snapshot`]. What is near what, taken over from one
//! snapshot by the next: `spatial`. The steps of the paper: [`saliency`] (III.A), [`cluster`] and
//! [`waypoint`] (III.B), [`route`] and [`round_trip`] (III.C), [`link_model`] (eq. 2), [`registration`]
//! (eq. 3), [`expected_places`] (eqs. 1, 3), [`belief`] (eq. 4), [`coverage`] (A_covered), [`reward`]
//! (eqs. 5 to 9). Their composition: [`mod@decide`], with [`decision`] as the result and [`reason`] for
//! the person who reads it.
//!
//! Everything is a pure function of the snapshot: no clock, no randomness, no hash order. Threads appear only
//! where candidates are spread over a pool ([`belief::expect_all`]), and the result does not depend on their
//! number.
//!
//! Frames: world north-east-down in metres, `z` is depth; body x forward, y right, z down; camera x right, y
//! down, z along the optical axis. Tangent vectors are `[rho (m); phi (rad)]`, perturbing on the right.

pub mod error;

pub mod distance;
mod memo;
mod view_angle;

pub mod settings;
pub mod snapshot;

mod spatial;

pub mod saliency;

pub mod cluster;
mod revisit;
pub mod waypoint;

pub mod round_trip;
pub mod route;

pub mod link_model;
pub mod registration;

pub mod expected_places;

pub mod belief;
mod bound;

pub mod coverage;

pub mod reward;

pub mod candidate;
pub mod decide;
pub mod decision;
pub mod reason;

pub use coverage::Coverage;
pub use decide::{decide, evaluate_paths};
pub use decision::{Action, Candidate, Decision, Evaluation, Exploration, Question, Robot};
pub use error::PlanningError;
pub use link_model::LinkModel;
pub use revisit::{Route, Waypoint};
pub use saliency::Saliency;
pub use settings::{Allowable, Settings};
pub use snapshot::{Derived, DerivedCache, OdometryStep, Snapshot, SnapshotKeyframe};
pub use waypoint::waypoints;
