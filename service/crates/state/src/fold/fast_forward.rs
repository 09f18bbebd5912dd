//! The fold of events whose outcome is known up to a checkpoint: nothing is solved for, and what was refused
//! then is refused now.
//!
//! Refusals of a group may stand in the history after the keyframe that ended it. So a group is noted only
//! once the next entry has come that is no refusal; until then it waits here.

use super::{Fold, SolvedState};
use crate::change::{Addition, Change};
use crate::gate::Admit;
use crate::outcome::Refusal;
use pdn_kernel::smoother::Smoother;
use std::collections::BTreeSet;

/// What has been read since the beginning of the history.
#[derive(Clone, Debug, Default)]
pub(crate) struct FastForward {
    /// The group that the last keyframe ended, and the one that it began.
    closing: Vec<(u64, Change)>,
    current: Vec<(u64, Change)>,
    additions: Vec<Addition>,
    refused: BTreeSet<u64>,
}

impl FastForward {
    /// An event that the history says was refused.
    pub(crate) fn refuse(&mut self, seq: u64) {
        self.refused.insert(seq);
    }
}

impl Fold {
    /// Event number of the first change of the present group.
    pub(crate) fn group_seq(&self) -> Option<u64> {
        self.group.changes.first().map(|(seq, _)| *seq)
    }

    /// What must be kept of the state before the present group; none if that cannot be kept. Cost: a copy.
    pub(crate) fn solved_state(&self) -> Option<SolvedState> {
        let mut before = self.clone();
        before.roll_back();
        Some(SolvedState {
            smoother: before.smoother.state()?,
            converged: before.converged,
            progress: before.progress,
            world_from_camera: before.coverage.cameras(),
        })
    }

    /// Takes an event of the history before the checkpoint.
    pub(crate) fn fast_forward(&mut self, forward: &mut FastForward, seq: u64, change: Change) {
        self.note_closed(forward);
        match &change {
            Change::Keyframe(keyframe) => {
                let is_new = |(seq, change): &(u64, Change)| match change {
                    Change::Keyframe(other) => other.id != keyframe.id || forward.refused.contains(seq),
                    _ => true,
                };
                if self.builder.check_new(keyframe.id, &self.limits).is_ok()
                    && forward.current.iter().all(is_new)
                {
                    forward.closing = std::mem::take(&mut forward.current);
                }
                forward.current.push((seq, change));
            }
            Change::Measurement(_) | Change::Link { .. } => forward.current.push((seq, change)),
        }
    }

    /// Arrives at the checkpoint, which stands before the last event taken; from here on the fold goes on as
    /// usual.
    ///
    /// # Errors
    /// What does not fit.
    pub(crate) fn finish_fast_forward(
        &mut self,
        mut forward: FastForward,
        solved: SolvedState,
    ) -> Result<Vec<Refusal>, String> {
        self.note_closed(&mut forward);
        let [(seq, change)] = <[_; 1]>::try_from(forward.current)
            .map_err(|current| format!("it stands before {} events", current.len()))?;
        let SolvedState { smoother, converged, progress, world_from_camera } = solved;
        let nodes = self.builder.nodes.len();
        if smoother.linearizations.len() != nodes || world_from_camera.len() != nodes {
            return Err(format!("the journal has {nodes} keyframes in the graph by then"));
        }
        let factors = forward.additions.into_iter().filter_map(|addition| match addition {
            Addition::Factor(factor) => Some(*factor),
            Addition::Keyframe(_) => None,
        });
        self.smoother = Smoother::restore(self.smoother.settings(), smoother, factors)
            .map_err(|error| error.to_string())?;
        self.converged = converged;
        self.progress = progress;
        let builder = &self.builder;
        self.coverage.restore(world_from_camera, |node| builder.nodes[node]);
        Ok(self.apply(seq, change))
    }

    /// Notes the group that has ended, now that all that was refused of it is known.
    fn note_closed(&mut self, forward: &mut FastForward) {
        for (seq, change) in std::mem::take(&mut forward.closing) {
            if forward.refused.contains(&seq) {
                continue;
            }
            // What was taken then is taken now; else the counts at the checkpoint will not fit.
            if let Change::Link { from, to, registered } = change {
                let _ = self.learn(from, to, registered);
                continue;
            }
            let mut admit = Admit::History(&forward.refused);
            let additions = &mut forward.additions;
            let _ = self.builder.note(seq, &change, &self.settings, &self.limits, &mut admit, additions);
        }
        self.builder.commit();
    }
}
