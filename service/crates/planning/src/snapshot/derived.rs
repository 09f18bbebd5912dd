//! What is derived from a snapshot once and serves all questions asked of it, and the cache from which that
//! begins.

use super::Snapshot;
use crate::distance::median;
use crate::revisit::Waypoint;
use crate::spatial::{ReferenceGrid, SpatialIndex, VerletLists};
use crate::view_angle::optical_axis;
use nalgebra::{Matrix6, Vector3};
use pdn_kernel::Node;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// What is derived from a snapshot. `Derived::default()` begins with an empty cache; what is found is the
/// same, bit for bit.
#[derive(Default)]
pub struct Derived {
    cache: DerivedCache,
    bodies: OnceLock<SpatialIndex>,
    cameras: OnceLock<Cameras>,
    neighbours: OnceLock<VerletLists>,
    salient_neighbours: OnceLock<VerletLists>,
    spacing_m: OnceLock<Option<f64>>,
    pub(crate) robot_covariance: OnceLock<Matrix6<f64>>,
    pub(crate) waypoints: OnceLock<Vec<Waypoint>>,
}

/// Cache that the snapshots of one mission share: reference grids and Verlet lists, of which most stay from
/// one snapshot to the next. Copies are the same cache. Nothing that is found depends on it, only the time
/// that it takes.
#[derive(Clone, Debug, Default)]
pub struct DerivedCache(Arc<Mutex<CacheContent>>);

/// What was derived last.
#[derive(Debug, Default)]
struct CacheContent {
    bodies: Option<Arc<ReferenceGrid>>,
    cameras: Option<Arc<ReferenceGrid>>,
    neighbours: VerletLists,
    salient_neighbours: VerletLists,
}

/// The cameras of a snapshot.
pub(crate) struct Cameras {
    /// Their centres.
    pub centres: SpatialIndex,
    /// Their optical axes in the world, by node.
    pub axes: Vec<Vector3<f64>>,
}

impl Derived {
    /// Nothing yet; what will be derived begins from this cache and updates it.
    pub fn with_cache(cache: &DerivedCache) -> Derived {
        Derived { cache: cache.clone(), ..Derived::default() }
    }
}

impl DerivedCache {
    /// Makes something from its cached part, and caches what later snapshots may begin with.
    fn update<T: Clone, R>(
        &self,
        of: fn(&mut CacheContent) -> &mut T,
        make: impl FnOnce(T) -> R,
        reusable: impl FnOnce(&R) -> T,
    ) -> R {
        // Other snapshots may update the same part meanwhile: what is cached is whole at any time.
        let content = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let before = of(&mut content()).clone();
        let made = make(before);
        *of(&mut content()) = reusable(&made);
        made
    }
}

impl Snapshot {
    /// Where the keyframes' bodies are. Cost: once, a comparison for each and sorting what has moved.
    pub(crate) fn bodies(&self) -> &SpatialIndex {
        self.derived.bodies.get_or_init(|| {
            let places = self.keyframes.iter().map(|keyframe| keyframe.world_from_body.translation.vector);
            let make = |before| SpatialIndex::new(places.collect(), self.edge_radius_m(), before);
            self.derived.cache.update(|content| &mut content.bodies, make, |made| Some(made.reference()))
        })
    }

    /// The keyframes' cameras. Cost as of [`Snapshot::bodies`].
    pub(crate) fn cameras(&self) -> &Cameras {
        self.derived.cameras.get_or_init(|| {
            let cameras = self.keyframes.iter().map(|keyframe| {
                let world_from_camera = keyframe.world_from_camera();
                (world_from_camera.translation.vector, optical_axis(&world_from_camera))
            });
            let (positions, axes): (Vec<_>, Vec<_>) = cameras.unzip();
            let make = |before| SpatialIndex::new(positions, self.settings.max_baseline_m, before);
            let reusable = |made: &SpatialIndex| Some(made.reference());
            let centres = self.derived.cache.update(|content| &mut content.cameras, make, reusable);
            Cameras { centres, axes }
        })
    }

    /// For each keyframe the others within [`Snapshot::edge_radius_m`]. Cost: once, a comparison for each and
    /// a search for those that have moved.
    pub(crate) fn neighbours(&self) -> &VerletLists {
        self.derived.neighbours.get_or_init(|| {
            let now = self.bodies().positions().iter().copied().map(Some).collect();
            self.update_neighbours(|content| &mut content.neighbours, self.edge_radius_m(), now)
        })
    }

    /// For each keyframe of the salient set the others of it within `eps_m`. Cost as of
    /// [`Snapshot::neighbours`].
    pub(crate) fn salient_neighbours(&self) -> &VerletLists {
        self.derived.salient_neighbours.get_or_init(|| {
            let mut now = vec![None; self.keyframes.len()];
            self.salient().for_each(|node| now[node.index()] = Some(self.body(node)));
            self.update_neighbours(|content| &mut content.salient_neighbours, self.settings.eps_m, now)
        })
    }

    fn update_neighbours(
        &self,
        of: fn(&mut CacheContent) -> &mut VerletLists,
        radius_m: f64,
        now: Vec<Option<Vector3<f64>>>,
    ) -> VerletLists {
        let update = |before: VerletLists| {
            before.update(radius_m, &now, |place, reach_m, show| {
                self.bodies().visit(place, reach_m, |node, _| show(node));
            })
        };
        self.derived.cache.update(of, update, VerletLists::clone)
    }

    /// Median distance of consecutive keyframes, m: of those between which the vehicle itself went, or, if no
    /// odometry has come at all, of those that follow one another in the order of addition. None with fewer
    /// than two keyframes.
    pub fn spacing_m(&self) -> Option<f64> {
        *self.derived.spacing_m.get_or_init(|| {
            let step_m = |from: Node, to: Node| (self.body(to) - self.body(from)).norm();
            let went = self.went.iter().map(|&(from, to)| step_m(from, to));
            let added = (1..self.keyframes.len() as u32).map(|node| step_m(Node(node - 1), Node(node)));
            median(if self.went.is_empty() { added.collect() } else { went.collect() })
        })
    }
}
