//! The order of elimination: nested dissection down to small parts, and minimum degree within them.
//!
//! Reading order: `graph` (what is ordered), `dissection` (the order), `bisection` (where a part is divided),
//! `separator` (how a division is improved), `minimum_degree` (the parts that are not divided).

mod graph;

mod dissection;

mod bisection;
mod separator;

mod minimum_degree;

pub(super) use dissection::order as nested_dissection;
pub(super) use graph::Graph;
