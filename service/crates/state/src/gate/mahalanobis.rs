//! How far a measurement lies from what is believed, its noise and that of the belief together.

use super::Belief;
use nalgebra::{Cholesky, DMatrix, Matrix6, SMatrix, SVector};
use pdn_kernel::se3;
use pdn_kernel::smoother::Smoother;
use pdn_kernel::{Factor, KernelError, Linearized, Node};

/// How often a measurement is linearised anew before it is refused.
const ROUNDS: usize = 6;

/// Perturbations of one keyframe or two, [rho; phi] each; those of a second that there is not are zero.
pub(super) type Step = SVector<f64, 12>;

/// What is believed of the keyframes together.
pub(super) fn covariance(smoother: &Smoother, beliefs: &[Belief]) -> Result<Joint, KernelError> {
    let anchors: Vec<Node> =
        beliefs.iter().filter_map(|belief| belief.anchor.map(|(node, _)| node)).collect();
    let known = smoother.elimination().joint(&anchors)?;
    let mut by = DMatrix::zeros(12, 6 * anchors.len());
    let mut at = 0;
    let mut covariance = Joint::zeros();
    // What two keyframes of the group have in common is counted as if it did not cancel.
    let share = if beliefs.len() == 2 && beliefs.iter().all(Belief::is_of_group) { 2.0 } else { 1.0 };
    for (place, belief) in beliefs.iter().enumerate() {
        if let Some((_, by_anchor)) = belief.anchor {
            by.fixed_view_mut::<6, 6>(6 * place, at).copy_from(&by_anchor);
            at += 6;
        }
        covariance.fixed_view_mut::<6, 6>(6 * place, 6 * place).copy_from(&(belief.noise * share));
    }
    covariance += &by * known * by.transpose();
    Ok(covariance)
}

pub(super) type Joint = SMatrix<f64, 12, 12>;

/// The least of |r(delta)|^2 + delta^T S^-1 delta over delta, if it is beyond `within`. A turn that is
/// believed possible moves far places along an arc, so the measurement is linearised anew where it and the
/// belief have met.
pub(super) fn least_distance_squared(
    factor: &Factor,
    beliefs: &[Belief],
    covariance: &Joint,
    mut linear: Linearized,
    within: f64,
) -> Option<f64> {
    let mut step = Step::zeros();
    let mut least = f64::INFINITY;
    for _ in 0..ROUNDS {
        let mut jacobian = SMatrix::<f64, 6, 12>::zeros();
        jacobian.fixed_view_mut::<6, 6>(0, 0).copy_from(&linear.jacobians[0]);
        jacobian.fixed_view_mut::<6, 6>(0, 6).copy_from(&linear.jacobians[1]);
        // r(delta) = r + J (delta - step); rows that are not observed are zero in all.
        let offset = linear.residual - jacobian * step;
        let spread = Matrix6::identity() + jacobian * covariance * jacobian.transpose();
        let weighed = Cholesky::new(spread)?.solve(&offset);
        let distance = offset.dot(&weighed);
        if distance <= within || distance.is_nan() {
            return None;
        }
        least = least.min(distance);
        step = -(covariance * jacobian.transpose() * weighed);
        linear = linearized(factor, beliefs, &step)?;
    }
    Some(least)
}

/// The measurement at the beliefs moved by a step; none where it cannot be evaluated.
pub(super) fn linearized(factor: &Factor, beliefs: &[Belief], step: &Step) -> Option<Linearized> {
    let moved = |place: usize| {
        let belief: &Belief = beliefs.get(place)?;
        Some(belief.world_from_body * se3::exp(&step.fixed_rows::<6>(6 * place).into_owned()))
    };
    factor.linearize(&moved(0)?, moved(1).as_ref()).ok()
}
