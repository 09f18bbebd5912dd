//! The state at a moment: what is told of it, and the immutable view that questions rest on.

use crate::convert;
use crate::error::StateError;
use crate::fold::Fold;
use crate::relinearization::relinearize;
use crate::settings::Settings;
use nalgebra::{Matrix6, Vector3};
use pdn_kernel::se3::Pose;
use pdn_kernel::smoother::Smoother;
use pdn_kernel::{Node, SharedVec, gaussian};
use pdn_planning::{
    Coverage, Decision, Derived, DerivedCache, Evaluation, LinkModel, OdometryStep, PlanningError, Question,
    Saliency, Snapshot, SnapshotKeyframe,
};
use rayon::ThreadPool;
use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

/// The state at a moment, immutable. Whatever is asked of the graph is asked of its relinearised copy, which the first
/// question makes on its own thread and all others share.
pub struct View {
    keyframes: SharedVec<KeyframeInfo>,
    newest: Option<Node>,
    went: Vec<(Node, Node)>,
    last_odometry: Option<OdometryStep>,
    covered_m2: f64,
    link_model: LinkModel,
    settings: Arc<Settings>,
    /// At the linearisation points of the fold.
    smoother: Smoother,
    /// What the views of the mission leave to each other; it changes no bit of what is told.
    cache: DerivedCache,
    relinearized: OnceLock<Result<Relinearized, StateError>>,
    /// Count of each kind of factor.
    pub factors: BTreeMap<&'static str, u64>,
}

/// What of a keyframe in the graph stays as it is, by node.
#[derive(Clone, Copy, Debug)]
pub(crate) struct KeyframeInfo {
    id: u64,
    body_from_camera: Pose,
    saliency: Saliency,
}

/// The graph with its linearisation points at the estimate.
pub struct Relinearized {
    /// What decisions rest on.
    pub snapshot: Snapshot,
    /// The smoother, for estimates, marginals and chi2.
    pub smoother: Smoother,
}

/// The newest keyframe as it is estimated now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobotNow {
    /// Its id.
    pub keyframe: u64,
    /// The estimate of `world_from_body`.
    pub pose: Pose,
    /// Its marginal covariance.
    pub covariance: Matrix6<f64>,
    /// (|Sigma_rr| / |Sigma_allow|)^(1/6).
    pub uncertainty: f64,
}

impl std::fmt::Debug for View {
    fn fmt(&self, formatter: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(formatter, "View of {} keyframes", self.keyframes.len())
    }
}

impl View {
    fn of(fold: &Fold) -> View {
        let factors = fold.builder.factors.iter().map(|(kind, count)| (kind.name(), *count));
        let mut keyframes = fold.known.clone();
        fold.know(&mut keyframes, fold.builder.nodes.len());
        View {
            keyframes,
            newest: fold.builder.newest,
            went: fold.builder.went.clone(),
            last_odometry: fold.builder.last_odometry.map(|(_, step)| step),
            covered_m2: fold.coverage.coverage().covered_m2(),
            link_model: fold.link_model.clone(),
            settings: Arc::clone(&fold.settings),
            smoother: fold.smoother.clone(),
            cache: fold.cache.clone(),
            relinearized: OnceLock::new(),
            factors: factors.collect(),
        }
    }

    /// The mission's settings.
    pub fn settings(&self) -> &pdn_planning::Settings {
        &self.settings.planning
    }

    /// The table of P_L.
    pub fn link_model(&self) -> &LinkModel {
        &self.link_model
    }

    /// The relinearised graph. Cost: once, moving the linearisation points to the estimate.
    ///
    /// # Errors
    /// [`StateError::Singular`] if the relinearised graph cannot be solved.
    pub fn relinearized(&self) -> Result<&Relinearized, StateError> {
        let relinearized = self.relinearized.get_or_init(|| {
            let mut smoother = self.smoother.clone();
            relinearize(&mut smoother).map_err(|error| self.describe(error))?;
            let snapshot = self.snapshot(&smoother, self.settings().clone());
            Ok(Relinearized { snapshot, smoother })
        });
        relinearized.as_ref().map_err(StateError::clone)
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

    /// An error of the method by keyframe ids.
    pub fn describe(&self, error: impl Into<PlanningError>) -> StateError {
        let id = |node: Node| (node.index() < self.keyframes.len()).then(|| self.keyframes[node.index()].id);
        convert::error::planning(id, error)
    }

    /// The state at the linearisation points of `smoother`, with these settings.
    fn snapshot(&self, smoother: &Smoother, settings: pdn_planning::Settings) -> Snapshot {
        let keyframes = self.keyframes.iter().zip(smoother.linearizations());
        let keyframe = |(known, world_from_body): (&KeyframeInfo, &Pose)| SnapshotKeyframe {
            id: known.id,
            world_from_body: *world_from_body,
            body_from_camera: known.body_from_camera,
            saliency: known.saliency,
        };
        Snapshot {
            keyframes: keyframes.map(keyframe).collect(),
            newest: self.newest,
            went: self.went.clone(),
            elimination: smoother.elimination().clone(),
            last_odometry: self.last_odometry,
            covered_m2: self.covered_m2,
            target_m2: self.settings.target_m2,
            link_model: self.link_model.clone(),
            settings,
            derived: Derived::with_cache(&self.cache),
        }
    }
}

impl Fold {
    /// The state as it stands, shared by all questions until the next event changes it. Cost: solving for what has not
    /// been solved for, and once a change a copy of what shares nothing.
    pub fn view(&mut self) -> Arc<View> {
        self.look_ahead();
        if let Some(view) = &self.view {
            return Arc::clone(view);
        }
        let mut known = std::mem::take(&mut self.known);
        self.know(&mut known, self.nodes_before_group());
        self.known = known;
        let view = Arc::new(View::of(self.lookahead()));
        self.view = Some(Arc::clone(&view));
        view
    }

    /// The newest keyframe; none before the first is in the graph. Cost beyond solving: one marginal.
    ///
    /// # Errors
    /// [`StateError::Singular`] if its marginal cannot be computed.
    pub fn robot(&mut self) -> Result<Option<RobotNow>, StateError> {
        self.look_ahead();
        if self.robot.is_none() {
            self.robot = self.lookahead().look_at_robot()?;
        }
        Ok(self.robot)
    }

    /// Keyframes in the graph.
    pub fn keyframes_in_graph(&mut self) -> usize {
        self.look_ahead();
        self.lookahead().smoother.len()
    }

    /// Factors in the graph, the prior of the configuration included.
    pub fn factors_in_graph(&mut self) -> u64 {
        self.look_ahead();
        self.lookahead().builder.factors_in_graph()
    }

    /// The rasters.
    pub fn coverage(&mut self) -> &Coverage {
        self.look_ahead();
        self.lookahead().coverage.coverage()
    }

    /// A_target, m^2.
    pub fn target_m2(&self) -> f64 {
        self.settings.target_m2
    }

    /// The table of P_L.
    pub fn link_model(&self) -> &LinkModel {
        &self.link_model
    }

    /// Length of the survey still ahead, m; none without a survey.
    pub fn survey_remaining_m(&mut self) -> Option<f64> {
        self.look_ahead();
        let survey = self.settings.survey.as_ref()?;
        Some(survey.length_m() - self.lookahead().progress.done_m)
    }

    /// What keeps decisions from resting on the graph, one sentence each.
    pub fn findings(&mut self) -> Vec<String> {
        self.look_ahead();
        let fold = self.lookahead();
        let mut findings = Vec::new();
        let untied = fold.builder.untied();
        if let Some(first) = untied.first() {
            let count = untied.len();
            findings.push(format!(
                "{count} keyframes wait for a prior, odometry or relative factor that ties them to the graph, \
                 keyframe {first} first"
            ));
        }
        if fold.smoother.is_empty() {
            let wanted = if fold.settings.first_keyframe_covariance.is_some() {
                "send a keyframe with a pose"
            } else {
                "send a keyframe and a prior factor of it"
            };
            findings.push(format!("the graph has no keyframe yet: {wanted}"));
        }
        if !fold.converged {
            findings.push("the estimate has not settled yet; it goes on with the next events".to_string());
        }
        findings
    }

    /// Adds what stays of the keyframes up to a node, exclusive.
    fn know(&self, known: &mut SharedVec<KeyframeInfo>, nodes: usize) {
        for &id in self.builder.nodes.get(known.len()..nodes).unwrap_or_default() {
            let keyframe = &self.builder.keyframes[&id];
            known.push(KeyframeInfo { id, body_from_camera: keyframe.body_from_camera, saliency: keyframe.saliency });
        }
    }

    fn look_at_robot(&self) -> Result<Option<RobotNow>, StateError> {
        let Some(node) = self.builder.newest else { return Ok(None) };
        let describe = |error| convert::error::unsolvable(&self.builder.nodes, error);
        let covariance = self.smoother.marginal(node).map_err(describe)?;
        let excess = gaussian::log_determinant(&covariance).map_err(describe)?
            - self.settings.planning.allowable.log_determinant();
        Ok(Some(RobotNow {
            keyframe: self.builder.nodes[node.index()],
            pose: self.smoother.estimate(node),
            covariance,
            uncertainty: (excess / 6.0).exp(),
        }))
    }
}
