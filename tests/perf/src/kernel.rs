//! Every call of the kernel that is measured. What follows a change of the kernel's interface is in this file
//! alone.

use nalgebra::{Matrix5, Matrix6, Vector5, Vector6};
use pdn_kernel::elimination::PathEvaluator;
use pdn_kernel::smoother::{Smoother, SmootherSettings};
use pdn_kernel::{Factor, se3};
use serde::Serialize;

use crate::measure::timed;
use crate::survey::{self, Keyframe, Measured};

pub use pdn_kernel::elimination::{
    BlockSystem, Elimination, VirtualLink, VirtualPath, VirtualPlace, VirtualSteps, Workspace,
};
pub use pdn_kernel::information::PairInformation;
pub use pdn_kernel::se3::Pose;
pub use pdn_kernel::{KernelError, Node};

/// As the daemon's fold streams (`service/crates/state/src/fold.rs`).
const STREAM: SmootherSettings = SmootherSettings { relinearize_above: 2e-2, max_iterations: 3 };
const RELINEARIZE_EVERY: [(usize, usize); 3] = [(1024, 16), (4096, 64), (usize::MAX, 256)];
const RELINEARIZE_TOLERANCE: f64 = 1e-7;
const RELINEARIZE_TOLERANCE_OF_LARGE: f64 = 1e-5;
const SMALL_GRAPH: usize = 4096;
const RELINEARIZE_ROUNDS: usize = 20;

/// Gauss-Newton steps from scratch until no entry of a step exceeds `BATCH_TOLERANCE`.
const BATCH_ROUNDS: usize = 20;
const BATCH_TOLERANCE: f64 = 1e-9;

/// What an evaluation of a candidate computes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// Covariance of the last virtual node.
    Terminal,
    /// That, that of each node on the way, and the terminal one with every link and with none: all that a
    /// decision asks.
    Variants,
}

/// Size of a tree.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Size {
    pub fronts: usize,
    pub height: usize,
    pub largest_front_rows: usize,
    /// Of eliminating everything once.
    pub mflop: f64,
    pub megabytes: f64,
}

/// A smoother fed with a survey.
pub struct Stream {
    smoother: Smoother,
}

impl Default for Stream {
    fn default() -> Stream {
        Stream { smoother: Smoother::new(STREAM) }
    }
}

impl Stream {
    /// Adds a keyframe with its measurements; returns its first estimate.
    pub fn add(&mut self, index: usize, keyframe: &Keyframe) -> Result<Pose, KernelError> {
        let guess = match &keyframe.arrival {
            Measured::Odometry { earlier_from_later, .. } => {
                self.smoother.estimate(Node(index as u32 - 1)) * earlier_from_later
            }
            Measured::Prior { world_from_body, .. } => *world_from_body,
            _ => Pose::identity(),
        };
        let node = self.smoother.add_keyframe(guess);
        for measured in keyframe.measured() {
            self.smoother.add_factor(factor(node, measured)?)?;
        }
        Ok(guess)
    }

    /// Follows what was added as the daemon does: a few steps, and now and then the whole graph is linearised
    /// anew as closely as the daemon does it. True if it was.
    pub fn follow(&mut self) -> Result<bool, KernelError> {
        self.smoother.advance()?;
        self.smoother.take_moved(); // the daemon's raster follows them
        let keyframes = self.smoother.len();
        let every =
            RELINEARIZE_EVERY.iter().find(|(most, _)| keyframes <= *most).map_or(1, |(_, every)| *every);
        let is_due = keyframes % every == 0;
        if is_due {
            let is_small = self.smoother.len() <= SMALL_GRAPH;
            self.relinearize_to(if is_small {
                RELINEARIZE_TOLERANCE
            } else {
                RELINEARIZE_TOLERANCE_OF_LARGE
            })?;
        }
        Ok(is_due)
    }

    /// Takes every linearisation point to the estimate.
    pub fn relinearize(&mut self) -> Result<(), KernelError> {
        self.relinearize_to(RELINEARIZE_TOLERANCE)
    }

    fn relinearize_to(&mut self, tolerance: f64) -> Result<(), KernelError> {
        for _ in 0..RELINEARIZE_ROUNDS {
            if self.smoother.relinearize(tolerance)?.converged {
                break;
            }
        }
        Ok(())
    }

    pub fn linearizations(&self) -> &[Pose] {
        self.smoother.linearizations()
    }

    pub fn estimates(&self) -> Vec<Pose> {
        (0..self.smoother.len() as u32).map(|node| self.smoother.estimate(Node(node))).collect()
    }

    /// The tree that the smoother keeps.
    pub fn elimination(&self) -> &Elimination {
        self.smoother.elimination()
    }

    /// A copy, as a snapshot holds it.
    pub fn copy(&self) -> impl Sized + use<> {
        self.smoother.clone()
    }

    /// The optimum of all factors, by Gauss-Newton from the estimate with everything linearised and
    /// eliminated anew.
    pub fn batch_optimum(&self) -> Result<Vec<Pose>, KernelError> {
        let mut poses = self.estimates();
        for _ in 0..BATCH_ROUNDS {
            let mut system = BlockSystem::new();
            for _ in &poses {
                system.add_node();
            }
            for factor in self.smoother.factors() {
                add_factor(&mut system, factor, &poses)?;
            }
            let steps = Elimination::of(system)?.solve();
            for (pose, step) in poses.iter_mut().zip(&steps) {
                *pose *= se3::exp(step);
            }
            if steps.iter().all(|step| step.amax() < BATCH_TOLERANCE) {
                break;
            }
        }
        Ok(poses)
    }
}

/// Orders and eliminates a system from scratch.
pub fn eliminate(system: BlockSystem) -> Result<Elimination, KernelError> {
    Elimination::of(system)
}

/// The terminal covariances of a group, one after the other, each with its CPU time in ms.
pub fn evaluate(
    elimination: &Elimination,
    group: &[&VirtualPath],
    wanted: Wanted,
    workspace: &mut Workspace,
) -> Result<Vec<(Matrix6<f64>, f64)>, KernelError> {
    let robot = elimination.marginal(Node(elimination.len() as u32 - 1))?;
    let mut evaluator = PathEvaluator::new(elimination, workspace);
    let mut evaluate = |path| match wanted {
        Wanted::Terminal => evaluator.terminal(path),
        Wanted::Variants => evaluator.covariances(path, &robot).map(|found| found.terminal),
    };
    let each = group.iter().map(|path| {
        let (terminal, ms) = timed(|| evaluate(path));
        Ok((terminal?, ms))
    });
    each.collect()
}

/// Marginal covariance of each keyframe.
pub fn marginals(elimination: &Elimination) -> Vec<Matrix6<f64>> {
    elimination.marginals()
}

pub fn size(elimination: &Elimination) -> Size {
    let statistics = elimination.statistics();
    Size {
        fronts: statistics.fronts,
        height: statistics.height,
        largest_front_rows: statistics.largest_front,
        mflop: statistics.flops * 1e-6,
        megabytes: statistics.bytes as f64 * 1e-6,
    }
}

fn factor(node: Node, measured: &Measured) -> Result<Factor, KernelError> {
    let covariance = |sigmas: &Vector6<f64>| Matrix6::from_diagonal(&sigmas.component_mul(sigmas));
    let variance = survey::ATTITUDE_SIGMA_RAD.powi(2);
    match measured {
        Measured::Prior { world_from_body, sigmas } => {
            Factor::prior(node, *world_from_body, &covariance(sigmas))
        }
        Measured::Odometry { earlier_from_later, sigmas } => {
            Factor::odometry(Node(node.0 - 1), node, *earlier_from_later, &covariance(sigmas))
        }
        Measured::Attitude { rotation } => Factor::attitude(node, *rotation, variance, Some(variance)),
        Measured::Depth { depth_m } => Factor::depth(node, *depth_m, survey::DEPTH_SIGMA_M.powi(2)),
        Measured::Camera { earlier, earlier_from_later } => {
            let [direction, rotation] = survey::CAMERA_SIGMAS_RAD.map(|sigma| sigma * sigma);
            let mount = survey::body_from_camera();
            Factor::camera(
                Node(*earlier as u32),
                node,
                mount,
                mount,
                earlier_from_later.translation.vector.normalize(),
                earlier_from_later.rotation,
                &Matrix5::from_diagonal(&Vector5::new(direction, direction, rotation, rotation, rotation)),
                survey::BASELINES_M[0],
            )
        }
    }
}

fn add_factor(system: &mut BlockSystem, factor: &Factor, poses: &[Pose]) -> Result<(), KernelError> {
    let (first, second) = factor.nodes();
    let pose = |node: Node| &poses[node.index()];
    let linearized = factor.linearize(pose(first), second.map(pose))?;
    let [of_first, of_second] = linearized.jacobians;
    system.add_diagonal(first, &of_first.tr_mul(&of_first), &-of_first.tr_mul(&linearized.residual));
    if let Some(second) = second {
        system.add_diagonal(second, &of_second.tr_mul(&of_second), &-of_second.tr_mul(&linearized.residual));
        system.add_cross(first, second, &of_first.tr_mul(&of_second));
    }
    Ok(())
}
