//! Measures pdn on a survey, and writes the input for the peers. `make bench` runs it; see
//! `tests/perf/README.md`.

mod arrays;
mod candidates;
mod draw;
mod evaluation;
mod input;
mod kernel;
mod measure;
mod memory;
mod run;
mod survey;

use std::error::Error;
use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use serde::Serialize;

type Fallible<T> = Result<T, Box<dyn Error>>;

#[derive(Parser)]
#[command(about = "Measures pdn on a survey; prints JSON")]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Streams a survey, evaluates candidates at its end, and writes the input for the peers
    Run(Run),
    /// Memory of streaming a survey, in a process of its own
    StreamMemory(Which),
    /// Memory of eliminating a written input and evaluating its candidates, in a process of its own
    EvaluateMemory {
        /// What `run --write` wrote
        input: PathBuf,
        /// Candidates, spread over those that were written
        #[arg(long)]
        candidates: usize,
    },
}

/// A survey.
#[derive(Args)]
struct Which {
    /// Keyframes of the survey
    #[arg(long, value_parser = clap::value_parser!(u32).range(2..=1_000_000))]
    keyframes: u32,
    /// Share of the area that is salient, in percent
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=99))]
    salient_percent: u32,
}

impl Which {
    fn keyframes(&self) -> Vec<survey::Keyframe> {
        survey::keyframes(self.keyframes as usize, f64::from(self.salient_percent) * 1e-2)
    }
}

#[derive(Args)]
struct Run {
    #[command(flatten)]
    which: Which,
    /// Numbers of candidates, separated by commas; each is a part of the greatest
    #[arg(long, value_delimiter = ',', required = true)]
    candidates: Vec<usize>,
    /// How often each time is measured
    #[arg(long, default_value_t = 3)]
    repeats: usize,
    /// Where to write the input for the peers
    #[arg(long)]
    write: Option<PathBuf>,
}

fn main() -> Fallible<()> {
    match Cli::parse().command {
        Command::Run(run) => print(&run::run(&run)?),
        Command::StreamMemory(which) => print(&memory::of_stream(&which.keyframes())?),
        Command::EvaluateMemory { input, candidates } => print(&memory::of_evaluation(&input, candidates)?),
    }
}

fn print(value: &impl Serialize) -> Fallible<()> {
    println!("{}", serde_json::to_string(value)?);
    Ok(())
}
