//! Points sorted into cubes, so that those near a place are found by looking into the cubes around it.
//!
//! Making it is one sort. Searches whose radius is about a cube's edge look into few cubes, which is what
//! keyframes of a survey are asked for; others are right too, at most at the cost of a look at every point.

use nalgebra::Vector3;
use pdn_kernel::Node;

/// Points where they were when it was made.
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
}

#[derive(Clone, Copy, Debug)]
struct Column {
    place: [i64; 2],
    first: usize,
    end: usize,
}

impl Grid {
    /// The places of some nodes; `edge_m` is that of a cube, above zero, about the radius of the searches to
    /// come.
    pub(crate) fn new(places: impl Iterator<Item = (Node, Vector3<f64>)>, edge_m: f64) -> Grid {
        let point = |(node, place)| Point { cube: cube(&place, edge_m), node };
        let mut points: Vec<Point> = places.map(point).collect();
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

    /// Edge of a cube, m.
    pub(crate) fn edge_m(&self) -> f64 {
        self.edge_m
    }

    /// Shows every node within `reach_m` of a place, and some that are farther, in no order.
    pub(crate) fn visit(&self, place: &Vector3<f64>, reach_m: f64, mut show: impl FnMut(Node)) {
        let reach = Vector3::repeat(reach_m);
        let (low, high) = (cube(&(place - reach), self.edge_m), cube(&(place + reach), self.edge_m));
        let mut look_into = |column: &Column| {
            let points = &self.points[column.first..column.end];
            let below = points.partition_point(|point| point.cube[2] < low[2]);
            for point in points[below..].iter().take_while(|point| point.cube[2] <= high[2]) {
                show(point.node);
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
