//! How a measurement enters the graph, and what it brings along.

use super::{GraphBuilder, Undo};
use crate::change::{Addition, Measurement};
use crate::error::{StateError, translate};
use crate::gate::Admit;
use crate::outcome::Refusal;
use crate::settings::Settings;
use pdn_kernel::se3::Pose;
use pdn_kernel::{Factor, KernelError, Node};
use pdn_planning::OdometryStep;

impl GraphBuilder {
    /// Puts a valid measurement where it belongs: into the graph, bringing a keyframe along if it ties one,
    /// or among those that wait.
    pub(super) fn place(
        &mut self,
        seq: u64,
        measurement: &Measurement,
        settings: &Settings,
        admit: &mut Admit,
        additions: &mut Vec<Addition>,
    ) -> Result<(), StateError> {
        if self.is_placeable(measurement) {
            self.add(seq, measurement, settings, admit, additions)?;
        } else {
            self.deferred.insert(seq, measurement.clone());
            self.undo_log.push(Undo::Deferred(seq));
        }
        let (first, second) = measurement.keyframes();
        for keyframe in [Some(first), second].into_iter().flatten() {
            self.keyframes.entry(keyframe).and_modify(|entry| entry.factors += 1);
            self.undo_log.push(Undo::Named(keyframe));
        }
        Ok(())
    }

    /// Adds what waited for keyframes that are in the graph by now, lowest event first, until nothing more
    /// moves.
    pub(super) fn flush(
        &mut self,
        settings: &Settings,
        admit: &mut Admit,
        additions: &mut Vec<Addition>,
    ) -> Vec<Refusal> {
        let mut refused = Vec::new();
        while let Some(seq) =
            self.deferred.iter().find(|(_, measurement)| self.is_placeable(measurement)).map(|(seq, _)| *seq)
        {
            let Some(measurement) = self.deferred.remove(&seq) else { break };
            if let Err(error) = self.add(seq, &measurement, settings, admit, additions) {
                refused.push(Refusal { seq, error });
            }
            self.undo_log.push(Undo::Resumed(seq, Box::new(measurement)));
        }
        refused
    }

    /// Whether every keyframe of the measurement is in the graph, or will be by this very measurement.
    fn is_placeable(&self, measurement: &Measurement) -> bool {
        let in_graph = |keyframe| self.node(keyframe).is_some();
        match measurement.keyframes() {
            (keyframe, None) => in_graph(keyframe) || measurement.ties_fully(),
            (from, Some(to)) if measurement.ties_fully() => in_graph(from) || in_graph(to),
            (from, Some(to)) => in_graph(from) && in_graph(to),
        }
    }

    fn add(
        &mut self,
        seq: u64,
        measurement: &Measurement,
        settings: &Settings,
        admit: &mut Admit,
        additions: &mut Vec<Addition>,
    ) -> Result<(), StateError> {
        let (first, second) = measurement.keyframes();
        let next = Node(u32::try_from(self.nodes.len()).unwrap_or(u32::MAX));
        let nodes = [first, second.unwrap_or(first)].map(|keyframe| self.node(keyframe).unwrap_or(next));
        let factor = self.factor(measurement, settings, nodes);
        let factor = factor.map_err(|error| translate::measurement(measurement, error))?;
        let entering =
            [Some(first), second].into_iter().flatten().find(|keyframe| self.node(*keyframe).is_none());
        match entering {
            Some(keyframe) => {
                let known = if keyframe == first { nodes[1] } else { nodes[0] };
                let sent = self.keyframes.get(&keyframe).and_then(|entry| entry.world_from_body);
                let known_pose = if known == next { Pose::identity() } else { admit.pose(known, additions) };
                let tied = || factor.pose_of_other(known, &known_pose).unwrap_or(known_pose);
                self.enter(keyframe, sent.unwrap_or_else(tied), additions);
            }
            None => admit.check(seq, measurement, &factor, additions, settings.gate_sigmas)?,
        }
        self.join(measurement, factor, additions);
        Ok(())
    }

    pub(super) fn enter(&mut self, keyframe: u64, world_from_body: Pose, additions: &mut Vec<Addition>) {
        let node = Node(u32::try_from(self.nodes.len()).unwrap_or(u32::MAX));
        self.keyframes.entry(keyframe).and_modify(|entry| entry.node = Some(node));
        self.nodes.push(keyframe);
        self.undo_log.push(Undo::Entered(keyframe, self.newest));
        if self.newest.is_none_or(|newest| self.since_seq(node) > self.since_seq(newest)) {
            self.newest = Some(node);
        }
        additions.push(Addition::Keyframe(world_from_body));
    }

    pub(super) fn join(&mut self, measurement: &Measurement, factor: Factor, additions: &mut Vec<Addition>) {
        *self.factors.entry(factor.kind()).or_insert(0) += 1;
        self.undo_log.push(Undo::Counted(factor.kind()));
        if let (Measurement::Odometry { relative, covariance, .. }, (from, Some(to))) =
            (measurement, factor.nodes())
        {
            self.went.push((from, to));
            self.undo_log.push(Undo::Went);
            if self.last_odometry.is_none_or(|(newest, _)| self.since_seq(to) >= self.since_seq(newest)) {
                self.undo_log.push(Undo::Odometry(Box::new(self.last_odometry)));
                let step = OdometryStep { earlier_from_later: *relative, covariance: *covariance };
                self.last_odometry = Some((to, step));
            }
        }
        additions.push(Addition::Factor(Box::new(factor)));
    }

    pub(super) fn factor(
        &self,
        measurement: &Measurement,
        settings: &Settings,
        nodes: [Node; 2],
    ) -> Result<Factor, KernelError> {
        let (first, second) = measurement.keyframes();
        let camera = |keyframe| {
            self.keyframes.get(&keyframe).map_or(&settings.body_from_camera, |entry| &entry.body_from_camera)
        };
        let cameras = [camera(first), camera(second.unwrap_or(first))];
        measurement.factor(nodes[0], nodes[1], cameras, settings.planning.min_baseline_m, &settings.losses)
    }
}
