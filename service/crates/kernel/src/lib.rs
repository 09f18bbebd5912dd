//! The pure mathematics of navigation by a pose graph: rigid-body motions, Gaussian measurements of them, and
//! the elimination of a sparse system of them.
//!
//! Nothing here reads a file, a network or a clock, starts a thread or draws a random number: equal input
//! gives equal bits.
//!
//! # Conventions
//!
//! A pose is `world_from_body` in SE(3), metres; the world is north-east-down. A tangent vector is
//! xi = [rho (3, m); phi (3, rad)], translation first, and perturbs a pose on the right, in the body frame:
//! X = X_hat * Exp(xi). Every 6x6 covariance, information or Jacobian is in that order.
//!
//! # Modules, in reading order
//!
//! [`so3`] and [`se3`] are the groups; [`gaussian`] checks covariances and whitens; [`loss`] weighs outliers
//! down; [`factors`] are the kinds of measurement with their Jacobians; [`information`] is what a measurement
//! yet to be made will tell; [`elimination`] solves the sparse system of them; [`smoother`] keeps the
//! estimate as factors come.

mod error;
pub mod so3;
mod so3_coefficients;

mod shared_vec;

pub mod se3;

pub mod gaussian;

pub mod loss;

pub mod factors;

pub mod information;

pub mod elimination;

pub mod smoother;

#[cfg(test)]
mod testing;

pub use error::KernelError;
pub use factors::{Factor, FactorKind, Linearized};
pub use loss::Loss;
pub use se3::Pose;
pub use shared_vec::SharedVec;

/// A keyframe in the graph: a dense index in the order of addition, starting at 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Node(pub u32);

impl Node {
    /// The index as a position in slices that hold one entry a keyframe.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl std::fmt::Display for Node {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{}", self.0)
    }
}
