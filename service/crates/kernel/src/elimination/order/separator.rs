//! Improves a vertex separator by moves of single vertices (Fiduccia and Mattheyses).

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::graph::Graph;

/// Where a vertex is: on one of two sides, or between them.
pub(super) const LEFT: u8 = 0;
pub(super) const RIGHT: u8 = 1;
pub(super) const BETWEEN: u8 = 2;

/// No side may weigh more than this share of the whole.
const GREATEST_SHARE: f64 = 0.6;
/// Passes over one separator at most.
const PASSES: usize = 2;
/// A pass ends after so many moves without improvement.
const MAX_STALLED_MOVES: usize = 40;

/// A division of a graph's vertices into two sides and a separator: no edge joins the sides.
#[derive(Clone, Debug)]
pub(super) struct Division {
    pub place: Vec<u8>,
    /// Weights of left, right and separator.
    pub weights: [u32; 3],
}

impl Division {
    pub(super) fn new(graph: &Graph, place: Vec<u8>) -> Division {
        let mut weights = [0; 3];
        for (vertex, &at) in place.iter().enumerate() {
            weights[at as usize] += graph.weights[vertex];
        }
        Division { place, weights }
    }

    /// Smaller is better: first an admissible balance, then a light separator, then balance.
    pub(super) fn quality(&self) -> (u32, u32, u32) {
        let [left, right, between] = self.weights;
        let excess = left.max(right).saturating_sub(limit(left + right + between));
        (excess, between, left.abs_diff(right))
    }

    /// Moves single vertices out of the separator while that helps. Deterministic: ties go to the lower
    /// vertex.
    pub(super) fn refine(&mut self, graph: &Graph) {
        for _ in 0..PASSES {
            if !self.pass(graph) {
                break;
            }
        }
    }

    fn pass(&mut self, graph: &Graph) -> bool {
        let limit = limit(self.weights.iter().sum());
        let mut queue = Queue::of(graph.len());
        for vertex in 0..graph.len() as u32 {
            self.enqueue(graph, vertex, &mut queue);
        }
        let start = self.quality();
        let mut best = start;
        let mut locked = vec![false; graph.len()];
        // Each entry is a vertex and the place it had before.
        let mut moves: Vec<(u32, u8)> = Vec::new();
        let mut moves_to_best = 0;
        let mut since_best = 0;
        while since_best < MAX_STALLED_MOVES {
            let Some((gain, Reverse(vertex), side)) = queue.heap.pop() else { break };
            if locked[vertex as usize] || self.place[vertex as usize] != BETWEEN {
                continue;
            }
            if gain != self.gain(graph, vertex, side) {
                continue; // a newer entry of this vertex is in the queue
            }
            let weight = graph.weights[vertex as usize];
            if self.weights[side as usize] + weight > limit
                && self.weights[side as usize] >= self.weights[1 - side as usize]
            {
                continue;
            }
            locked[vertex as usize] = true;
            moves.push((vertex, BETWEEN));
            self.set(graph, vertex, side);
            for &neighbour in graph.neighbours(vertex) {
                if self.place[neighbour as usize] == 1 - side {
                    moves.push((neighbour, 1 - side));
                    self.set(graph, neighbour, BETWEEN);
                    self.enqueue(graph, neighbour, &mut queue);
                    for &second in graph.neighbours(neighbour) {
                        self.enqueue(graph, second, &mut queue);
                    }
                } else {
                    self.enqueue(graph, neighbour, &mut queue);
                }
            }
            let quality = self.quality();
            if quality < best {
                best = quality;
                moves_to_best = moves.len();
                since_best = 0;
            } else {
                since_best += 1;
            }
        }
        for (vertex, before) in moves.drain(moves_to_best..).rev() {
            self.set(graph, vertex, before);
        }
        best < start
    }

    fn set(&mut self, graph: &Graph, vertex: u32, place: u8) {
        let weight = graph.weights[vertex as usize];
        self.weights[self.place[vertex as usize] as usize] -= weight;
        self.weights[place as usize] += weight;
        self.place[vertex as usize] = place;
    }

    /// What the separator loses when the vertex goes to this side.
    fn gain(&self, graph: &Graph, vertex: u32, side: u8) -> i64 {
        let pulled: u32 = graph
            .neighbours(vertex)
            .iter()
            .filter(|&&neighbour| self.place[neighbour as usize] == 1 - side)
            .map(|&neighbour| graph.weights[neighbour as usize])
            .sum();
        i64::from(graph.weights[vertex as usize]) - i64::from(pulled)
    }

    fn enqueue(&self, graph: &Graph, vertex: u32, queue: &mut Queue) {
        if self.place[vertex as usize] != BETWEEN {
            return;
        }
        for side in [LEFT, RIGHT] {
            let gain = self.gain(graph, vertex, side);
            let entered = &mut queue.entered[vertex as usize][side as usize];
            if *entered != Some(gain) {
                *entered = Some(gain);
                queue.heap.push((gain, Reverse(vertex), side));
            }
        }
    }
}

/// Moves by gain, the greatest first, then by vertex. An entry whose gain is no longer true is passed over.
struct Queue {
    heap: BinaryHeap<(i64, Reverse<u32>, u8)>,
    /// The gain with which each vertex was entered last, for either side.
    entered: Vec<[Option<i64>; 2]>,
}

impl Queue {
    fn of(vertices: usize) -> Queue {
        Queue { heap: BinaryHeap::new(), entered: vec![[None; 2]; vertices] }
    }
}

fn limit(total: u32) -> u32 {
    (f64::from(total) * GREATEST_SHARE).ceil() as u32
}
