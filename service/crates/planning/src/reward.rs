//! Penalty and reward of an action [PDN12, eqs. 5 to 9].

use crate::decision::{Action, Candidate, Exploration};
use crate::error::PlanningError;
use crate::settings::Allowable;
use nalgebra::Matrix6;
use pdn_kernel::gaussian;

/// What uncertainty and area are weighed by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Weight of the uncertainty, in [0, 1].
    pub alpha: f64,
    /// Sigma_allow.
    pub allowable: Allowable,
    /// A_target, m^2.
    pub target_m2: f64,
    /// A_covered, m^2.
    pub covered_m2: f64,
    /// Width that a pass photographs, m.
    pub swath_m: f64,
}

/// The area side of a revisit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detour {
    /// A_redundant, m^2.
    pub redundant_m2: f64,
    /// A^k [PDN12, eq. 6].
    pub area: f64,
}

impl Scale {
    /// (|Sigma| / |Sigma_allow|)^(1/6), from the logarithms of the determinants.
    ///
    /// # Errors
    /// The kernel's, if the covariance is not positive definite.
    pub fn uncertainty_ratio(&self, covariance: &Matrix6<f64>) -> Result<f64, PlanningError> {
        let log_ratio = gaussian::log_determinant(covariance)? - self.allowable.log_determinant();
        Ok((log_ratio / 6.0).exp())
    }

    /// Candidate 0, with U^0 = 0 below the allowance and A_redundant = 0.
    ///
    /// # Errors
    /// As [`Scale::uncertainty_ratio`].
    pub fn exploration(&self, covariance: Matrix6<f64>) -> Result<Exploration, PlanningError> {
        let uncertainty_ratio = self.uncertainty_ratio(&covariance)?;
        let uncertainty = if uncertainty_ratio < 1.0 { 0.0 } else { uncertainty_ratio }; // eq. 5
        let area = self.area(0.0);
        let penalty = self.penalty(uncertainty, area);
        let reward = -penalty; // eq. 8
        Ok(Exploration { covariance, uncertainty, uncertainty_ratio, area, penalty, reward })
    }

    /// Area of a detour: A_redundant is its round-trip length times the swath.
    pub fn detour(&self, one_way_m: f64) -> Detour {
        let redundant_m2 = 2.0 * one_way_m * self.swath_m;
        Detour { redundant_m2, area: self.area(redundant_m2) }
    }

    /// A^k = (A_target - A_covered + A_redundant^k) / A_target [PDN12, eq. 6].
    pub fn area(&self, redundant_m2: f64) -> f64 {
        (self.target_m2 - self.covered_m2 + redundant_m2) / self.target_m2
    }

    /// C^k = alpha U^k + (1 - alpha) A^k [PDN12, eq. 7].
    pub fn penalty(&self, uncertainty: f64, area: f64) -> f64 {
        self.alpha * uncertainty + (1.0 - self.alpha) * area
    }

    /// The alpha above which a revisit beats exploring: it does exactly when
    /// alpha (U^0 - U^k) > (1 - alpha) dA with dA = A_redundant^k / A_target, so at dA / (dA + U^0 - U^k).
    /// None when U^k >= U^0: then no alpha suffices; so it is below the allowance, where U^0 = 0.
    ///
    /// Worked numbers: exploring exceeds the allowance by half, a waypoint lies 8.5 m away.
    ///
    /// ```
    /// # let allowable = pdn_planning::Allowable {
    /// #     x_m: 1.0, y_m: 1.0, depth_m: 1.0, roll_rad: 1.0, pitch_rad: 1.0, heading_rad: 1.0 };
    /// let scale = pdn_planning::reward::Scale {
    ///     alpha: 1.0, allowable, target_m2: 1200.0, covered_m2: 300.0, swath_m: 1.6 };
    /// let break_even = scale.break_even_alpha(1.5, 0.7, scale.detour(8.5).redundant_m2).unwrap();
    /// assert!((break_even - 0.0276).abs() < 5e-5);
    /// assert_eq!(scale.break_even_alpha(0.0, 0.7, 27.2), None);
    /// ```
    pub fn break_even_alpha(&self, exploring: f64, revisiting: f64, redundant_m2: f64) -> Option<f64> {
        let more_area = redundant_m2 / self.target_m2;
        (revisiting < exploring).then(|| more_area / (more_area + exploring - revisiting))
    }
}

/// k* = argmin C^k [PDN12, eq. 9]; ties to exploration, then to the lower k.
pub fn choose(exploration: &Exploration, candidates: &[Candidate]) -> Action {
    let mut least = exploration.penalty;
    let mut action = Action::Explore;
    for candidate in candidates {
        if let (true, Some(keyframe)) = (candidate.penalty < least, candidate.keyframe) {
            least = candidate.penalty;
            action = Action::Revisit { candidate: candidate.candidate, keyframe };
        }
    }
    action
}
