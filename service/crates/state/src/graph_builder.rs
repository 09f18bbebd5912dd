//! The keyframes and measurements of a mission, which of them are in the graph and which still wait to be
//! tied to it; every change can be taken back.

use crate::change::{Addition, Change, Measurement, NewKeyframe};
use crate::error::{StateError, translate};
use crate::gate::Admit;
use crate::limits::Limits;
use crate::outcome::Refusal;
use crate::settings::Settings;
use pdn_kernel::se3::Pose;
use pdn_kernel::{Factor, FactorKind, Node};
use pdn_planning::{OdometryStep, Saliency};
use std::collections::BTreeMap;

mod placement;

/// What is known of the keyframes.
#[derive(Clone, Debug, Default)]
pub(crate) struct GraphBuilder {
    pub(crate) keyframes: BTreeMap<u64, KeyframeEntry>,
    /// Ids of the keyframes in the graph; the index is the kernel's node.
    pub(crate) nodes: Vec<u64>,
    /// The keyframe in the graph that was introduced last: where the robot is.
    pub(crate) newest: Option<Node>,
    /// Measurements that name a keyframe outside of the graph, by event.
    pub(crate) deferred: BTreeMap<u64, Measurement>,
    pub(crate) factors: BTreeMap<FactorKind, u64>,
    pub(crate) went: Vec<(Node, Node)>,
    /// The odometry measurement into the newest keyframe that has one, with that keyframe's node.
    pub(crate) last_odometry: Option<(Node, OdometryStep)>,
    undo_log: Vec<Undo>,
}

/// One keyframe.
#[derive(Clone, Debug)]
pub(crate) struct KeyframeEntry {
    since_seq: u64,
    world_from_body: Option<Pose>,
    pub(crate) body_from_camera: Pose,
    pub(crate) saliency: Saliency,
    pub(crate) node: Option<Node>,
    factors: usize,
}

#[derive(Clone, Debug)]
enum Undo {
    Introduced(u64),
    Named(u64),
    Entered(u64, Option<Node>),
    Deferred(u64),
    Resumed(u64, Box<Measurement>),
    Counted(FactorKind),
    Went,
    Odometry(Box<Option<(Node, OdometryStep)>>),
}

impl GraphBuilder {
    /// Notes what a keyframe or measurement says. What enters the graph is appended to `additions`;
    /// measurements that waited and are refused now that their keyframes have entered are returned.
    ///
    /// # Errors
    /// Why the change is refused; nothing has changed then.
    pub(crate) fn note(
        &mut self,
        seq: u64,
        change: &Change,
        settings: &Settings,
        limits: &Limits,
        admit: &mut Admit,
        additions: &mut Vec<Addition>,
    ) -> Result<Vec<Refusal>, StateError> {
        match change {
            Change::Keyframe(keyframe) => {
                self.introduce(seq, keyframe, settings, limits, additions)?;
                Ok(Vec::new())
            }
            Change::Measurement(measurement) => {
                self.check_names(measurement, limits)?;
                let rehearsal = self.factor(measurement, settings, [Node(0), Node(1)]);
                rehearsal.map_err(|error| translate::measurement(measurement, error))?;
                self.place(seq, measurement, settings, admit, additions)?;
                Ok(self.flush(settings, admit, additions))
            }
            Change::Link { .. } => Ok(Vec::new()),
        }
    }

    /// Everything noted up to here is final.
    pub(crate) fn commit(&mut self) {
        self.undo_log.clear();
    }

    /// Takes back everything that was noted since the last [`GraphBuilder::commit`].
    pub(crate) fn undo(&mut self) {
        while let Some(step) = self.undo_log.pop() {
            match step {
                Undo::Introduced(id) => {
                    self.keyframes.remove(&id);
                }
                Undo::Named(id) => {
                    self.keyframes.entry(id).and_modify(|entry| entry.factors -= 1);
                }
                Undo::Entered(id, newest) => {
                    self.keyframes.entry(id).and_modify(|entry| entry.node = None);
                    self.nodes.pop();
                    self.newest = newest;
                }
                Undo::Deferred(seq) => {
                    self.deferred.remove(&seq);
                }
                Undo::Resumed(seq, measurement) => {
                    self.deferred.insert(seq, *measurement);
                }
                Undo::Counted(kind) => {
                    self.factors.entry(kind).and_modify(|count| *count -= 1);
                }
                Undo::Went => {
                    self.went.pop();
                }
                Undo::Odometry(before) => self.last_odometry = *before,
            }
        }
    }

    /// Whether a keyframe of that id can be introduced.
    ///
    /// # Errors
    /// [`StateError::RepeatedKeyframe`], [`StateError::Limit`].
    pub(crate) fn check_new(&self, keyframe: u64, limits: &Limits) -> Result<(), StateError> {
        if let Some(known) = self.keyframes.get(&keyframe) {
            return Err(StateError::RepeatedKeyframe { keyframe, since_seq: known.since_seq });
        }
        if self.keyframes.len() >= limits.max_keyframes {
            return Err(StateError::Limit {
                what: "keyframes of the mission",
                bound: "max_keyframes",
                limit: limits.max_keyframes as u64,
                advice: "complete this mission and configure another",
            });
        }
        Ok(())
    }

    fn introduce(
        &mut self,
        seq: u64,
        keyframe: &NewKeyframe,
        settings: &Settings,
        limits: &Limits,
        additions: &mut Vec<Addition>,
    ) -> Result<(), StateError> {
        self.check_new(keyframe.id, limits)?;
        let prior = self.first_prior(keyframe, settings)?;
        let entry = KeyframeEntry {
            since_seq: seq,
            world_from_body: keyframe.world_from_body,
            body_from_camera: keyframe.body_from_camera.unwrap_or(settings.body_from_camera),
            saliency: keyframe.saliency,
            node: None,
            factors: 0,
        };
        self.keyframes.insert(keyframe.id, entry);
        self.undo_log.push(Undo::Introduced(keyframe.id));
        if let Some((measurement, pose, factor)) = prior {
            self.enter(keyframe.id, pose, additions);
            self.join(&measurement, factor, additions);
        }
        Ok(())
    }

    /// The configuration's prior on the very first keyframe, at the pose that its event carries.
    fn first_prior(
        &self,
        keyframe: &NewKeyframe,
        settings: &Settings,
    ) -> Result<Option<(Measurement, Pose, Factor)>, StateError> {
        let (true, Some(pose), Some(covariance)) =
            (self.keyframes.is_empty(), keyframe.world_from_body, settings.first_keyframe_covariance)
        else {
            return Ok(None);
        };
        let prior = Measurement::Prior { keyframe: keyframe.id, world_from_body: pose, covariance };
        let factor = self.factor(&prior, settings, [Node(0), Node(1)]);
        let factor = factor.map_err(|error| translate::measurement(&prior, error))?;
        Ok(Some((prior, pose, factor)))
    }

    fn check_names(&self, measurement: &Measurement, limits: &Limits) -> Result<(), StateError> {
        let field = |name| format!("factor.{}.{name}", measurement.kind().name());
        let (first, second) = measurement.keyframes();
        let names = if second.is_some() { ["from", "to"] } else { ["keyframe", ""] };
        for (keyframe, name) in [Some(first), second].into_iter().zip(names) {
            let Some(keyframe) = keyframe else { continue };
            let unknown = || StateError::UnknownKeyframe { field: field(name), keyframe };
            if self.keyframes.get(&keyframe).ok_or_else(unknown)?.factors >= limits.max_factors_per_keyframe {
                return Err(StateError::Limit {
                    what: "factors that name one keyframe",
                    bound: "max_factors_per_keyframe",
                    limit: limits.max_factors_per_keyframe as u64,
                    advice: "leave further factors of this keyframe out",
                });
            }
        }
        if Some(first) == second {
            let problem =
                format!("from and to are both keyframe {first}; send a factor of two different keyframes");
            return Err(StateError::Invalid { field: field("to"), problem });
        }
        if self.factors_in_graph() + self.deferred.len() as u64 >= limits.max_factors as u64 {
            return Err(StateError::Limit {
                what: "factors of the mission",
                bound: "max_factors",
                limit: limits.max_factors as u64,
                advice: "complete this mission and configure another",
            });
        }
        Ok(())
    }

    pub(crate) fn node(&self, keyframe: u64) -> Option<Node> {
        self.keyframes.get(&keyframe).and_then(|entry| entry.node)
    }

    /// The event that introduced the keyframe of a node; none of a node that is not in the graph.
    fn since_seq(&self, node: Node) -> Option<u64> {
        let keyframe = self.nodes.get(node.index())?;
        self.keyframes.get(keyframe).map(|entry| entry.since_seq)
    }

    pub(crate) fn factors_in_graph(&self) -> u64 {
        self.factors.values().sum()
    }

    /// Keyframes outside of the graph, but for the one introduced last, whose ties may be on their way.
    pub(crate) fn untied(&self) -> Vec<u64> {
        let newest = self.keyframes.values().map(|entry| entry.since_seq).max();
        let waits = |entry: &KeyframeEntry| entry.node.is_none() && Some(entry.since_seq) != newest;
        self.keyframes.iter().filter(|(_, entry)| waits(entry)).map(|(id, _)| *id).collect()
    }
}
