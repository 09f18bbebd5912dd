//! What is near what, found from where points are now and from an index of where they were.
//!
//! `grid` has points that stand still, `spatial_index` nodes that move a little (which are near a place?),
//! `verlet_lists` the neighbours of each (which are near it?). The latter two are taken over from one
//! snapshot by the next.

mod grid;
mod spatial_index;
mod verlet_lists;

pub(crate) use spatial_index::{ReferenceGrid, SpatialIndex};
pub(crate) use verlet_lists::VerletLists;
