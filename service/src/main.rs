//! `pdnd`: the perception-driven navigation daemon.
//!
//! Reading order: `cli` (what can be asked of the program), `settings`, `state_dir`, `telemetry`, `clock`,
//! then the daemon: `serve` (build, run, drain; `shutdown` is its deadline), `recovery` (vehicles of earlier
//! runs), `admission` (vehicles that are new), `vehicle` (the thread that owns a vehicle), `journal_writer`
//! (its journals), `planner` (the pool that computes answers), and `health` (is a daemon ready?).
//!
//! Exit codes: 0 well; 1 a failure while running, `pdnd health` found no ready daemon, a journal is damaged
//! or a decision differs; 2 wrong usage or settings; 3 an endpoint, the state directory or a journal is not
//! to be had.

mod cli;
mod clock;
mod settings;
mod state_dir;
mod telemetry;

mod admission;
mod journal_writer;
mod planner;
mod recovery;
mod serve;
mod shutdown;
mod vehicle;

mod health;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::run()
}
