//! Phases of a mission and what leads from one to another.
//!
//! ```text
//!              start    pause   resume   hold   complete   abort
//! configured   running  -       -        -      -          aborted
//! running      -        paused  -        held   completed  aborted
//! paused       -        -       running  -      completed  aborted
//! held         -        -       running  -      completed  aborted
//! completed    -        -       -        -      -          -
//! aborted      -        -       -        -      -          -
//! ```

use pdn_schemas::reply::Phase;

/// What changes the phase of a mission.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Operation {
    /// Decisions may be asked for.
    Start,
    /// The operator stops decisions for a while.
    Pause,
    /// Decisions may be asked for again.
    Resume,
    /// The service stops decisions until someone resumes.
    Hold,
    /// The mission has ended as planned.
    Complete,
    /// The mission is given up.
    Abort,
}

impl Operation {
    /// Every operation, in the order of the table.
    pub const ALL: [Operation; 6] = [
        Operation::Start,
        Operation::Pause,
        Operation::Resume,
        Operation::Hold,
        Operation::Complete,
        Operation::Abort,
    ];

    /// The last part of its key, `op/<name>`.
    pub fn name(self) -> &'static str {
        match self {
            Operation::Start => "start",
            Operation::Pause => "pause",
            Operation::Resume => "resume",
            Operation::Hold => "hold",
            Operation::Complete => "complete",
            Operation::Abort => "abort",
        }
    }

    /// Whether it can only keep the vehicle from being sent somewhere, so that it is done whatever the disk
    /// says.
    pub fn is_careful(self) -> bool {
        !matches!(self, Operation::Start | Operation::Resume)
    }

    /// The operation of that name.
    pub fn named(name: &str) -> Option<Operation> {
        Operation::ALL.into_iter().find(|operation| operation.name() == name)
    }
}

/// An operation that the phase does not allow.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "\"{operation}\" is not possible while the mission is {}; possible now: {}",
    name(*.phase),
    listed(.legal)
)]
pub struct IllegalTransition {
    /// What was asked.
    pub operation: &'static str,
    /// The phase it was asked in.
    pub phase: Phase,
    /// What would have been possible.
    pub legal: Vec<&'static str>,
}

/// The phase after `operation` in `phase`.
///
/// # Errors
/// [`IllegalTransition`], which names the phase and what is legal in it.
pub fn transition(phase: Phase, operation: Operation) -> Result<Phase, IllegalTransition> {
    next(phase, operation).ok_or_else(|| IllegalTransition {
        operation: operation.name(),
        phase,
        legal: Operation::ALL
            .into_iter()
            .filter(|other| next(phase, *other).is_some())
            .map(Operation::name)
            .collect(),
    })
}

/// Whether another mission must wait for this one: it is running, paused or held.
pub fn is_active(phase: Phase) -> bool {
    matches!(phase, Phase::Running | Phase::Paused | Phase::Held)
}

/// Whether the mission takes no more events: it is completed or aborted.
pub fn has_ended(phase: Phase) -> bool {
    matches!(phase, Phase::Completed | Phase::Aborted)
}

/// The wire's word for a phase.
pub fn name(phase: Phase) -> &'static str {
    match phase {
        Phase::Configured => "configured",
        Phase::Running => "running",
        Phase::Paused => "paused",
        Phase::Held => "held",
        Phase::Completed => "completed",
        Phase::Aborted => "aborted",
    }
}

/// What a person does to get decisions in a phase.
pub(crate) fn how_to_run(phase: Phase) -> &'static str {
    match phase {
        Phase::Configured => "start it with op/start",
        Phase::Paused | Phase::Held => "resume it with op/resume, or ask a what-if",
        Phase::Running => "ask again",
        Phase::Completed | Phase::Aborted => "ask a what-if, or configure a new mission",
    }
}

fn listed(words: &[&'static str]) -> String {
    if words.is_empty() { "nothing, it has ended".to_string() } else { words.join(", ") }
}

fn next(phase: Phase, operation: Operation) -> Option<Phase> {
    match (phase, operation) {
        (Phase::Configured, Operation::Start) => Some(Phase::Running),
        (Phase::Running, Operation::Pause) => Some(Phase::Paused),
        (Phase::Running, Operation::Hold) => Some(Phase::Held),
        (Phase::Paused | Phase::Held, Operation::Resume) => Some(Phase::Running),
        (Phase::Running | Phase::Paused | Phase::Held, Operation::Complete) => Some(Phase::Completed),
        (Phase::Configured | Phase::Running | Phase::Paused | Phase::Held, Operation::Abort) => {
            Some(Phase::Aborted)
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PHASES: [Phase; 6] =
        [Phase::Configured, Phase::Running, Phase::Paused, Phase::Held, Phase::Completed, Phase::Aborted];

    /// The table of the module's documentation, parsed: what it says is what the code does.
    #[test]
    fn every_phase_and_operation_is_as_the_table_says() {
        let table: Vec<Vec<&str>> = include_str!("lifecycle.rs")
            .lines()
            .skip_while(|line| *line != "//! ```text")
            .skip(1)
            .take(7)
            .map(|line| line.trim_start_matches("//!").split_whitespace().collect())
            .collect();
        let phase_of = |name: &str| PHASES.into_iter().find(|phase| super::name(*phase) == name);
        for (row, phase) in table[1..].iter().zip(PHASES) {
            assert_eq!(phase_of(row[0]), Some(phase));
            for (name, cell) in table[0].iter().zip(&row[1..]) {
                let operation = Operation::named(name).expect("a name of the table's head");
                match transition(phase, operation) {
                    Ok(next) => assert_eq!(Some(next), phase_of(cell), "{name} in {}", row[0]),
                    Err(error) => {
                        assert_eq!(*cell, "-", "{name} in {}: {error}", row[0]);
                        let text = error.to_string();
                        assert!(text.contains(name) && text.contains(row[0]), "{text}");
                        for (other, cell) in table[0].iter().zip(&row[1..]) {
                            assert_eq!(error.legal.contains(other), *cell != "-");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn a_mission_is_configured_active_or_ended() {
        for phase in PHASES {
            let kinds = [phase == Phase::Configured, is_active(phase), has_ended(phase)];
            assert_eq!(kinds.into_iter().filter(|is| *is).count(), 1, "{phase:?}");
        }
    }
}
