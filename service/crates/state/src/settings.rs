//! A mission's configuration in the types of the method: SI units, radians, checked.

use crate::survey::Survey;
use nalgebra::Matrix6;
use pdn_kernel::se3::Pose;
use pdn_kernel::{FactorKind, Loss};
use pdn_planning::coverage::{Facet, FieldOfView};
use pdn_planning::{Coverage, LinkModel};

/// Everything that the fold needs to know of a mission's configuration.
#[derive(Clone, Debug)]
pub struct Settings {
    /// What decisions depend on.
    pub planning: pdn_planning::Settings,
    /// The camera of a keyframe that brings none of its own.
    pub body_from_camera: Pose,
    /// How much a factor counts when the estimate disagrees.
    pub losses: Losses,
    /// From where on a measurement without a loss cannot be true, in standard deviations; none for no bound.
    pub gate_sigmas: Option<f64>,
    /// Covariance of the prior on the first keyframe, `[m; rad]` in its body axes; none if a prior factor
    /// will come.
    pub first_keyframe_covariance: Option<Matrix6<f64>>,
    /// The target.
    pub facets: Vec<Facet>,
    /// What a camera sees.
    pub view: FieldOfView,
    /// The rasters of the target, empty.
    pub coverage: Coverage,
    /// A_target, m^2.
    pub target_m2: f64,
    /// The table of P_L with its prior.
    pub link_model: LinkModel,
    /// The planned way over the target.
    pub survey: Option<Survey>,
}

/// The robust loss of each kind of factor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Losses {
    /// In the order of [`FactorKind::ALL`].
    pub by_kind: [Loss; 7],
}

impl Losses {
    /// The loss of one kind.
    pub fn of(&self, kind: FactorKind) -> Loss {
        FactorKind::ALL
            .iter()
            .zip(self.by_kind)
            .find(|(other, _)| **other == kind)
            .map_or(Loss::None, |(_, loss)| loss)
    }
}
