//! `pdnd journal`, `recover` and `replay`: what a journal says, saving what is left of a damaged one, and its
//! decisions once more.

use super::{Failure, print};
use crate::journal_writer::identity;
use clap::{Args, ValueEnum};
use pdn_schemas::codec::{Format, encode};
use pdn_state::journal::{Journal, JournalError, files};
use pdn_state::recovery::recover_from;
use pdn_state::replay::{self, Replayed, Report, Verdict, place};
use pdn_state::{Entry, Limits, Mission, WhatIf};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io::{IsTerminal, Write as _};
use std::path::{Path, PathBuf};

/// What `pdnd journal` takes.
#[derive(Debug, Args)]
pub struct ShowArgs {
    /// The journal, <state-dir>/<vehicle>/<number>-<mission>.redb
    file: PathBuf,
    /// Every record as one line of JSON: {"record": number, "kind": name, "content": message}
    #[arg(long)]
    json: bool,
    /// What rpc/<NAME> would answer at the end of the journal, as JSON
    #[arg(long, value_enum, value_name = "NAME", conflicts_with = "json")]
    answer: Option<Question>,
}

/// What can be asked of the mission as a journal leaves it.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Question {
    /// Phase, robot, counts
    Mission,
    /// Every keyframe with its estimate and covariance
    Graph,
    /// The rasters of the target
    Coverage,
    /// The table of P_L
    LinkModel,
}

/// What `pdnd recover` takes.
#[derive(Debug, Args)]
pub struct RecoverArgs {
    /// The damaged journal; it is kept
    file: PathBuf,
    /// Where the records up to the damage go; <FILE>.recovered unless given
    #[arg(long, value_name = "NEW")]
    out: Option<PathBuf>,
    /// Put the new journal in the place of the damaged one, which becomes <FILE>.damaged
    #[arg(long, conflicts_with = "out")]
    replace: bool,
}

/// What `pdnd replay` takes.
#[derive(Debug, Args)]
pub struct ReplayArgs {
    /// The journal, <state-dir>/<vehicle>/<number>-<mission>.redb
    file: PathBuf,
    /// What to assume instead of the mission's settings, such as alpha=0.5,sigma_xy_m=0.4; of alpha,
    /// sigma_xy_m, sigma_depth_m, sigma_tilt_deg, sigma_heading_deg
    #[arg(long, value_name = "NAME=VALUE,...")]
    with: Option<String>,
    /// Threads that evaluate; the outcome is the same with any number
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: u16,
}

/// Tells what a journal says.
pub fn show(arguments: &ShowArgs) -> Result<(), Failure> {
    let journal = view(&arguments.file)?;
    match arguments.answer {
        Some(question) => answer(question, &arguments.file, &journal),
        None if arguments.json => records(&arguments.file, &journal),
        None => summary(&arguments.file, &journal),
    }
}

/// Saves what is left of a damaged journal.
pub fn recover(arguments: &RecoverArgs) -> Result<(), Failure> {
    let file = &arguments.file;
    let beside = |ending: &str| {
        let mut name = file.as_os_str().to_owned();
        name.push(ending);
        PathBuf::from(name)
    };
    let out = arguments.out.clone().unwrap_or_else(|| beside(".recovered"));
    let salvage = files::recover(file, &out, identity()).map_err(|error| failure(file, &error))?;
    let mut text = format!(
        "{}: {} records of mission \"{}\" of vehicle \"{}\" are whole; {} whole ones lie beyond the damage \
         and are lost\n",
        file.display(),
        salvage.records,
        salvage.mission,
        salvage.vehicle,
        salvage.beyond
    );
    if arguments.replace {
        let damaged = beside(".damaged");
        if damaged.exists() {
            return Err(Failure::Running(format!("{} exists already; move it away", damaged.display())));
        }
        let moved = std::fs::rename(file, &damaged).and_then(|()| std::fs::rename(&out, file));
        moved.map_err(|error| Failure::Running(format!("cannot rename {}: {error}", file.display())))?;
        let _ = writeln!(text, "written to {}; the damaged one is {}", file.display(), damaged.display());
    } else {
        let _ = writeln!(
            text,
            "written to {}; the damaged one is left as it is. For pdnd to take the mission up, put the new \
             file in its place (--replace does)",
            out.display()
        );
    }
    print(&text)
}

/// Decides again wherever a decision was recorded.
pub fn replay(arguments: &ReplayArgs) -> Result<(), Failure> {
    let assumptions = assumptions(arguments.with.as_deref())?;
    let journal = view(&arguments.file)?;
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(usize::from(arguments.threads))
        .build()
        .map_err(|error| Failure::Running(error.to_string()))?;
    let (total, terminal) = (journal.len(), std::io::stderr().is_terminal());
    let mut progress = |done: u64| {
        if terminal && (done % 512 == 0 || done == total) {
            eprint!("\rreplayed {done} of {total} records{}", if done == total { "\n" } else { "" });
        }
    };
    let report = replay::replay(&journal, Limits::default(), &pool, assumptions, &mut progress);
    let report = report.map_err(|error| failure(&arguments.file, &error))?;
    print(&verdicts(&report, arguments.with.as_deref()))?;
    let differing = report.differing().count();
    if differing > 0 || report.refusal_differs.is_some() {
        return Err(Failure::Running(format!(
            "{}: {differing} of {} decisions did not come out as recorded",
            arguments.file.display(),
            report.decisions.len()
        )));
    }
    Ok(())
}

fn view(file: &Path) -> Result<Journal, Failure> {
    files::view(file).map_err(|error| failure(file, &error))
}

fn failure(file: &Path, error: &JournalError) -> Failure {
    let message = format!("{}: {error}", file.display());
    match error {
        JournalError::Damaged { .. } => {
            Failure::Running(format!("{message}; save what is whole of it with: pdnd recover FILE"))
        }
        _ => Failure::Unavailable(message),
    }
}

fn records(file: &Path, journal: &Journal) -> Result<(), Failure> {
    let mut out = std::io::BufWriter::new(std::io::stdout().lock());
    let written = |done: std::io::Result<()>| match done {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            Err(Failure::Running(error.to_string()))
        }
        done => Ok(done.is_ok()),
    };
    for read in journal.records().map_err(|error| failure(file, &error))? {
        let line = read.and_then(|(number, record)| {
            let damaged = |what: String| JournalError::Damaged { record: Some(number), what };
            let entry = Entry::read(&record).map_err(|error| damaged(error.to_string()))?;
            let content = entry.content(Format::Json).map_err(|error| damaged(error.to_string()))?;
            let content = String::from_utf8(content).map_err(|error| damaged(error.to_string()))?;
            Ok(format!(
                "{{\"record\": {number}, \"kind\": \"{}\", \"content\": {content}}}",
                record.kind.name()
            ))
        });
        match line {
            Ok(line) if written(writeln!(out, "{line}"))? => {}
            Ok(_) => return Ok(()),
            Err(error) => {
                written(out.flush())?;
                return Err(failure(file, &error));
            }
        }
    }
    written(out.flush()).map(drop)
}

fn answer(question: Question, file: &Path, journal: &Journal) -> Result<(), Failure> {
    let mut mission = recovered(file, journal)?;
    let failed = |error: String| Failure::Running(format!("{}: {error}", file.display()));
    let encoded = match question {
        Question::Mission => encode(&mission.state(), Format::Json),
        Question::Graph => {
            let graph = mission.begin_graph(None, true).run().map_err(|error| failed(error.to_string()))?;
            encode(&graph, Format::Json)
        }
        Question::Coverage => encode(&mission.coverage(), Format::Json),
        Question::LinkModel => encode(&mission.link_model(), Format::Json),
    };
    let bytes = encoded.map_err(|error| failed(error.to_string()))?;
    let text = String::from_utf8(bytes).map_err(|error| failed(error.to_string()))?;
    print(&format!("{text}\n"))
}

/// The mission as the journal leaves it.
fn recovered(file: &Path, journal: &Journal) -> Result<Mission, Failure> {
    let recovered = recover_from(journal, files::checkpoint(file).as_deref(), Limits::default());
    Ok(recovered.map_err(|error| failure(file, &error))?.mission)
}

fn summary(file: &Path, journal: &Journal) -> Result<(), Failure> {
    let header = journal.header();
    let mut kinds: BTreeMap<&str, u64> = BTreeMap::new();
    for read in journal.records().map_err(|error| failure(file, &error))? {
        let (_, record) = read.map_err(|error| failure(file, &error))?;
        *kinds.entry(record.kind.name()).or_default() += 1;
    }
    let state = recovered(file, journal)?.state();
    let counts: Vec<String> = kinds.iter().map(|(kind, count)| format!("{count} {kind}")).collect();
    print(&format!(
        "vehicle     {}\nmission     {}\nwritten by  {}, journal {:016x}\nrecords     {}, all whole: {}\n\
         events      {} applied or refused, the next is {}\nphase       {:?}: {}\n\
         graph       {} keyframes, {} factors\n\
         decisions   {}, {} of them revisits\n",
        header.vehicle,
        header.mission,
        header.software,
        header.identity,
        journal.len(),
        counts.join(", "),
        state.next_seq,
        state.next_seq,
        state.phase,
        state.reason,
        state.keyframes,
        state.factors,
        state.decisions,
        state.revisits
    ))
}

fn verdicts(report: &Report, with: Option<&str>) -> String {
    let mut text = String::new();
    for replayed in report.differing() {
        let number = number(replayed);
        let _ = match &replayed.verdict {
            Verdict::Differs(difference) => writeln!(
                text,
                "decision {number}: {} was {} and comes out as {} (recorded by {})",
                difference.field, difference.recorded, difference.computed, replayed.software
            ),
            Verdict::Failed(error) => writeln!(text, "decision {number}: it cannot be computed now: {error}"),
            Verdict::Same | Verdict::SameAsFarAsItGot => Ok(()),
        };
    }
    if let Some(differs) = &report.refusal_differs {
        let _ = writeln!(text, "a refusal differs: {differs}");
    }
    let cut_short =
        report.decisions.iter().filter(|replayed| replayed.verdict == Verdict::SameAsFarAsItGot).count();
    let same = report.decisions.len() - report.differing().count();
    let _ = writeln!(
        text,
        "mission \"{}\" of vehicle \"{}\", {} records: {same} of {} decisions are the same bit for bit{}",
        report.mission.id(),
        report.vehicle,
        report.records,
        report.decisions.len(),
        if cut_short > 0 {
            format!(" ({cut_short} of them as far as their deadline let them)")
        } else {
            String::new()
        }
    );
    if let Some(with) = with {
        changed_decisions(report, with, &mut text);
    }
    text
}

/// Which decisions would have been others, and why.
fn changed_decisions(report: &Report, with: &str, text: &mut String) {
    let mut count = 0;
    for (replayed, assumed) in report.turned() {
        count += 1;
        let where_to = |place: Option<u64>| match place {
            None => "explore".to_owned(),
            Some(keyframe) => format!("revisit {keyframe}"),
        };
        let _ = writeln!(
            text,
            "decision {}: {} was decided, {} would have been: {}",
            number(replayed),
            where_to(place(&replayed.recorded)),
            where_to(place(assumed)),
            assumed.reason
        );
    }
    for replayed in &report.decisions {
        if let Some(Err(error)) = &replayed.assumed {
            let _ = writeln!(text, "decision {}: nothing could be decided: {error}", number(replayed));
        }
    }
    let _ =
        writeln!(text, "with {with}: {count} of {} decisions would have been others", report.decisions.len());
}

fn number(replayed: &Replayed) -> u64 {
    replayed.recorded.decision.unwrap_or_default()
}

fn assumptions(with: Option<&str>) -> Result<WhatIf, Failure> {
    let mut assumed = WhatIf::default();
    for assignment in with.into_iter().flat_map(|with| with.split(',')) {
        let wrong = |why: &str| Failure::Usage(format!("--with {assignment}: {why}"));
        let (name, value) = assignment.split_once('=').ok_or_else(|| wrong("write NAME=VALUE"))?;
        let value: f64 = value.trim().parse().map_err(|_| wrong("the value must be a number"))?;
        let (field, holds, range) = match name.trim() {
            "alpha" => (&mut assumed.alpha, (0.0..=1.0).contains(&value), "in 0 to 1"),
            "sigma_xy_m" => (&mut assumed.sigma_xy_m, value > 0.0, "above 0"),
            "sigma_depth_m" => (&mut assumed.sigma_depth_m, value > 0.0, "above 0"),
            "sigma_tilt_deg" => (&mut assumed.sigma_tilt_deg, value > 0.0, "above 0"),
            "sigma_heading_deg" => (&mut assumed.sigma_heading_deg, value > 0.0, "above 0"),
            _ => return Err(wrong("there is no such assumption; see pdnd replay --help")),
        };
        if !holds || !value.is_finite() {
            return Err(wrong(&format!("the value must lie {range}")));
        }
        *field = Some(value);
    }
    Ok(assumed)
}
