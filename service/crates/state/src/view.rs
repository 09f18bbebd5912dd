//! The immutable view of a mission at a moment, which questions rest on.

use crate::error::{StateError, translate};
use crate::relinearization;
use crate::settings::Settings;
use nalgebra::{Matrix6, Vector3};
use pdn_kernel::se3::Pose;
use pdn_kernel::smoother::Smoother;
use pdn_kernel::{Node, SharedVec};
use pdn_planning::{
    Decision, Derived, DerivedCache, Evaluation, LinkModel, OdometryStep, PlanningError, Question, Saliency,
    Snapshot, SnapshotKeyframe, Waypoint,
};
use rayon::ThreadPool;
use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

/// The state at a moment, immutable. Whatever is asked of the graph is asked of its relinearised copy, which
/// the first question makes on its own thread and all others share.
pub struct View {
    moment: Moment,
    relinearized: OnceLock<Result<Relinearized, StateError>>,
}

/// What a fold has come to at a moment.
pub(crate) struct Moment {
    /// By node.
    pub(crate) keyframes: SharedVec<KeyframeInfo>,
    /// Where the robot is.
    pub(crate) newest: Option<Node>,
    /// Pairs of nodes that odometry joins.
    pub(crate) went: Vec<(Node, Node)>,
    /// The odometry into the newest keyframe that has one.
    pub(crate) last_odometry: Option<OdometryStep>,
    /// Count of each kind of factor.
    pub(crate) factors: BTreeMap<&'static str, u64>,
    /// A_cov, m^2.
    pub(crate) covered_m2: f64,
    /// The table of P_L.
    pub(crate) link_model: LinkModel,
    /// The mission's settings.
    pub(crate) settings: Arc<Settings>,
    /// At the linearisation points of the fold.
    pub(crate) smoother: Smoother,
    /// What the views of the mission leave to each other; it changes no bit of an answer.
    pub(crate) cache: DerivedCache,
}

/// What of a keyframe in the graph stays as it is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KeyframeInfo {
    /// Its id.
    pub(crate) id: u64,
    /// Its camera.
    pub(crate) body_from_camera: Pose,
    /// What its image is worth.
    pub(crate) saliency: Saliency,
}

/// The graph with its linearisation points at the estimate.
struct Relinearized {
    snapshot: Snapshot,
    smoother: Smoother,
}

/// The pose graph, to be answered.
pub struct Graph {
    /// In the order of their ids.
    pub keyframes: Vec<EstimatedKeyframe>,
    /// Count of each kind of factor.
    pub factors: BTreeMap<&'static str, u64>,
    /// Sum of the squared, weighed residuals.
    pub chi2: f64,
}

/// A keyframe of the graph.
pub struct EstimatedKeyframe {
    /// Its id.
    pub id: u64,
    /// The estimate of `world_from_body`.
    pub estimate: Pose,
    /// The linearisation point of `world_from_body`.
    pub linearization: Pose,
    /// What its image is worth.
    pub saliency: Saliency,
    /// Its marginal covariance, if it was asked for.
    pub covariance: Option<Matrix6<f64>>,
}

impl std::fmt::Debug for View {
    fn fmt(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(formatter, "View of {} keyframes", self.moment.keyframes.len())
    }
}

impl View {
    /// The view of a moment.
    pub(crate) fn new(moment: Moment) -> View {
        View { moment, relinearized: OnceLock::new() }
    }

    /// The mission's settings.
    pub fn settings(&self) -> &pdn_planning::Settings {
        &self.moment.settings.planning
    }

    /// The table of P_L.
    pub fn link_model(&self) -> &LinkModel {
        &self.moment.link_model
    }

    /// Explore or revisit.
    ///
    /// # Errors
    /// As [`pdn_planning::decide`], told in this crate's errors.
    pub fn decide(
        &self,
        question: &Question,
        pool: &ThreadPool,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Decision, StateError> {
        pdn_planning::decide(&self.relinearized()?.snapshot, question, pool, stop)
            .map_err(|error| self.describe(error))
    }

    /// What paths that a person drew would bring.
    ///
    /// # Errors
    /// As [`pdn_planning::evaluate_paths`], told in this crate's errors.
    pub fn evaluate(
        &self,
        question: &Question,
        paths: &[Vec<Vector3<f64>>],
        pool: &ThreadPool,
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Result<Evaluation, StateError> {
        let evaluated = if *question == Question::default() {
            pdn_planning::evaluate_paths(&self.relinearized()?.snapshot, paths, pool, stop)
        } else {
            let mut settings = self.settings().clone();
            settings.alpha = question.alpha.unwrap_or(settings.alpha);
            settings.allowable = question.allowable.unwrap_or(settings.allowable);
            let assuming = self.snapshot(&self.relinearized()?.smoother, settings);
            pdn_planning::evaluate_paths(&assuming, paths, pool, stop)
        };
        evaluated.map_err(|error| self.describe(error))
    }

    /// The keyframes from id `from` on with the whole graph's chi2. Cost beyond relinearising: with marginals
    /// one recursion over the whole elimination tree.
    ///
    /// # Errors
    /// [`StateError::SingularAnswer`] if the graph cannot be solved.
    pub fn graph(&self, from: u64, marginals: bool) -> Result<Graph, StateError> {
        let Relinearized { snapshot, smoother } = self.relinearized()?;
        let covariances = if marginals && !snapshot.keyframes.is_empty() {
            smoother.elimination().marginals()
        } else {
            Vec::new()
        };
        let nodes = snapshot.keyframes.iter().zip(0_u32..).filter(|(keyframe, _)| keyframe.id >= from);
        let mut keyframes: Vec<EstimatedKeyframe> = nodes
            .map(|(keyframe, node)| EstimatedKeyframe {
                id: keyframe.id,
                estimate: smoother.estimate(Node(node)),
                linearization: keyframe.world_from_body,
                saliency: keyframe.saliency,
                covariance: covariances.get(node as usize).copied(),
            })
            .collect();
        keyframes.sort_by_key(|keyframe| keyframe.id);
        let chi2 = smoother.chi2().map_err(|error| self.describe(error))?;
        Ok(Graph { keyframes, factors: self.moment.factors.clone(), chi2 })
    }

    /// The clusters of salient keyframes.
    ///
    /// # Errors
    /// As [`pdn_planning::waypoints`], told in this crate's errors.
    pub fn waypoints(&self) -> Result<&[Waypoint], StateError> {
        pdn_planning::waypoints(&self.relinearized()?.snapshot).map_err(|error| self.describe(error))
    }

    /// The relinearised graph. Cost: once, moving the linearisation points to the estimate.
    ///
    /// # Errors
    /// [`StateError::SingularAnswer`] if the relinearised graph cannot be solved.
    fn relinearized(&self) -> Result<&Relinearized, StateError> {
        let relinearized = self.relinearized.get_or_init(|| {
            let mut smoother = self.moment.smoother.clone();
            relinearization::relinearize(&mut smoother).map_err(|error| self.describe(error))?;
            let snapshot = self.snapshot(&smoother, self.settings().clone());
            Ok(Relinearized { snapshot, smoother })
        });
        relinearized.as_ref().map_err(StateError::clone)
    }

    /// The state at the linearisation points of `smoother`, with these settings.
    fn snapshot(&self, smoother: &Smoother, settings: pdn_planning::Settings) -> Snapshot {
        let Moment { keyframes, newest, went, last_odometry, covered_m2, link_model, cache, .. } =
            &self.moment;
        let keyframes = keyframes.iter().zip(smoother.linearizations());
        let keyframe = |(info, world_from_body): (&KeyframeInfo, &Pose)| SnapshotKeyframe {
            id: info.id,
            world_from_body: *world_from_body,
            body_from_camera: info.body_from_camera,
            saliency: info.saliency,
        };
        Snapshot {
            keyframes: keyframes.map(keyframe).collect(),
            newest: *newest,
            went: went.clone(),
            elimination: smoother.elimination().clone(),
            last_odometry: *last_odometry,
            covered_m2: *covered_m2,
            target_m2: self.moment.settings.target_m2,
            link_model: link_model.clone(),
            settings,
            derived: Derived::with_cache(cache),
        }
    }

    /// An error of the method by keyframe ids.
    fn describe(&self, error: impl Into<PlanningError>) -> StateError {
        let keyframes = &self.moment.keyframes;
        let id = |node: Node| (node.index() < keyframes.len()).then(|| keyframes[node.index()].id);
        translate::planning(id, error)
    }
}
