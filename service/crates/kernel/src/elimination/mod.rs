//! Sparse block elimination of the information matrix on a tree of fronts.

mod virtual_path;

pub use virtual_path::{ExpectedCovariance, LinkWeight, VirtualLink, VirtualPath};

use nalgebra::Matrix6;

use crate::{KernelError, Node};

/// The information matrix Lambda_0 and its Cholesky factor on a tree of fronts.
///
/// Cloning is cheap: fronts and blocks are shared until one of the copies changes them.
#[derive(Clone, Debug, Default)]
pub struct Elimination {}

/// Buffers that expected covariances are computed in; one a thread, reused from call to call.
#[derive(Debug, Default)]
pub struct Workspace {}

/// Size and cost of an elimination.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Keyframes.
    pub nodes: usize,
    /// Fronts of the tree.
    pub fronts: usize,
    /// Fronts on the longest way from a leaf to a root.
    pub height: usize,
    /// Floating point operations of eliminating everything once.
    pub flops: f64,
    /// Bytes held by factors, update matrices and blocks.
    pub bytes: usize,
}

impl Elimination {
    /// Number of nodes.
    pub fn len(&self) -> usize {
        unimplemented!()
    }

    /// True if there is no node yet.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Covariance of one node, `[rho; phi]`: the 6x6 block of the inverse. Cost: one path to the root.
    pub fn marginal(&self, node: Node) -> Result<Matrix6<f64>, KernelError> {
        let _ = node;
        unimplemented!()
    }

    /// Covariance of each node, in their order.
    pub fn marginals(&self) -> Result<Vec<Matrix6<f64>>, KernelError> {
        unimplemented!()
    }

    /// Covariance of the last virtual node of a path (and, if asked, of each node along it) as if it were driven.
    pub fn expected_covariance(
        &self,
        path: &VirtualPath,
        weight: LinkWeight,
        along: bool,
        workspace: &mut Workspace,
    ) -> Result<ExpectedCovariance, KernelError> {
        let _ = (path, weight, along, workspace);
        unimplemented!()
    }

    /// Size and cost of this elimination.
    pub fn statistics(&self) -> Statistics {
        unimplemented!()
    }
}
