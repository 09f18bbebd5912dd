//! Sparse block elimination of the information matrix on a tree of fronts.
//!
//! Lambda = L L^T is factored in 6x6 blocks, many nodes at a time: a *front* is a dense matrix over the nodes
//! it eliminates and the later nodes these are joined to (its separator). What the elimination leaves on the
//! separator, the *update matrix*, is added to the front above (Duff and Reid 1983). The order is nested
//! dissection, which keeps the tree flat; each front keeps its factor and its update matrix, so that
//!
//! - new factors eliminate only the fronts they touch and those above \[Kaess 2012, iSAM2's idea\],
//! - a candidate path does the same with its virtual nodes added, and leaves the tree as it is,
//! - covariances come down the same tree (Takahashi's recursion).
//!
//! Reading order: `system` (the blocks), `engine` (all that can be asked), `order` (the order of
//! elimination), `symbolic` (the fronts), `front` and `assembly` (their numbers), `tree` and `restructure`
//! (what stays and what goes), `tree_state` (what is saved of it), `solution`, `marginals`; `path` for paths
//! not driven yet. Nothing recurses over the tree, and nothing is dense in the number of nodes.

mod system;

mod engine;

mod order;
mod symbolic;

mod assembly;
mod dense;
mod front;
mod packed;
mod restructure;
mod tree;
mod tree_state;

mod marginals;
mod positive_definite;
mod solution;
mod takahashi;

mod path;

pub use engine::{Elimination, Statistics};
pub use path::{
    ExpectedCovariances, PathEvaluator, VirtualLink, VirtualPath, VirtualPlace, VirtualSteps, Workspace,
};
pub use system::BlockSystem;
pub use tree_state::{FrontState, Ordered, TreeState};

pub(crate) use solution::Solution;
