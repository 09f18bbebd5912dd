//! What is believed of keyframes before a measurement of them is taken in, and whether the measurement can be true.
//!
//! One false measurement of a kind that has no robust loss bends the whole graph: a loop closure that is wrong by 100 m
//! would be believed as much as its covariance asks. So each is compared with the belief first, its own noise and that of the belief
//! together. A kind that has a robust loss is not judged here: it is the loss that weighs false measurements down.

use crate::graph_builder::Addition;
use nalgebra::{Cholesky, DMatrix, Matrix6, SMatrix, SVector};
use pdn_kernel::se3::{self, Pose};
use pdn_kernel::smoother::Smoother;
use pdn_kernel::{Factor, KernelError, Linearized, Loss, Node};

/// A measurement farther than this from what is believed is refused, in standard deviations (Mahalanobis). It is far
/// beyond chance (10 would be, for any number of dimensions): what comes of standard deviations that are too small by a
/// factor of four still passes in six dimensions.
pub(crate) const CONTRADICTION: f64 = 20.0;

/// How often a measurement is linearised anew before it is refused.
const ROUNDS: usize = 6;

/// What is believed of the keyframes that have entered the graph with the present group; of all others the smoother
/// knows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Gate {
    entered: Vec<Entered>,
    /// Additions looked at so far.
    read: usize,
}

/// A keyframe that has entered with the group.
#[derive(Clone, Debug)]
struct Entered {
    /// Its first estimate.
    start: Pose,
    belief: Belief,
}

/// A keyframe's pose as what came before it says: delta = by * delta_anchor + noise.
#[derive(Clone, Debug)]
struct Belief {
    world_from_body: Pose,
    anchor: Option<(Node, Matrix6<f64>)>,
    noise: Matrix6<f64>,
}

impl Gate {
    /// The first estimate of a node: the smoother's, or what it entered with.
    pub(crate) fn pose(&mut self, smoother: &Smoother, node: Node, additions: &[Addition]) -> Pose {
        self.read(smoother, additions);
        match node.index().checked_sub(smoother.len()) {
            None => smoother.estimate(node),
            Some(index) => self.entered.get(index).map_or_else(Pose::identity, |entered| entered.start),
        }
    }

    /// How far a measurement of keyframes of the graph lies from what is believed of them, if it is too far to be true.
    /// Cost: none where its own covariance alone explains it, else the ways from its keyframes to the root.
    ///
    /// # Errors
    /// As of [`Elimination::joint`](pdn_kernel::elimination::Elimination::joint).
    pub(crate) fn contradiction(
        &mut self,
        smoother: &Smoother,
        factor: &Factor,
        additions: &[Addition],
    ) -> Result<Option<f64>, KernelError> {
        if factor.loss() != Loss::None {
            return Ok(None);
        }
        self.read(smoother, additions);
        let (first, second) = factor.nodes();
        let beliefs: Vec<Belief> =
            std::iter::once(first).chain(second).map(|node| self.belief(smoother, node)).collect();
        let within = CONTRADICTION * CONTRADICTION;
        // Where it cannot be evaluated here it is for the solver to say.
        let Some(linear) = linearized(factor, &beliefs, &Step::zeros()) else { return Ok(None) };
        if linear.residual.norm_squared() <= within {
            return Ok(None);
        }
        let covariance = covariance(smoother, &beliefs)?;
        Ok(least_distance_squared(factor, &beliefs, &covariance, linear, within).map(f64::sqrt))
    }

    /// Looks at what has been added since the last time.
    fn read(&mut self, smoother: &Smoother, additions: &[Addition]) {
        for (index, addition) in additions.iter().enumerate().skip(self.read) {
            let Addition::Keyframe(start) = addition else { continue };
            let node = Node((smoother.len() + self.entered.len()) as u32);
            // What ties a keyframe follows it.
            let belief = match additions.get(index + 1) {
                // One that a loss may weigh down is not relied on.
                Some(Addition::Factor(tie)) if tie.loss() == Loss::None => self.tied(smoother, node, tie),
                _ => None,
            };
            let unknown = Belief {
                world_from_body: *start,
                anchor: None,
                noise: Matrix6::identity() * f64::MAX.sqrt(),
            };
            self.entered.push(Entered { start: *start, belief: belief.unwrap_or(unknown) });
        }
        self.read = additions.len();
    }

    /// What a tie says of the keyframe that it brings in; nothing where it cannot be evaluated.
    fn tied(&self, smoother: &Smoother, node: Node, tie: &Factor) -> Option<Belief> {
        let (first, second) = tie.nodes();
        let Some(second) = second else {
            let world_from_body = tie.pose_of_other(node, &Pose::identity())?;
            let to_noise = tie.linearize(&world_from_body, None).ok()?.jacobians[0].try_inverse()?;
            return Some(Belief { world_from_body, anchor: None, noise: to_noise * to_noise.transpose() });
        };
        let (known, place) = if first == node { (second, 0) } else { (first, 1) };
        let known_belief = self.belief(smoother, known);
        let world_from_body = tie.pose_of_other(known, &known_belief.world_from_body)?;
        let poses = match place {
            0 => [&world_from_body, &known_belief.world_from_body],
            _ => [&known_belief.world_from_body, &world_from_body],
        };
        let jacobians = tie.linearize(poses[0], Some(poses[1])).ok()?.jacobians;
        let to_noise = jacobians[place].try_inverse()?;
        let by_known = -to_noise * jacobians[1 - place];
        Some(Belief {
            world_from_body,
            anchor: known_belief.anchor.map(|(node, by)| (node, by_known * by)),
            noise: to_noise * to_noise.transpose() + by_known * known_belief.noise * by_known.transpose(),
        })
    }

    fn belief(&self, smoother: &Smoother, node: Node) -> Belief {
        let known = || Belief {
            world_from_body: smoother.estimate(node),
            anchor: Some((node, Matrix6::identity())),
            noise: Matrix6::zeros(),
        };
        let entered = node.index().checked_sub(smoother.len()).and_then(|index| self.entered.get(index));
        entered.map_or_else(known, |entered| entered.belief.clone())
    }
}

impl Belief {
    fn is_of_group(&self) -> bool {
        self.noise != Matrix6::zeros()
    }
}

/// Perturbations of one keyframe or two, [rho; phi] each; those of a second that there is not are zero.
type Step = SVector<f64, 12>;

/// What is believed of the keyframes together.
fn covariance(smoother: &Smoother, beliefs: &[Belief]) -> Result<Joint, KernelError> {
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

type Joint = SMatrix<f64, 12, 12>;

/// The least of |r(delta)|^2 + delta^T S^-1 delta over delta, if it is beyond `within`. A turn that is believed possible
/// moves far places along an arc, so the measurement is linearised anew where it and the belief have met.
fn least_distance_squared(
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
fn linearized(factor: &Factor, beliefs: &[Belief], step: &Step) -> Option<Linearized> {
    let moved = |place: usize| {
        let belief: &Belief = beliefs.get(place)?;
        Some(belief.world_from_body * se3::exp(&step.fixed_rows::<6>(6 * place).into_owned()))
    };
    factor.linearize(&moved(0)?, moved(1).as_ref()).ok()
}
