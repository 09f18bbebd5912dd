//! Every setting of the daemon: its name, default, unit and range.
//!
//! Four layers, the later wins: the defaults here, a file (`--config`), the environment (`PDN_<NAME>`),
//! flags. What a mission is stands elsewhere: it comes with `op/configure`.

mod layers;
mod list;

pub use layers::{Layers, SettingsError};
pub use list::{SETTINGS, document};

use pdn_state::Limits;
use pdn_state::journal::files::Journals;
use pdn_transport::inbox::InboxBounds;
use pdn_transport::outgoing::OutgoingBounds;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// The settings in force. Each field is described where it is listed, in [`SETTINGS`], in the same order.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[allow(missing_docs)]
pub struct Settings {
    pub listen: Vec<String>,
    pub connect: Vec<String>,
    pub zenoh_config: PathBuf,
    pub open_timeout_ms: u64,
    pub max_vehicles: u64,
    pub incoming_messages: u64,
    pub incoming_bytes: u64,
    pub ahead_bytes: u64,
    pub outgoing_messages: u64,
    pub max_questions_in_flight: u64,
    pub max_status_questions: u64,
    pub max_commands: u64,
    pub wait_ms: u64,
    pub planner_threads: u64,
    pub max_missions: u64,
    pub max_events: u64,
    pub max_keyframes: u64,
    pub max_factors: u64,
    pub max_factors_per_keyframe: u64,
    pub max_cells: u64,
    pub drain_ms: u64,
    pub state_dir: PathBuf,
    pub sync_events: u64,
    pub sync_ms: u64,
    pub log_format: LogFormat,
    pub log_level: String,
}

impl Default for Settings {
    fn default() -> Self {
        let limits = Limits::default();
        Settings {
            listen: Vec::new(),
            connect: Vec::new(),
            zenoh_config: PathBuf::new(),
            open_timeout_ms: 10_000,
            max_vehicles: 16,
            incoming_messages: 2048,
            incoming_bytes: 16 * 1024 * 1024,
            ahead_bytes: 16 * 1024 * 1024,
            outgoing_messages: 4096,
            max_questions_in_flight: 16,
            max_status_questions: 64,
            max_commands: 16,
            wait_ms: 10_000,
            planner_threads: 0,
            max_missions: limits.max_missions as u64,
            max_events: limits.max_events,
            max_keyframes: limits.max_keyframes as u64,
            max_factors: limits.max_factors as u64,
            max_factors_per_keyframe: limits.max_factors_per_keyframe as u64,
            max_cells: limits.max_cells,
            drain_ms: 5_000,
            state_dir: PathBuf::new(),
            sync_events: 64,
            sync_ms: 20,
            log_format: LogFormat::Human,
            log_level: "info".to_owned(),
        }
    }
}

/// How log lines are written to standard error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LogFormat {
    /// For a person.
    Human,
    /// One JSON object a line.
    Json,
}

/// Name of a setting in the environment.
pub fn environment_name(name: &str) -> String {
    format!("PDN_{}", name.to_ascii_uppercase())
}

impl Settings {
    /// Threads of the planner's pool: `planner_threads`, or the cores less one and at least one.
    pub fn planner_threads(&self) -> usize {
        match self.planner_threads {
            0 => std::thread::available_parallelism().map_or(1, |cores| cores.get().saturating_sub(1).max(1)),
            threads => count(threads),
        }
    }

    /// What may come in for one vehicle before it is done with.
    pub fn incoming(&self) -> InboxBounds {
        InboxBounds {
            events: count(self.incoming_messages),
            bytes: count(self.incoming_bytes),
            questions: count(self.max_questions_in_flight),
            status_questions: count(self.max_status_questions),
            commands: count(self.max_commands),
        }
    }

    /// What may wait for the network for one vehicle.
    pub fn outgoing(&self) -> OutgoingBounds {
        OutgoingBounds {
            publications: count(self.outgoing_messages),
            // And the answer to the configuration that made the vehicle.
            answers: 1 + count(self.max_questions_in_flight + self.max_status_questions + self.max_commands),
        }
    }

    /// The journals below `state_dir`; none without one.
    pub fn journals(&self) -> Option<Journals> {
        (!self.state_dir.as_os_str().is_empty()).then(|| Journals::new(&self.state_dir))
    }

    /// What one vehicle and each of its missions may hold.
    pub fn limits(&self) -> Limits {
        Limits {
            max_missions: count(self.max_missions),
            max_buffered_bytes: count(self.ahead_bytes),
            max_events: self.max_events,
            max_keyframes: count(self.max_keyframes),
            max_factors: count(self.max_factors),
            max_factors_per_keyframe: count(self.max_factors_per_keyframe),
            max_cells: self.max_cells,
            ..Limits::default()
        }
    }
}

/// A setting as a count; on every machine that pdnd runs on, both are 64 bits wide.
pub fn count(setting: u64) -> usize {
    usize::try_from(setting).unwrap_or(usize::MAX)
}
