//! What events add up to: the pose graph, the area that is covered, the table of P_L, the survey's progress.
//!
//! A keyframe enters the graph once a prior, odometry or relative factor ties it to the graph in all six
//! degrees of freedom, or as the first one with the prior of the configuration; until then it and what else
//! names it wait. So the graph determines every pose.
//!
//! Factors collect until the next keyframe's event: they are a group, and the smoother advances once a group,
//! not once a factor. A question in the middle of a group looks ahead: it solves for the group so far and
//! keeps what leads back (`Rollback`), which is taken if the group goes on. So questions never change a later
//! bit.

mod fast_forward;
mod queries;
mod solved;

pub(crate) use fast_forward::FastForward;
pub(crate) use solved::SolvedState;

use crate::change::{Addition, Change};
use crate::coverage_tracker::{CoverageTracker, MovedCameras};
use crate::error::{StateError, translate};
use crate::gate::{Admit, Gate};
use crate::graph_builder::GraphBuilder;
use crate::limits::Limits;
use crate::outcome::Refusal;
use crate::relinearization;
use crate::settings::Settings;
use crate::survey::Progress;
use crate::view::{KeyframeInfo, View};
use pdn_kernel::smoother::{Smoother, SmootherSettings};
use pdn_kernel::{KernelError, SharedVec};
use pdn_planning::{DerivedCache, LinkModel};
use queries::RobotEstimate;
use std::collections::BTreeSet;
use std::sync::Arc;

/// Between relinearisations of the whole graph a keyframe is linearised anew once its step exceeds this, m
/// and rad: a loop closure that moves the whole graph by less costs one path to the root.
const STREAM_TOLERANCE: f64 = 2e-2;

/// Gauss-Newton steps that one group gets at most between relinearisations of the whole graph; what is left
/// goes on with the next group.
const STREAM_ITERATIONS: usize = 3;

/// The state of a mission as far as it follows from events.
#[derive(Clone, Debug)]
pub struct Fold {
    settings: Arc<Settings>,
    limits: Limits,
    builder: GraphBuilder,
    link_model: LinkModel,
    smoother: Smoother,
    converged: bool,
    coverage: CoverageTracker,
    progress: Progress,
    group: Group,
    /// What leads back to before the group, once it has been solved for.
    rollback: Option<Rollback>,
    /// What the fold will be after a group that cannot be solved for as a whole.
    repaired: Option<Box<Fold>>,
    late: Vec<Refusal>,
    robot: Option<RobotEstimate>,
    view: Option<Arc<View>>,
    /// What views tell of keyframes that were in the graph before the group, as far as one has been taken
    /// since.
    keyframe_infos: SharedVec<KeyframeInfo>,
    /// What its views derive and leave to later ones.
    cache: DerivedCache,
}

/// What came since the last keyframe's event, that one included.
#[derive(Clone, Debug, Default)]
struct Group {
    changes: Vec<(u64, Change)>,
    additions: Vec<Addition>,
    gate: Gate,
    refused: BTreeSet<u64>,
}

#[derive(Clone, Debug)]
struct Rollback {
    smoother: Smoother,
    converged: bool,
    progress: Progress,
    moved: MovedCameras,
}

impl Fold {
    /// The state before the first event.
    pub fn new(settings: Settings, limits: Limits) -> Fold {
        Fold {
            limits,
            builder: GraphBuilder::default(),
            link_model: settings.link_model.clone(),
            smoother: Smoother::new(SmootherSettings {
                relinearize_above: STREAM_TOLERANCE,
                max_iterations: STREAM_ITERATIONS,
            }),
            converged: true,
            coverage: CoverageTracker::new(settings.coverage.clone()),
            progress: Progress::default(),
            group: Group::default(),
            rollback: None,
            repaired: None,
            late: Vec::new(),
            robot: None,
            view: None,
            keyframe_infos: SharedVec::default(),
            cache: DerivedCache::default(),
            settings: Arc::new(settings),
        }
    }

    /// Applies a change. Returns what is refused: this event (nothing has changed then), or earlier ones that
    /// could only be judged now. Cost: that of solving for the last group if a keyframe begins a new one,
    /// else of looking up what is named.
    pub fn apply(&mut self, seq: u64, change: Change) -> Vec<Refusal> {
        let mut refused = Vec::new();
        let result = match change {
            Change::Link { from, to, registered } => self.learn(from, to, registered),
            Change::Keyframe(ref keyframe) => match self.builder.check_new(keyframe.id, &self.limits) {
                Ok(()) => {
                    refused = self.close();
                    self.note(seq, change).map(|late| refused.extend(late))
                }
                refusal => refusal, // what is refused ends no group
            },
            Change::Measurement(_) => self.note(seq, change).map(|late| refused.extend(late)),
        };
        refused.extend(result.err().map(|error| Refusal { seq, error }));
        refused
    }

    /// Solves for everything that has come, so that what follows answers at once. Changes no later bit.
    pub fn look_ahead(&mut self) {
        if self.rollback.is_some() || self.repaired.is_some() || self.group.changes.is_empty() {
            return;
        }
        if self.solve().is_err() {
            let mut repaired = self.clone();
            repaired.repair();
            self.repaired = Some(Box::new(repaired));
        }
    }

    fn learn(&mut self, from: u64, to: u64, registered: bool) -> Result<(), StateError> {
        let saliency = |name: &str, keyframe| {
            let unknown = || StateError::UnknownKeyframe { field: format!("link.{name}"), keyframe };
            Ok(self.builder.keyframes.get(&keyframe).ok_or_else(unknown)?.saliency.local)
        };
        let pair = (saliency("from", from)?, saliency("to", to)?);
        if from == to {
            let problem =
                format!("from and to are both keyframe {from}; send a link of two different keyframes");
            return Err(StateError::Invalid { field: "link.to".to_string(), problem });
        }
        self.link_model.record(pair.0, pair.1, registered);
        self.repaired = None;
        self.view = None;
        Ok(())
    }

    fn note(&mut self, seq: u64, change: Change) -> Result<Vec<Refusal>, StateError> {
        self.roll_back();
        let Group { additions, gate, .. } = &mut self.group;
        let mut admit = Admit::Belief(&self.smoother, gate);
        let mut late =
            self.builder.note(seq, &change, &self.settings, &self.limits, &mut admit, additions)?;
        late.retain(|refusal| self.group.refused.insert(refusal.seq));
        self.group.changes.push((seq, change));
        (self.robot, self.view) = (None, None);
        Ok(late)
    }

    /// Ends the group; returns the events of it that had to be undone.
    fn close(&mut self) -> Vec<Refusal> {
        self.look_ahead();
        if let Some(repaired) = self.repaired.take() {
            *self = *repaired;
        }
        self.commit();
        std::mem::take(&mut self.late)
    }

    fn commit(&mut self) {
        self.rollback = None;
        self.group = Group::default();
        self.builder.commit();
    }

    /// Takes the group again change by change and leaves out those that the graph cannot be solved with.
    fn repair(&mut self) {
        self.builder.undo();
        let group = std::mem::take(&mut self.group);
        // What waited and was refused by the group stays refused.
        self.builder.deferred.retain(|seq, _| !group.refused.contains(seq));
        let mut reported = group.refused;
        for (seq, change) in group.changes {
            let mut refused = Vec::new();
            match self.note(seq, change) {
                Err(error) => refused.push(Refusal { seq, error }),
                Ok(late) => {
                    refused.extend(late);
                    if let Err(error) = self.solve() {
                        // The keyframe may be one that enters with this very change.
                        let error = translate::unsolvable(&self.builder.nodes, error);
                        self.builder.undo();
                        refused.push(Refusal { seq, error });
                    }
                }
            }
            self.commit();
            refused.retain(|refusal| reported.insert(refusal.seq));
            self.late.extend(refused);
        }
    }

    /// Advances the smoother over the group, and keeps what leads back.
    fn solve(&mut self) -> Result<(), KernelError> {
        let mut advanced = self.smoother.clone();
        let mut converged = self.converged;
        for addition in &self.group.additions {
            match addition {
                Addition::Keyframe(pose) => drop(advanced.add_keyframe(*pose)),
                Addition::Factor(factor) => advanced.add_factor((**factor).clone())?,
            }
        }
        if !self.group.additions.is_empty() {
            advanced.advance()?;
            converged = true;
            if relinearization::is_due(advanced.len()) && advanced.len() > self.smoother.len() {
                converged = relinearization::relinearize(&mut advanced)?;
            }
        }
        let mut rollback = Rollback {
            smoother: std::mem::replace(&mut self.smoother, advanced),
            converged: std::mem::replace(&mut self.converged, converged),
            progress: self.progress,
            moved: MovedCameras::default(),
        };
        let (builder, moved) = (&self.builder, self.smoother.take_moved());
        rollback.moved = self.coverage.follow(self.smoother.linearizations(), &moved, |node| {
            let keyframe = builder.nodes[node];
            (keyframe, builder.keyframes[&keyframe].body_from_camera)
        });
        if let (Some(survey), Some(robot)) = (&self.settings.survey, self.builder.newest) {
            self.progress = survey.advance(self.progress, self.smoother.estimate(robot).translation.vector);
        }
        self.rollback = Some(rollback);
        Ok(())
    }

    /// This, or what it will be once the group is repaired. To be called after [`Fold::look_ahead`].
    fn lookahead(&self) -> &Fold {
        self.repaired.as_deref().unwrap_or(self)
    }

    /// Keyframes that were in the graph before the group, and stay whatever becomes of it.
    fn nodes_before_group(&self) -> usize {
        self.rollback.as_ref().map_or(&self.smoother, |rollback| &rollback.smoother).len()
    }

    /// Undoes [`Fold::look_ahead`].
    fn roll_back(&mut self) {
        self.repaired = None;
        let Some(rollback) = self.rollback.take() else { return };
        self.coverage.roll_back(rollback.moved);
        (self.smoother, self.converged, self.progress) =
            (rollback.smoother, rollback.converged, rollback.progress);
    }
}
