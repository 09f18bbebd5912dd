//! What is asked of a fold: each answer looks ahead first, and changes no later bit.

use super::Fold;
use crate::error::{StateError, translate};
use crate::findings;
use crate::settings::Settings;
use crate::view::{KeyframeInfo, Moment, View};
use nalgebra::Matrix6;
use pdn_kernel::se3::Pose;
use pdn_kernel::{FactorKind, Node, SharedVec, gaussian};
use pdn_planning::{Coverage, LinkModel};
use std::sync::Arc;

/// The newest keyframe as it is estimated now.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RobotEstimate {
    /// Its id.
    pub keyframe: u64,
    /// The estimate of `world_from_body`.
    pub pose: Pose,
    /// Its marginal covariance.
    pub covariance: Matrix6<f64>,
    /// (|Sigma_rr| / |Sigma_allow|)^(1/6).
    pub uncertainty: f64,
}

impl Fold {
    /// The state as it stands, shared by all questions until the next event changes it. Cost: solving for
    /// what has not been solved for, and once a change a copy of what shares nothing.
    pub fn view(&mut self) -> Arc<View> {
        self.look_ahead();
        if let Some(view) = &self.view {
            return Arc::clone(view);
        }
        let mut infos = std::mem::take(&mut self.keyframe_infos);
        self.extend_infos(&mut infos, self.nodes_before_group());
        self.keyframe_infos = infos;
        let view = Arc::new(View::new(self.lookahead().moment()));
        self.view = Some(Arc::clone(&view));
        view
    }

    /// The newest keyframe; none before the first is in the graph. Cost beyond solving: one marginal.
    ///
    /// # Errors
    /// [`StateError::SingularAnswer`] if its marginal cannot be computed.
    pub fn robot(&mut self) -> Result<Option<RobotEstimate>, StateError> {
        self.look_ahead();
        if self.robot.is_none() {
            self.robot = self.lookahead().estimate_robot()?;
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
                "{count} keyframes wait for a prior, odometry or relative factor that ties them to the \
                 graph, keyframe {first} first"
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

    /// What of the area and the registrations does not fit; cost: see [`crate::findings`].
    pub(crate) fn misfits(&mut self) -> Vec<String> {
        self.look_ahead();
        let fold = self.lookahead();
        let covered_m2 = fold.coverage.coverage().covered_m2();
        let keyframes = fold.builder.nodes.len();
        let measured = [FactorKind::Camera, FactorKind::Relative].iter();
        let measured = measured.filter_map(|kind| fold.builder.factors.get(kind)).sum();
        let nothing = (keyframes >= findings::MIN_KEYFRAMES && covered_m2 == 0.0).then(|| {
            let Settings { facets, view, .. } = &*fold.settings;
            findings::uncovered(keyframes, &fold.last_cameras(findings::LOOKED_AT), facets, view)
        });
        let more = findings::more_than_all(covered_m2, fold.settings.target_m2);
        let registrations = findings::registrations(&fold.link_model, measured);
        [nothing, more, registrations].into_iter().flatten().collect()
    }

    /// A keyframe's pose as it is estimated now, of those in the graph. To be asked after a question that
    /// looks ahead.
    pub(crate) fn estimate(&self, keyframe: u64) -> Option<Pose> {
        let fold = self.lookahead();
        fold.builder
            .node(keyframe)
            .filter(|node| node.index() < fold.smoother.len())
            .map(|node| fold.smoother.estimate(node))
    }

    /// The world_from_camera of the last keyframes that entered the graph.
    fn last_cameras(&self, count: usize) -> Vec<Pose> {
        let nodes = self.smoother.len().saturating_sub(count)..self.smoother.len();
        let camera = |node: usize| {
            let body_from_camera = self.builder.keyframes[&self.builder.nodes[node]].body_from_camera;
            self.smoother.estimate(Node(node as u32)) * body_from_camera
        };
        nodes.map(camera).collect()
    }

    /// The mission's settings.
    pub(crate) fn settings(&self) -> &Settings {
        &self.settings
    }

    /// What a view shows of this fold.
    fn moment(&self) -> Moment {
        let factors = self.builder.factors.iter().map(|(kind, count)| (kind.name(), *count));
        let mut keyframes = self.keyframe_infos.clone();
        self.extend_infos(&mut keyframes, self.builder.nodes.len());
        Moment {
            keyframes,
            newest: self.builder.newest,
            went: self.builder.went.clone(),
            last_odometry: self.builder.last_odometry.map(|(_, step)| step),
            factors: factors.collect(),
            covered_m2: self.coverage.coverage().covered_m2(),
            link_model: self.link_model.clone(),
            settings: Arc::clone(&self.settings),
            smoother: self.smoother.clone(),
            cache: self.cache.clone(),
        }
    }

    /// Adds what stays of the keyframes up to a node, exclusive.
    fn extend_infos(&self, infos: &mut SharedVec<KeyframeInfo>, nodes: usize) {
        for &id in self.builder.nodes.get(infos.len()..nodes).unwrap_or_default() {
            let keyframe = &self.builder.keyframes[&id];
            infos.push(KeyframeInfo {
                id,
                body_from_camera: keyframe.body_from_camera,
                saliency: keyframe.saliency,
            });
        }
    }

    fn estimate_robot(&self) -> Result<Option<RobotEstimate>, StateError> {
        let Some(node) = self.builder.newest else { return Ok(None) };
        let id = |node: Node| self.builder.nodes.get(node.index()).copied();
        let describe = |error| translate::uncomputable(id, error);
        let covariance = self.smoother.marginal(node).map_err(describe)?;
        let excess = gaussian::log_determinant(&covariance).map_err(describe)?
            - self.settings.planning.allowable.log_determinant();
        Ok(Some(RobotEstimate {
            keyframe: self.builder.nodes[node.index()],
            pose: self.smoother.estimate(node),
            covariance,
            uncertainty: (excess / 6.0).exp(),
        }))
    }
}
