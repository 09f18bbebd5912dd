//! Paths that have not been driven yet: the covariance at their end, as if their virtual nodes were in the
//! graph.
//!
//! Reading order: `virtual_path` (what is asked), `evaluator` (many paths over one elimination), `workspace`
//! (the elimination of one), `along` (the covariance of every node). A path on the tree: `chain` (places
//! without links, taken out first), `variables` (the unknowns of the others), `structure`, `front_assignment`
//! and `layout` (where they enter the tree), `information` (what they add to it), `results` (what the path
//! before has left).

mod virtual_path;

mod evaluator;

mod workspace;

mod along;

mod chain;
mod variables;

mod front_assignment;
mod layout;
mod structure;

mod information;
mod results;

pub use evaluator::PathEvaluator;
pub use virtual_path::{ExpectedCovariances, VirtualLink, VirtualPath, VirtualPlace, VirtualSteps};
pub use workspace::Workspace;
