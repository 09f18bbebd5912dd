//! Where nodes are, searched by distance; most of it is taken over from one snapshot by the next.
//!
//! A grid is made once, for reference positions. While a node is within a slack of its reference position, a
//! search that reaches farther by the slack finds it there, and its distance is that from where it is now.
//! Nodes that are new or have moved farther are in a small grid of their own; when they become many,
//! everything is sorted anew. So what a search finds is a function of where the nodes are now and of nothing
//! else.

use super::grid::Grid;
use crate::distance::nanometres;
use nalgebra::Vector3;
use pdn_kernel::Node;
use std::sync::Arc;

/// How far a node may be from its reference position, in edges of a cube.
const SLACK: f64 = 0.125;

/// The grid is made anew once more than this many nodes, and more than this share of all, are displaced.
const DISPLACED_NODES: usize = 64;
const DISPLACED_SHARE: usize = 16;

/// The grid serves searches of other radii than it was made for as long as they differ by less than this
/// factor.
const OTHER_EDGE: f64 = 1.25;

/// Rounding of a place's coordinates and of nanometres, m.
const ROUNDING_M: f64 = 1e-8;

/// Positions of nodes 0, 1, ...
#[derive(Debug)]
pub(crate) struct SpatialIndex {
    positions: Vec<Vector3<f64>>,
    reference: Arc<ReferenceGrid>,
    /// By node, whether it is in `displaced` instead.
    is_displaced: Vec<bool>,
    displaced: Grid,
}

/// Reference positions, by node, and their grid.
#[derive(Debug)]
pub(crate) struct ReferenceGrid {
    positions: Vec<Vector3<f64>>,
    grid: Grid,
}

impl SpatialIndex {
    /// `edge_m` is about the radius of the searches to come (one metre if it is no length), `before` the
    /// reference of an earlier state, or of a later one.
    ///
    /// Cost: a comparison for each node, and sorting those that are displaced.
    pub(crate) fn new(
        positions: Vec<Vector3<f64>>,
        edge_m: f64,
        before: Option<Arc<ReferenceGrid>>,
    ) -> SpatialIndex {
        let edge_m = if edge_m.is_finite() && edge_m > 0.0 { edge_m } else { 1.0 };
        let before = before.filter(|before| is_like(before.grid.edge_m(), edge_m));
        let known = before.map(|before| (before.displaced(&positions), before));
        let few = |is_displaced: &[bool]| {
            let count = is_displaced.iter().filter(|displaced| **displaced).count();
            count <= DISPLACED_NODES.max(positions.len() / DISPLACED_SHARE)
        };
        let known = known.filter(|(is_displaced, _)| few(is_displaced));
        let (is_displaced, reference) = known.unwrap_or_else(|| {
            let grid = Grid::new((0..).map(Node).zip(positions.iter().copied()), edge_m);
            (vec![false; positions.len()], Arc::new(ReferenceGrid { positions: positions.clone(), grid }))
        });
        let nodes = (0..).map(Node).zip(positions.iter().copied());
        let displaced = Grid::new(nodes.filter(|(node, _)| is_displaced[node.index()]), edge_m);
        SpatialIndex { positions, reference, is_displaced, displaced }
    }

    /// What a later state may begin with.
    pub(crate) fn reference(&self) -> Arc<ReferenceGrid> {
        Arc::clone(&self.reference)
    }

    /// Where each node is.
    pub(crate) fn positions(&self) -> &[Vector3<f64>] {
        &self.positions
    }

    /// The nearest node, of those at its distance to the nanometre the one of least `rank`; none without
    /// nodes.
    pub(crate) fn nearest(&self, place: &Vector3<f64>, rank: impl Fn(Node) -> u64) -> Option<Node> {
        let mut reach_m = self.reference.grid.edge_m();
        while reach_m.is_finite() {
            let mut best: Option<(i64, Node)> = None;
            self.visit(place, reach_m, |node, distance_m| {
                let distance = nanometres(distance_m);
                let is_nearer = |(least, first): (i64, Node)| {
                    distance < least || (distance == least && rank(node) < rank(first))
                };
                if best.is_none_or(is_nearer) {
                    best = Some((distance, node));
                }
            });
            // What was not shown is farther than that.
            if let Some((_, node)) = best.filter(|(least, _)| *least < nanometres(reach_m - ROUNDING_M)) {
                return Some(node);
            }
            reach_m *= 2.0;
        }
        let distance = |node: Node| nanometres((self.positions[node.index()] - place).norm());
        (0..self.positions.len() as u32).map(Node).min_by_key(|&node| (distance(node), rank(node)))
    }

    /// Shows every node within `reach_m`, and some that are farther, in no order, each with its distance.
    pub(crate) fn visit(&self, place: &Vector3<f64>, reach_m: f64, mut show: impl FnMut(Node, f64)) {
        let mut show_with_distance = |node: Node| show(node, (self.positions[node.index()] - place).norm());
        let slack_m = self.reference.slack_m();
        self.reference.grid.visit(place, reach_m + slack_m, |node| {
            if self.is_displaced.get(node.index()) == Some(&false) {
                show_with_distance(node);
            }
        });
        self.displaced.visit(place, reach_m, show_with_distance);
    }
}

impl ReferenceGrid {
    /// How far a node may have gone from its reference position, m.
    fn slack_m(&self) -> f64 {
        SLACK * self.grid.edge_m()
    }

    /// For each position whether its node is not within the slack of its reference position.
    fn displaced(&self, positions: &[Vector3<f64>]) -> Vec<bool> {
        // A little is left for rounding.
        let limit_m = 0.99 * self.slack_m();
        let is_near = |(position, reference): (&Vector3<f64>, &Vector3<f64>)| {
            (position - reference).norm_squared() <= limit_m * limit_m
        };
        let known = positions.iter().zip(&self.positions);
        let mut is_displaced: Vec<bool> = known.map(|pair| !is_near(pair)).collect();
        is_displaced.resize(positions.len(), true);
        is_displaced
    }
}

/// Whether searches of about one edge may use cubes of the other.
fn is_like(edge_m: f64, wanted_m: f64) -> bool {
    edge_m <= OTHER_EDGE * wanted_m && wanted_m <= OTHER_EDGE * edge_m
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drawn(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        }
    }

    fn within(index: &SpatialIndex, place: &Vector3<f64>, radius_m: f64) -> Vec<(Node, f64)> {
        let mut near: Vec<(Node, f64)> = Vec::new();
        index.visit(place, radius_m + ROUNDING_M, |node, distance_m| near.push((node, distance_m)));
        near.retain(|&(_, distance_m)| nanometres(distance_m) <= nanometres(radius_m));
        near.sort_unstable_by_key(|&(node, _)| node);
        near
    }

    /// What searches find is what a look at each point finds, bit for bit.
    fn check(index: &SpatialIndex, asked: &[Vector3<f64>]) {
        let rank = |node: Node| u64::from(node.0) * 7919 % 10007;
        for place in asked {
            let distances =
                || (0..).map(Node).zip(index.positions.iter().map(|point| (point - place).norm()));
            for radius_m in [0.0, 0.4, 1.0, 30.0, f64::INFINITY] {
                let near = distances().filter(|&(_, far_m)| nanometres(far_m) <= nanometres(radius_m));
                assert_eq!(within(index, place, radius_m), near.collect::<Vec<_>>());
            }
            let nearest = distances().min_by_key(|&(node, far_m)| (nanometres(far_m), rank(node)));
            assert_eq!(index.nearest(place, rank), nearest.map(|(node, _)| node));
        }
    }

    #[test]
    fn it_finds_what_a_look_at_every_point_finds() {
        let mut share = drawn(3);
        for (count, spread_m) in [(0, 1.0), (1, 1.0), (300, 2.0), (300, 40.0), (50, 1e9)] {
            let mut draw = || Vector3::from_fn(|_, _| spread_m * (share() - 0.5));
            let places: Vec<Vector3<f64>> = (0..count).map(|_| draw()).collect();
            let asked: Vec<Vector3<f64>> =
                (0..20).map(|_| draw()).chain(places.iter().copied().take(20)).collect();
            for edge_m in [0.3, 1.0, 50.0, 0.0, f64::NAN] {
                check(&SpatialIndex::new(places.clone(), edge_m, None), &asked);
            }
        }
    }

    /// Places on a lattice, so that there are ties; they come, go, creep and jump, and the edge changes.
    #[test]
    fn it_finds_the_same_whatever_it_begins_with() {
        let mut share = drawn(5);
        let mut now: Vec<Vector3<f64>> = Vec::new();
        let mut reference: Option<Arc<ReferenceGrid>> = None;
        let (mut displaced, mut sorted_anew) = (0, 0);
        for step in 0..120 {
            let jumps = if step % 20 == 19 { 0.9 } else { 0.02 };
            for place in &mut now {
                let far_m = if share() < jumps { 1.0 } else { 0.02 };
                *place += Vector3::from_fn(|_, _| far_m * (share() - 0.5));
            }
            now.truncate(if step % 31 == 30 { now.len() - 3 } else { now.len() });
            now.extend((0..4).map(|_| Vector3::from_fn(|_, _| 0.5 * (share() * 14.0).floor())));
            let edge_m = 1.0 + 0.3 * share();
            let before = reference.take();
            let index = SpatialIndex::new(now.clone(), edge_m, before.clone());
            displaced += index.is_displaced.iter().filter(|displaced| **displaced).count();
            sorted_anew += usize::from(before.is_none_or(|before| !Arc::ptr_eq(&before, &index.reference)));
            let asked: Vec<Vector3<f64>> = now
                .iter()
                .copied()
                .step_by(7)
                .chain((0..10).map(|at| Vector3::repeat(0.25 * at as f64)))
                .collect();
            check(&index, &asked);
            reference = Some(index.reference());
        }
        assert!(
            displaced > 1000 && (3..60).contains(&sorted_anew),
            "{displaced} displaced, sorted {sorted_anew} times"
        );
    }
}
