//! The decisions of a journal once more: each recomputed from what the mission knew when it was asked, and
//! compared bit for bit with what was recorded; and what would have been decided under other assumptions.

use crate::error::StateError;
use crate::history::Entry;
use crate::journal::{Journal, JournalError};
use crate::limits::Limits;
use crate::mission::Mission;
use crate::recovery::Recovery;
use crate::request::{DecisionRequest, WhatIf};
use pdn_schemas::record::{DecisionTaken, Kind};
use pdn_schemas::reply::{Action, Decision};
use rayon::ThreadPool;
use std::collections::BTreeMap;

mod difference;

pub use difference::Difference;

/// What came of a replay.
#[derive(Clone, Debug)]
pub struct Report {
    /// Id of the vehicle.
    pub vehicle: String,
    /// The mission as the journal leaves it.
    pub mission: Mission,
    /// Records of the journal.
    pub records: u64,
    /// Every decision, in the order in which they were recorded.
    pub decisions: Vec<Replayed>,
    /// The first refusal that came out other than recorded.
    pub refusal_differs: Option<String>,
}

/// A decision and what came of it now.
#[derive(Clone, Debug, PartialEq)]
pub struct Replayed {
    /// The decision as recorded.
    pub recorded: Decision,
    /// What decided.
    pub software: String,
    /// How it compares.
    pub verdict: Verdict,
    /// What would have been decided under the assumptions, or why nothing; none without assumptions.
    pub assumed: Option<Result<Decision, StateError>>,
}

/// How a recomputed decision compares with the recorded one.
#[derive(Clone, Debug, PartialEq)]
pub enum Verdict {
    /// Every bit is the same.
    Same,
    /// It had been stopped by its deadline; what had been evaluated by then is the same, bit for bit. Which
    /// candidates those were depends on the clock, and so does the choice.
    SameAsFarAsItGot,
    /// The first difference.
    Differs(Difference),
    /// It cannot be computed now.
    Failed(StateError),
}

impl Report {
    /// Decisions that did not come out as recorded.
    pub fn differing(&self) -> impl Iterator<Item = &Replayed> {
        let same = |verdict: &Verdict| matches!(verdict, Verdict::Same | Verdict::SameAsFarAsItGot);
        self.decisions.iter().filter(move |replayed| !same(&replayed.verdict))
    }

    /// Decisions that would have chosen otherwise under the assumptions.
    pub fn turned(&self) -> impl Iterator<Item = (&Replayed, &Decision)> {
        self.decisions.iter().filter_map(|replayed| {
            let assumed = replayed.assumed.as_ref()?.as_ref().ok()?;
            (place(assumed) != place(&replayed.recorded)).then_some((replayed, assumed))
        })
    }
}

/// Where a decision sends the vehicle: the keyframe to revisit, none to explore.
pub fn place(decision: &Decision) -> Option<u64> {
    match decision.action {
        Action::Explore {} => None,
        Action::Revisit { keyframe, .. } => Some(keyframe),
    }
}

/// Folds the journal and decides wherever a decision was recorded. `progress` hears how many records are
/// done.
///
/// # Errors
/// As [`crate::recovery::recover`].
pub fn replay(
    journal: &Journal,
    limits: Limits,
    pool: &ThreadPool,
    assumptions: WhatIf,
    progress: &mut dyn FnMut(u64),
) -> Result<Report, JournalError> {
    let mut asked = asked(journal)?;
    let mut computed = BTreeMap::new();
    let mut recovery = Recovery::new(limits);
    let mut decisions = Vec::new();
    for read in journal.records()? {
        let (number, record) = read?;
        for (decision, request) in asked.remove(&number).unwrap_or_default() {
            let Some(mission) = recovery.mission() else { continue };
            computed.insert(decision, Again::decide(mission, request, assumptions, pool));
        }
        let damaged = |what: String| JournalError::damaged(number, what);
        let entry = Entry::read(&record).map_err(|error| damaged(error.to_string()))?;
        if let Entry::Decided(taken) = &entry {
            let again = taken.decision.decision.and_then(|number| computed.remove(&number));
            let again =
                again.ok_or_else(|| damaged("it rests on records that are not before it".to_owned()))?;
            decisions.push(again.compared((**taken).clone()));
        }
        recovery.take(entry).map_err(damaged)?;
        progress(number + 1);
    }
    let recovered = recovery.finish().ok_or_else(|| JournalError::damaged(0, "there is no record"))?;
    Ok(Report {
        vehicle: recovered.vehicle,
        mission: recovered.mission,
        records: journal.len(),
        decisions,
        refusal_differs: recovered.differs,
    })
}

/// What was asked after how many records: the number of the decision and how it was asked.
type Asked = BTreeMap<u64, Vec<(u64, DecisionRequest)>>;

fn asked(journal: &Journal) -> Result<Asked, JournalError> {
    let mut asked = Asked::new();
    for read in journal.records()? {
        let (number, record) = read?;
        if record.kind != Kind::Decided {
            continue;
        }
        let entry = Entry::read(&record).map_err(|error| JournalError::damaged(number, error.to_string()))?;
        if let Entry::Decided(taken) = entry {
            let DecisionTaken { basis, full, choice_only, decision, .. } = *taken;
            let request = DecisionRequest { what_if: WhatIf::default(), full, choice_only };
            asked.entry(basis).or_default().push((decision.decision.unwrap_or(u64::MAX), request));
        }
    }
    Ok(asked)
}

/// A decision that has been taken again.
struct Again {
    computed: Result<Decision, StateError>,
    assumed: Option<Result<Decision, StateError>>,
}

impl Again {
    fn decide(
        mission: &mut Mission,
        request: DecisionRequest,
        assumptions: WhatIf,
        pool: &ThreadPool,
    ) -> Again {
        let mut decide = |request| {
            let outcome = mission.begin_decision(request)?.run(pool, &|| false)?;
            Ok(Decision { link_model: Some(outcome.link_model), ..outcome.decision })
        };
        let computed = decide(request);
        let what_if = DecisionRequest { what_if: assumptions, full: false, choice_only: false };
        Again { computed, assumed: assumptions.is_any().then(|| decide(what_if)) }
    }

    fn compared(self, taken: DecisionTaken) -> Replayed {
        let DecisionTaken { software, decision: recorded, .. } = taken;
        let verdict = match self.computed {
            Err(error) => Verdict::Failed(error),
            Ok(computed) => difference::compare(&recorded, computed),
        };
        Replayed { recorded, software, verdict, assumed: self.assumed }
    }
}
