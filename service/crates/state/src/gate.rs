//! The gate before the graph: what is believed of keyframes before a measurement of them is taken in, and
//! whether the measurement can be true.
//!
//! One false measurement of a kind that has no robust loss bends the whole graph: a loop closure that is
//! wrong by 100 m would be believed as much as its covariance asks. So each is compared with the belief
//! first, its own noise and that of the belief together (a Mahalanobis gate). A kind that has a robust loss
//! is not judged here: it is the loss that weighs false measurements down.
//!
//! The bound is the mission's `gate_sigmas`. Its default of 20 is far beyond chance (10 would be, for any
//! number of dimensions): what comes of standard deviations that are too small by a factor of four still
//! passes in six dimensions.

mod mahalanobis;

use crate::change::{Addition, Measurement};
use crate::error::{StateError, translate};
use mahalanobis::{Step, covariance, least_distance_squared, linearized};
use nalgebra::Matrix6;
use pdn_kernel::se3::Pose;
use pdn_kernel::smoother::Smoother;
use pdn_kernel::{Factor, KernelError, Loss, Node};
use std::collections::BTreeSet;

/// What decides whether a measurement between keyframes of the graph can be one.
pub(crate) enum Admit<'a> {
    /// What is believed of each keyframe now.
    Belief(&'a Smoother, &'a mut Gate),
    /// What was refused when the event was new. First estimates are not wanted.
    History(&'a BTreeSet<u64>),
}

impl Admit<'_> {
    /// The first estimate of a node.
    pub(crate) fn pose(&mut self, node: Node, additions: &[Addition]) -> Pose {
        match self {
            Admit::Belief(smoother, gate) => gate.pose(smoother, node, additions),
            Admit::History(_) => Pose::identity(),
        }
    }

    /// Tests an event's measurement of keyframes that are in the graph; what lies farther than `gate_sigmas`
    /// from what is believed, in standard deviations (Mahalanobis), cannot be one, if there is such a bound.
    ///
    /// # Errors
    /// Why it cannot be one of them; of what was refused before, any.
    pub(crate) fn check(
        &mut self,
        seq: u64,
        measurement: &Measurement,
        factor: &Factor,
        additions: &[Addition],
        gate_sigmas: Option<f64>,
    ) -> Result<(), StateError> {
        let (smoother, gate) = match self {
            Admit::Belief(smoother, gate) => (smoother, gate),
            Admit::History(refused) if refused.contains(&seq) => return Err(StateError::NotReady),
            Admit::History(_) => return Ok(()),
        };
        let describe = |error| translate::measurement(measurement, error);
        let (first, second) = factor.nodes();
        let first = gate.pose(smoother, first, additions);
        let second = second.map(|node| gate.pose(smoother, node, additions));
        factor.validate_geometry(&first, second.as_ref()).map_err(describe)?;
        let Some(bound) = gate_sigmas else { return Ok(()) };
        // What is believed cannot be computed; no sender knows its nodes.
        let unknown = |error| translate::unsolvable(&[], error);
        match gate.contradiction(smoother, factor, additions, bound).map_err(unknown)? {
            None => Ok(()),
            Some(distance) => Err(contradiction(measurement, distance, bound)),
        }
    }
}

/// What is believed of the keyframes that have entered the graph with the present group; of all others the
/// smoother knows.
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
    fn pose(&mut self, smoother: &Smoother, node: Node, additions: &[Addition]) -> Pose {
        self.read(smoother, additions);
        match node.index().checked_sub(smoother.len()) {
            None => smoother.estimate(node),
            Some(index) => self.entered.get(index).map_or_else(Pose::identity, |entered| entered.start),
        }
    }

    /// How far a measurement of keyframes of the graph lies from what is believed of them, if that is beyond
    /// `bound`. Cost: none where its own covariance alone explains it, else the ways from its keyframes to
    /// the root.
    ///
    /// # Errors
    /// As of [`Elimination::joint`](pdn_kernel::elimination::Elimination::joint).
    fn contradiction(
        &mut self,
        smoother: &Smoother,
        factor: &Factor,
        additions: &[Addition],
        bound: f64,
    ) -> Result<Option<f64>, KernelError> {
        if factor.loss() != Loss::None {
            return Ok(None);
        }
        self.read(smoother, additions);
        let (first, second) = factor.nodes();
        let beliefs: Vec<Belief> =
            std::iter::once(first).chain(second).map(|node| self.belief(smoother, node)).collect();
        let within = bound * bound;
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

fn contradiction(measurement: &Measurement, distance: f64, bound: f64) -> StateError {
    let kind = measurement.kind().name();
    let (first, second) = measurement.keyframes();
    StateError::Contradiction {
        field: format!("factor.{kind}"),
        keyframes: second.map_or(first.to_string(), |second| format!("{first} and {second}")),
        distance,
        bound,
        loss: format!("robust.{kind}"),
    }
}
