//! Where nodes are, searched by distance, and kept from one snapshot to the next.
//!
//! A grid is made once for places as they are then. While a node is within a slack of where the grid has it, a search
//! that reaches farther by the slack finds it there, and its distance is that from where it is now. Nodes that are new or have
//! moved farther are in a small grid of their own; when they become many, everything is sorted anew. So what a search
//! finds is a function of where the nodes are now and of nothing else.

use crate::distance::nanometres;
use crate::grid::Grid;
use nalgebra::Vector3;
use pdn_kernel::Node;
use std::sync::Arc;

/// How far a node may be from where the grid has it, in edges of a cube.
const SLACK: f64 = 0.125;

/// The grid is made anew once more than this many nodes, and more than this share of all, are elsewhere.
const LOOSE_NODES: usize = 64;
const LOOSE_SHARE: usize = 16;

/// The grid serves searches of other radii than it was made for as long as they differ by less than this factor.
const OTHER_EDGE: f64 = 1.25;

/// Rounding of a place's coordinates and of nanometres, m.
const ROUNDING_M: f64 = 1e-8;

/// Places of nodes 0, 1, ...
#[derive(Debug)]
pub(crate) struct Places {
    now: Vec<Vector3<f64>>,
    sorted: Arc<Sorted>,
    /// By node, whether it is in `loose` instead.
    is_loose: Vec<bool>,
    loose: Grid,
}

/// Places as they were when they were sorted, by node.
#[derive(Debug)]
pub(crate) struct Sorted {
    then: Vec<Vector3<f64>>,
    grid: Grid,
}

impl Places {
    /// `edge_m` is about the radius of the searches to come (one metre if it is no length), `before` what was sorted for
    /// an earlier state, or for a later one.
    ///
    /// Cost: a comparison for each node, and sorting those that have moved.
    pub(crate) fn new(now: Vec<Vector3<f64>>, edge_m: f64, before: Option<Arc<Sorted>>) -> Places {
        let edge_m = if edge_m.is_finite() && edge_m > 0.0 { edge_m } else { 1.0 };
        let sorted = before.filter(|sorted| is_like(sorted.grid.edge_m(), edge_m));
        let found = sorted.map(|sorted| (sorted.loose(&now), sorted));
        let few = |is_loose: &[bool]| {
            let count = is_loose.iter().filter(|loose| **loose).count();
            count <= LOOSE_NODES.max(now.len() / LOOSE_SHARE)
        };
        let (is_loose, sorted) = found.filter(|(is_loose, _)| few(is_loose)).unwrap_or_else(|| {
            let grid = Grid::new((0..).map(Node).zip(now.iter().copied()), edge_m);
            (vec![false; now.len()], Arc::new(Sorted { then: now.clone(), grid }))
        });
        let places = (0..).map(Node).zip(now.iter().copied());
        let loose = Grid::new(places.filter(|(node, _)| is_loose[node.index()]), edge_m);
        Places { now, sorted, is_loose, loose }
    }

    /// What a later state may begin with.
    pub(crate) fn sorted(&self) -> Arc<Sorted> {
        Arc::clone(&self.sorted)
    }

    /// Where each node is.
    pub(crate) fn now(&self) -> &[Vector3<f64>] {
        &self.now
    }

    /// The nearest node, of those at its distance to the nanometre the one of least `rank`; none without nodes.
    pub(crate) fn nearest(&self, place: &Vector3<f64>, rank: impl Fn(Node) -> u64) -> Option<Node> {
        let mut reach_m = self.sorted.grid.edge_m();
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
        let distance = |node: Node| nanometres((self.now[node.index()] - place).norm());
        (0..self.now.len() as u32).map(Node).min_by_key(|&node| (distance(node), rank(node)))
    }

    /// Shows every node within `reach_m`, and some that are farther, in no order, each with its distance.
    pub(crate) fn visit(&self, place: &Vector3<f64>, reach_m: f64, mut show: impl FnMut(Node, f64)) {
        let mut tell = |node: Node| show(node, (self.now[node.index()] - place).norm());
        let slack_m = self.sorted.slack_m();
        self.sorted.grid.visit(place, reach_m + slack_m, |node| {
            if self.is_loose.get(node.index()) == Some(&false) {
                tell(node);
            }
        });
        self.loose.visit(place, reach_m, tell);
    }
}

impl Sorted {
    /// How far a node may have gone, m.
    fn slack_m(&self) -> f64 {
        SLACK * self.grid.edge_m()
    }

    /// For each place whether its node is not within the slack of where it was.
    fn loose(&self, now: &[Vector3<f64>]) -> Vec<bool> {
        // A little is left for rounding.
        let limit_m = 0.99 * self.slack_m();
        let is_near = |(place, then): (&Vector3<f64>, &Vector3<f64>)| {
            (place - then).norm_squared() <= limit_m * limit_m
        };
        let mut is_loose: Vec<bool> = now.iter().zip(&self.then).map(|pair| !is_near(pair)).collect();
        is_loose.resize(now.len(), true);
        is_loose
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

    fn within(places: &Places, place: &Vector3<f64>, radius_m: f64) -> Vec<(Node, f64)> {
        let mut near: Vec<(Node, f64)> = Vec::new();
        places.visit(place, radius_m + ROUNDING_M, |node, distance_m| near.push((node, distance_m)));
        near.retain(|&(_, distance_m)| nanometres(distance_m) <= nanometres(radius_m));
        near.sort_unstable_by_key(|&(node, _)| node);
        near
    }

    /// What searches find is what a look at each point finds, bit for bit.
    fn check(places: &Places, asked: &[Vector3<f64>]) {
        let rank = |node: Node| u64::from(node.0) * 7919 % 10007;
        for place in asked {
            let distances = || (0..).map(Node).zip(places.now.iter().map(|point| (point - place).norm()));
            for radius_m in [0.0, 0.4, 1.0, 30.0, f64::INFINITY] {
                let near = distances().filter(|&(_, far_m)| nanometres(far_m) <= nanometres(radius_m));
                assert_eq!(within(places, place, radius_m), near.collect::<Vec<_>>());
            }
            let nearest = distances().min_by_key(|&(node, far_m)| (nanometres(far_m), rank(node)));
            assert_eq!(places.nearest(place, rank), nearest.map(|(node, _)| node));
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
                check(&Places::new(places.clone(), edge_m, None), &asked);
            }
        }
    }

    /// Places on a lattice, so that there are ties; they come, go, creep and jump, and the edge changes.
    #[test]
    fn it_finds_the_same_whatever_it_begins_with() {
        let mut share = drawn(5);
        let mut now: Vec<Vector3<f64>> = Vec::new();
        let mut kept: Option<Arc<Sorted>> = None;
        let (mut loose, mut sorted_anew) = (0, 0);
        for step in 0..120 {
            let jumps = if step % 20 == 19 { 0.9 } else { 0.02 };
            for place in &mut now {
                let far_m = if share() < jumps { 1.0 } else { 0.02 };
                *place += Vector3::from_fn(|_, _| far_m * (share() - 0.5));
            }
            now.truncate(if step % 31 == 30 { now.len() - 3 } else { now.len() });
            now.extend((0..4).map(|_| Vector3::from_fn(|_, _| 0.5 * (share() * 14.0).floor())));
            let edge_m = 1.0 + 0.3 * share();
            let before = kept.take();
            let places = Places::new(now.clone(), edge_m, before.clone());
            loose += places.is_loose.iter().filter(|loose| **loose).count();
            sorted_anew += usize::from(before.is_none_or(|before| !Arc::ptr_eq(&before, &places.sorted)));
            let asked: Vec<Vector3<f64>> = now
                .iter()
                .copied()
                .step_by(7)
                .chain((0..10).map(|at| Vector3::repeat(0.25 * at as f64)))
                .collect();
            check(&places, &asked);
            kept = Some(places.sorted());
        }
        assert!(loose > 1000 && (3..60).contains(&sorted_anew), "{loose} loose, sorted {sorted_anew} times");
    }
}
