//! Nested dissection: the order of elimination that keeps the tree flat.

use super::graph::Graph;
use super::separator::{BETWEEN, LEFT, RIGHT};
use super::{bisection, minimum_degree};

/// Parts of no more vertices are ordered by minimum degree. Measured on surveys of 10,000 keyframes: larger
/// parts save time, and beyond 200 the tree grows tall.
const LEAF: usize = 200;
/// Neighbours outside a leaf that are counted in its degrees, at most.
const HALO: usize = 176;

const OUTSIDE: u32 = u32::MAX;

/// An elimination order of the graph's vertices, `last` (if any) at its end. Deterministic.
///
/// A part's separator is eliminated after both of its sides; small parts are ordered by minimum degree with
/// their outer neighbours counted. Parts wait on a list of their own, so depth costs no stack.
/// Cost: O(E log N).
pub(crate) fn order(graph: &Graph, last: Option<u32>) -> Vec<u32> {
    let all: Vec<u32> = (0..graph.len() as u32).filter(|&vertex| Some(vertex) != last).collect();
    let mut order = vec![OUTSIDE; graph.len()];
    if let (Some(last), Some(end)) = (last, order.last_mut()) {
        *end = last;
    }
    let mut local = vec![OUTSIDE; graph.len()];
    let mut parts = vec![(all, 0)];
    while let Some((part, start)) = parts.pop() {
        if part.len() <= LEAF {
            let places = order_leaf(graph, &part, &mut local);
            for (offset, &place) in places.iter().enumerate() {
                order[start + offset] = part[place as usize];
            }
            continue;
        }
        let division = bisection::bisect(&subgraph(graph, &part, &mut local));
        let side = |wanted: u8| -> Vec<u32> {
            part.iter()
                .zip(&division)
                .filter(|&(_, &place)| place == wanted)
                .map(|(&vertex, _)| vertex)
                .collect()
        };
        let (left, right, between) = (side(LEFT), side(RIGHT), side(BETWEEN));
        let between_start = start + left.len() + right.len();
        if left.is_empty() || right.is_empty() {
            // A clique, say: it has no separator, and any order is as good.
            for (offset, &vertex) in left.iter().chain(&right).chain(&between).enumerate() {
                order[start + offset] = vertex;
            }
            continue;
        }
        for (offset, &vertex) in between.iter().enumerate() {
            order[between_start + offset] = vertex;
        }
        let right_start = start + left.len();
        parts.push((left, start));
        parts.push((right, right_start));
    }
    order
}

/// The part's own vertices and edges. `local` is all `OUTSIDE` before and after.
fn subgraph(graph: &Graph, part: &[u32], local: &mut [u32]) -> Graph {
    for (place, &vertex) in part.iter().enumerate() {
        local[vertex as usize] = place as u32;
    }
    let mut offsets = vec![0];
    let mut targets = Vec::new();
    for &vertex in part {
        let inside = graph.neighbours(vertex).iter().map(|&neighbour| local[neighbour as usize]);
        targets.extend(inside.filter(|&place| place != OUTSIDE));
        offsets.push(targets.len() as u32);
    }
    for &vertex in part {
        local[vertex as usize] = OUTSIDE;
    }
    Graph::unweighted(offsets, targets)
}

fn order_leaf(graph: &Graph, part: &[u32], local: &mut [u32]) -> Vec<u32> {
    for (place, &vertex) in part.iter().enumerate() {
        local[vertex as usize] = place as u32;
    }
    let mut halo: Vec<u32> = Vec::new();
    let mut edges = Vec::new();
    for (place, &vertex) in part.iter().enumerate() {
        for &neighbour in graph.neighbours(vertex) {
            if local[neighbour as usize] == OUTSIDE {
                if halo.len() == HALO {
                    continue;
                }
                local[neighbour as usize] = (part.len() + halo.len()) as u32;
                halo.push(neighbour);
            }
            edges.push((place as u32, local[neighbour as usize]));
        }
    }
    for &vertex in part.iter().chain(&halo) {
        local[vertex as usize] = OUTSIDE;
    }
    minimum_degree::order(part.len(), part.len() + halo.len(), edges.into_iter())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(columns: u32, rows: u32) -> Graph {
        let mut offsets = vec![0];
        let mut targets = Vec::new();
        for row in 0..rows {
            for column in 0..columns {
                let at = row * columns + column;
                if column > 0 {
                    targets.push(at - 1);
                }
                if column + 1 < columns {
                    targets.push(at + 1);
                }
                if row > 0 {
                    targets.push(at - columns);
                }
                if row + 1 < rows {
                    targets.push(at + columns);
                }
                offsets.push(targets.len() as u32);
            }
        }
        Graph::unweighted(offsets, targets)
    }

    #[test]
    fn an_order_is_a_permutation_with_the_last_vertex_last() {
        let graph = grid(40, 30);
        let order = order(&graph, Some(17));
        assert_eq!(order.last(), Some(&17));
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..1200));
    }

    #[test]
    fn a_long_grid_is_cut_across() {
        // The least balanced separator of a 100 x 5 grid is a column of 5.
        let division = bisection::bisect(&grid(100, 5));
        let between = division.iter().filter(|&&place| place == BETWEEN).count();
        assert!(between <= 6, "{between}");
    }

    #[test]
    fn a_clique_is_ordered_too() {
        let offsets = (0..=60).map(|vertex| vertex * 59).collect();
        let targets = (0..60).flat_map(|vertex| (0..60).filter(move |&other| other != vertex)).collect();
        assert_eq!(order(&Graph::unweighted(offsets, targets), None).len(), 60);
    }
}
