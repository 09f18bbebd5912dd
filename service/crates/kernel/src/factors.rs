//! The kinds of measurement: residuals, analytic Jacobians, whitening.
//!
//! | kind | residual | dimension |
//! |---|---|---|
//! | prior | Log(Z^-1 X) | 6 |
//! | odometry, relative | Log(Z^-1 X_i^-1 X_j) | 6 |
//! | camera | [b1.u; b2.u; Log(R_Z^T R)], u and R of camera j seen from camera i | 5 |
//! | attitude | Log(R Z^T), world axes; the heading row is dropped when unobserved | 3 or 2 |
//! | depth | t_z - z | 1 |
//! | position | t - z, world axes; the depth row is dropped when unobserved | 3 or 2 |
//!
//! Jacobians are with respect to right perturbations X = X_hat * Exp([rho; phi]) of each pose.

pub(crate) mod attitude;
pub(crate) mod camera;
mod construct;
pub(crate) mod depth;
pub(crate) mod position;
pub(crate) mod prior;
pub(crate) mod relative;

use nalgebra::{Matrix6, Vector6};

use crate::gaussian::validate_finite;
use crate::{KernelError, Loss, Node, se3::Pose};

/// One measurement of one or two poses: what was measured, how sure it is, how it counts when it disagrees.
///
/// The constructors check everything that can be checked without the poses; [`Factor::validate_geometry`] the
/// rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Factor {
    nodes: (Node, Option<Node>),
    kind: FactorKind,
    measurement: Measurement,
    /// W with W^T W = Sigma^-1 in the first rows and columns, zero beyond and in the rows that are not
    /// observed.
    whitening: Matrix6<f64>,
    loss: Loss,
}

/// The seven kinds of factor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum FactorKind {
    /// Where a keyframe is, known beforehand.
    Prior,
    /// How the vehicle moved from one keyframe to the next.
    Odometry,
    /// The relative pose of any two keyframes.
    Relative,
    /// Rotation and direction of translation between the cameras of two keyframes.
    Camera,
    /// The orientation of a keyframe in the world.
    Attitude,
    /// How deep a keyframe is.
    Depth,
    /// Where a keyframe is, without its orientation.
    Position,
}

/// A factor at given poses: whitened and scaled by sqrt(w) of its loss, so that its contribution to the
/// information is J^T J and to the gradient J^T r. Rows beyond the dimension are zero; so is the second
/// Jacobian of a unary factor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Linearized {
    /// sqrt(w) W r.
    pub residual: Vector6<f64>,
    /// sqrt(w) W dr/dxi for the first and the second pose, xi = [rho; phi] on the right.
    pub jacobians: [Matrix6<f64>; 2],
}

#[derive(Debug, Clone, PartialEq)]
enum Measurement {
    Prior(prior::PriorMeasurement),
    Relative(relative::RelativeMeasurement),
    Camera { measurement: camera::CameraMeasurement, min_baseline_m: f64 },
    Attitude(attitude::AttitudeMeasurement),
    Depth(depth::DepthMeasurement),
    Position(position::PositionMeasurement),
}

/// An accepted camera factor may see its baseline shrink as the estimate moves. Below this share of the least
/// accepted baseline its direction would outweigh everything else, and the factor refuses to be linearised.
const COLLAPSED_SHARE: f64 = 0.1;

impl FactorKind {
    /// All kinds, in the order in which they are counted and listed.
    pub const ALL: [FactorKind; 7] = [
        FactorKind::Prior,
        FactorKind::Odometry,
        FactorKind::Relative,
        FactorKind::Camera,
        FactorKind::Attitude,
        FactorKind::Depth,
        FactorKind::Position,
    ];

    /// The kind's name in messages and settings.
    pub fn name(self) -> &'static str {
        match self {
            FactorKind::Prior => "prior",
            FactorKind::Odometry => "odometry",
            FactorKind::Relative => "relative",
            FactorKind::Camera => "camera",
            FactorKind::Attitude => "attitude",
            FactorKind::Depth => "depth",
            FactorKind::Position => "position",
        }
    }
}

impl Factor {
    /// The same measurement with a robust loss; [`Loss::validate`] says whether its scale is usable.
    pub fn with_loss(self, loss: Loss) -> Self {
        Self { loss, ..self }
    }

    /// Which kind of measurement it is.
    pub fn kind(&self) -> FactorKind {
        self.kind
    }

    /// How a disagreement with the estimate is weighed.
    pub fn loss(&self) -> Loss {
        self.loss
    }

    /// The keyframes it ties: (from, to), or the one that it measures.
    pub fn nodes(&self) -> (Node, Option<Node>) {
        self.nodes
    }

    /// The number of residual components that are observed.
    pub fn dimension(&self) -> usize {
        (0..6).filter(|&row| self.whitening[(row, row)] != 0.0).count()
    }

    /// Where the measurement alone puts the other keyframe, `pose` being that of `known`: X_i Z for the
    /// second, X_j Z^-1 for the first. A prior puts its own keyframe, whatever `pose` is. `None` for kinds
    /// that do not determine all six degrees of freedom and for a keyframe that is not one of its own.
    pub fn pose_of_other(&self, known: Node, pose: &Pose) -> Option<Pose> {
        match (&self.measurement, self.nodes) {
            (Measurement::Prior(prior), _) => Some(prior.world_from_body),
            (Measurement::Relative(measured), (from, _)) if known == from => Some(pose * measured.relative),
            (Measurement::Relative(measured), (_, to)) if Some(known) == to => {
                Some(pose * measured.relative.inverse())
            }
            _ => None,
        }
    }

    /// Whether the factor may be accepted with its keyframes at these poses: `DegenerateBaseline` for a
    /// camera factor whose cameras are nearer to each other than its `min_baseline_m`, since its direction
    /// would then tell nothing.
    ///
    /// To be asked once, when the factor arrives. Later the estimate may bring an accepted pair a little
    /// nearer without harm; [`Factor::linearize`] refuses only below a tenth of it.
    pub fn validate_geometry(&self, first: &Pose, second: Option<&Pose>) -> Result<(), KernelError> {
        self.validate_baseline(first, self.second_pose(second)?, 1.0)
    }

    /// Residual and Jacobians at these poses, whitened and scaled by sqrt(w). `second` is not looked at for a
    /// unary factor.
    ///
    /// Errors: `MissingPose`; `DegenerateBaseline` for cameras that have come nearer than a tenth of
    /// `min_baseline_m`; `NotFinite` when a pose or the result is not finite.
    pub fn linearize(&self, first: &Pose, second: Option<&Pose>) -> Result<Linearized, KernelError> {
        let second = self.second_pose(second)?;
        let whitened = self.whitened_residual(first, second)?;
        let root_weight = self.loss.weight(whitened.norm_squared()).sqrt();
        let jacobians = match &self.measurement {
            Measurement::Prior(measured) => [measured.jacobian(first), Matrix6::zeros()],
            Measurement::Relative(measured) => measured.jacobians(first, second),
            Measurement::Camera { measurement, .. } => measurement.jacobians(first, second),
            Measurement::Attitude(measured) => [measured.jacobian(first), Matrix6::zeros()],
            Measurement::Depth(measured) => [measured.jacobian(first), Matrix6::zeros()],
            Measurement::Position(measured) => [measured.jacobian(first), Matrix6::zeros()],
        };
        let scaled_whitening = self.whitening * root_weight;
        let linearized = Linearized {
            residual: whitened * root_weight,
            jacobians: jacobians.map(|jacobian| scaled_whitening * jacobian),
        };
        validate_finite("weighted residual", linearized.residual.as_slice())?;
        for jacobian in &linearized.jacobians {
            validate_finite("Jacobian", jacobian.as_slice())?;
        }
        Ok(linearized)
    }

    /// w r^T Sigma^-1 r at these poses, w the weight of the loss there. Errors as of [`Factor::linearize`].
    pub fn chi2(&self, first: &Pose, second: Option<&Pose>) -> Result<f64, KernelError> {
        let r_squared = self.whitened_residual(first, self.second_pose(second)?)?.norm_squared();
        let chi2 = self.loss.weight(r_squared) * r_squared;
        validate_finite("chi2", &[chi2])?;
        Ok(chi2)
    }

    fn whitened_residual(&self, first: &Pose, second: &Pose) -> Result<Vector6<f64>, KernelError> {
        self.validate_baseline(first, second, COLLAPSED_SHARE)?;
        let residual = match &self.measurement {
            Measurement::Prior(measured) => measured.residual(first),
            Measurement::Relative(measured) => measured.residual(first, second),
            Measurement::Camera { measurement, .. } => measurement.residual(first, second),
            Measurement::Attitude(measured) => measured.residual(first),
            Measurement::Depth(measured) => measured.residual(first),
            Measurement::Position(measured) => measured.residual(first),
        };
        let whitened = self.whitening * residual;
        validate_finite("whitened residual", whitened.as_slice())?;
        Ok(whitened)
    }

    fn validate_baseline(&self, first: &Pose, second: &Pose, share: f64) -> Result<(), KernelError> {
        let Measurement::Camera { measurement, min_baseline_m } = &self.measurement else { return Ok(()) };
        let baseline_m = measurement.baseline_m(first, second);
        validate_finite("baseline", &[baseline_m])?;
        let min_baseline_m = share * min_baseline_m;
        if baseline_m < min_baseline_m {
            return Err(KernelError::DegenerateBaseline { baseline_m, min_baseline_m });
        }
        Ok(())
    }

    /// The second pose of a binary factor; for a unary one any pose does, and `first` is not at hand:
    /// identity.
    fn second_pose<'a>(&self, second: Option<&'a Pose>) -> Result<&'a Pose, KernelError> {
        const UNUSED: &Pose = &Pose {
            rotation: nalgebra::Unit::new_unchecked(nalgebra::Quaternion::new(1.0, 0.0, 0.0, 0.0)),
            translation: nalgebra::Translation3::new(0.0, 0.0, 0.0),
        };
        match (self.nodes.1, second) {
            (None, _) => Ok(UNUSED),
            (Some(_), Some(pose)) => Ok(pose),
            (Some(node), None) => Err(KernelError::MissingPose { node }),
        }
    }
}

#[cfg(test)]
mod tests;
