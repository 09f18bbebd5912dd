//! `pdnd`: the perception-driven navigation daemon.
//!
//! Reading order: `cli` (what can be asked of the program), `settings`, `state_dir`, `telemetry`, then the daemon:
//! `serve` (its phases from start to end, `stop` when the end begins), `returning` (vehicles of earlier runs), `admission` (vehicles that are new), `vehicle` (the loop that owns a
//! vehicle), `keeper` (its journals), `planner` (the pool that computes answers), and `health` (is a daemon ready?).
//!
//! Exit codes: 0 well; 1 a failure while running, `pdnd health` found no ready daemon, a journal is damaged or a decision
//! comes out otherwise; 2 wrong usage or settings; 3 an endpoint, the state directory or a journal is not to be had.

mod cli;
mod settings;
mod state_dir;
mod telemetry;

mod keeper;
mod admission;
mod planner;
mod returning;
mod serve;
mod stop;
mod vehicle;

mod health;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::run()
}
