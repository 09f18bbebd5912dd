//! Points sorted into cubes, so that those near a place are found by looking into the cubes around it.
//!
//! Making it is one sort. Searches whose radius is about a cube's edge look into few cubes, which is what keyframes
//! of a survey are asked for; others are right too, at most at the cost of a look at every point.

use crate::distance::nanometres;
use nalgebra::Vector3;
use pdn_kernel::Node;

/// Places of keyframes.
#[derive(Debug)]
pub(crate) struct Grid {
    edge_m: f64,
    /// By cube, then by node.
    points: Vec<Point>,
    /// The cubes of a column have the same first two numbers; ascending.
    columns: Vec<Column>,
}

#[derive(Clone, Copy, Debug)]
struct Point {
    cube: [i64; 3],
    node: Node,
    place: Vector3<f64>,
}

#[derive(Clone, Copy, Debug)]
struct Column {
    place: [i64; 2],
    first: usize,
    end: usize,
}

impl Grid {
    /// The places of nodes 0, 1, ...; `edge_m` is that of a cube, about the radius of the searches to come (one metre if
    /// it is no length).
    pub(crate) fn new(places: impl Iterator<Item = Vector3<f64>>, edge_m: f64) -> Grid {
        let edge_m = if edge_m.is_finite() && edge_m > 0.0 { edge_m } else { 1.0 };
        let point = |(place, node)| Point { cube: cube(&place, edge_m), node: Node(node), place };
        let mut points: Vec<Point> = places.zip(0_u32..).map(point).collect();
        points.sort_unstable_by_key(|point| (point.cube, point.node));
        let mut columns: Vec<Column> = Vec::new();
        for (index, point) in points.iter().enumerate() {
            let [x, y, _] = point.cube;
            match columns.last_mut().filter(|column| column.place == [x, y]) {
                Some(column) => column.end = index + 1,
                None => columns.push(Column { place: [x, y], first: index, end: index + 1 }),
            }
        }
        Grid { edge_m, points, columns }
    }

    /// Nodes within `radius_m` of a place (compared to the nanometre), ascending, each with its distance in metres.
    pub(crate) fn within(&self, place: &Vector3<f64>, radius_m: f64) -> Vec<(Node, f64)> {
        let mut near: Vec<(Node, f64)> = Vec::new();
        self.visit(place, radius_m + 1e-8, |node, distance_m| {
            if nanometres(distance_m) <= nanometres(radius_m) {
                near.push((node, distance_m));
            }
        });
        near.sort_unstable_by_key(|&(node, _)| node);
        near
    }

    /// The least distance of a node from a place, m; none without nodes.
    pub(crate) fn least_distance_m(&self, place: &Vector3<f64>) -> Option<f64> {
        let mut reach_m = self.edge_m;
        loop {
            let mut least_m = f64::INFINITY;
            self.visit(place, reach_m, |_, distance_m| least_m = least_m.min(distance_m));
            // What lies beyond the cubes that were looked into is farther than that.
            if least_m <= reach_m {
                return Some(least_m);
            }
            reach_m *= 2.0;
            if !reach_m.is_finite() {
                let distances = self.points.iter().map(|point| (point.place - place).norm());
                return distances.min_by(f64::total_cmp);
            }
        }
    }

    /// Shows every node within `reach_m`, and some that are farther, with its distance.
    fn visit(&self, place: &Vector3<f64>, reach_m: f64, mut show: impl FnMut(Node, f64)) {
        let reach = Vector3::repeat(reach_m);
        let (low, high) = (cube(&(place - reach), self.edge_m), cube(&(place + reach), self.edge_m));
        let mut look_into = |column: &Column| {
            let points = &self.points[column.first..column.end];
            let below = points.partition_point(|point| point.cube[2] < low[2]);
            for point in points[below..].iter().take_while(|point| point.cube[2] <= high[2]) {
                show(point.node, (point.place - place).norm());
            }
        };
        let strips = high[0].saturating_sub(low[0]);
        if strips as usize >= self.columns.len() {
            let inside =
                |column: &&Column| (0..2).all(|axis| (low[axis]..=high[axis]).contains(&column.place[axis]));
            return self.columns.iter().filter(inside).for_each(look_into);
        }
        for x in low[0]..=high[0] {
            let first = self.columns.partition_point(|column| column.place < [x, low[1]]);
            self.columns[first..]
                .iter()
                .take_while(|column| column.place <= [x, high[1]])
                .for_each(&mut look_into);
        }
    }
}

/// The cube that a place lies in.
fn cube(place: &Vector3<f64>, edge_m: f64) -> [i64; 3] {
    [place.x, place.y, place.z].map(|coordinate| (coordinate / edge_m).floor() as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the search finds is what a look at each point finds, bit for bit.
    #[test]
    fn it_finds_what_a_look_at_every_point_finds() {
        let mut state = 3_u64;
        let mut share = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        for (count, spread_m) in [(0, 1.0), (1, 1.0), (300, 2.0), (300, 40.0), (50, 1e9)] {
            let mut draw = || Vector3::from_fn(|_, _| spread_m * (share() - 0.5));
            let places: Vec<Vector3<f64>> = (0..count).map(|_| draw()).collect();
            let asked: Vec<Vector3<f64>> =
                (0..20).map(|_| draw()).chain(places.iter().copied().take(20)).collect();
            for edge_m in [0.3, 1.0, 50.0, 0.0, f64::NAN] {
                let grid = Grid::new(places.iter().copied(), edge_m);
                for place in &asked {
                    let distances = || places.iter().map(|point| (point - place).norm());
                    for radius_m in [0.0, 0.4, 1.0, 30.0, f64::INFINITY] {
                        let near = (0..).map(Node).zip(distances());
                        let near = near.filter(|&(_, far_m)| nanometres(far_m) <= nanometres(radius_m));
                        assert_eq!(grid.within(place, radius_m), near.collect::<Vec<_>>());
                    }
                    assert_eq!(grid.least_distance_m(place), distances().min_by(f64::total_cmp));
                }
            }
        }
    }
}
