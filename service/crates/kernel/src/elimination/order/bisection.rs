//! Finds a small, balanced vertex separator of a graph on several levels of coarseness.

use super::graph::Graph;
use super::separator::{BETWEEN, Division, LEFT, RIGHT};

/// Graphs of no more vertices are divided directly.
const COARSEST: usize = 60;
/// Coarsening stops when a level keeps more than this share of its vertices.
const LEAST_REDUCTION: f64 = 0.9;
/// Places to begin growing a side from, on the coarsest graph.
const STARTS: usize = 6;

const UNMATCHED: u32 = u32::MAX;

/// Divides a graph of at least two vertices: for each vertex `LEFT`, `RIGHT` or `BETWEEN`. Deterministic.
///
/// Heavy edges are contracted until the graph is small, a side is grown from several vertices
/// there, and the best division is refined level by level on the way back. Cost: about
/// proportional to the edges.
pub(super) fn bisect(graph: &Graph) -> Vec<u8> {
    let mut coarser: Vec<(Graph, Vec<u32>)> = Vec::new();
    loop {
        let finest = coarser.last().map_or(graph, |(coarse, _)| coarse);
        if finest.len() <= COARSEST {
            break;
        }
        let (coarse, parent) = contract(finest);
        if coarse.len() as f64 > LEAST_REDUCTION * finest.len() as f64 {
            break;
        }
        coarser.push((coarse, parent));
    }
    let coarsest = coarser.last().map_or(graph, |(coarse, _)| coarse);
    let mut division = divide(coarsest);
    while let Some((_, parent)) = coarser.pop() {
        let finer = coarser.last().map_or(graph, |(coarse, _)| coarse);
        let place = parent.iter().map(|&coarse| division.place[coarse as usize]).collect();
        division = Division::new(finer, place);
        division.refine(finer);
    }
    division.place
}

/// Grows a side from several vertices and keeps the best division after refinement.
fn divide(graph: &Graph) -> Division {
    let starts = STARTS.min(graph.len());
    let mut best: Option<Division> = None;
    for index in 0..starts {
        let near = index * graph.len() / starts;
        // Every other start is the far end of its component, where a level set is short.
        let start = if index % 2 == 0 { near as u32 } else { farthest(graph, near as u32) };
        let mut division = grow(graph, start);
        division.refine(graph);
        if best.as_ref().is_none_or(|best| division.quality() < best.quality()) {
            best = Some(division);
        }
    }
    best.expect("there is at least one start")
}

fn farthest(graph: &Graph, start: u32) -> u32 {
    *breadth_first(graph, start, graph.total_weight()).last().expect("the start is visited")
}

/// Vertices by distance from `start` until their weight reaches `enough`; jumps to the lowest unvisited
/// vertex where a component ends.
fn breadth_first(graph: &Graph, start: u32, enough: u32) -> Vec<u32> {
    let mut visited = vec![false; graph.len()];
    let mut queue = vec![start];
    visited[start as usize] = true;
    let (mut head, mut weight, mut lowest) = (0, 0, 0);
    while weight < enough {
        if head == queue.len() {
            while lowest < graph.len() && visited[lowest] {
                lowest += 1;
            }
            if lowest == graph.len() {
                break;
            }
            visited[lowest] = true;
            queue.push(lowest as u32);
        }
        let vertex = queue[head];
        head += 1;
        weight += graph.weights[vertex as usize];
        for &neighbour in graph.neighbours(vertex) {
            if !visited[neighbour as usize] {
                visited[neighbour as usize] = true;
                queue.push(neighbour);
            }
        }
    }
    queue.truncate(head);
    queue
}

/// The vertices nearest to `start` up to half of the weight on the left, their outer neighbours between.
fn grow(graph: &Graph, start: u32) -> Division {
    let mut place = vec![RIGHT; graph.len()];
    let left = breadth_first(graph, start, graph.total_weight() / 2);
    for &vertex in &left {
        place[vertex as usize] = LEFT;
    }
    for &vertex in &left {
        for &neighbour in graph.neighbours(vertex) {
            if place[neighbour as usize] == RIGHT {
                place[neighbour as usize] = BETWEEN;
            }
        }
    }
    Division::new(graph, place)
}

/// Contracts a matching of heavy edges. Returns the coarser graph and each vertex's place in it.
fn contract(graph: &Graph) -> (Graph, Vec<u32>) {
    let mut parent = vec![UNMATCHED; graph.len()];
    let mut pairs: Vec<(u32, u32)> = Vec::new();
    for vertex in 0..graph.len() as u32 {
        if parent[vertex as usize] != UNMATCHED {
            continue;
        }
        let mate = graph
            .weighted_neighbours(vertex)
            .filter(|&(neighbour, _)| parent[neighbour as usize] == UNMATCHED)
            .min_by_key(|&(neighbour, edge)| (u32::MAX - edge, graph.weights[neighbour as usize], neighbour))
            .map_or(vertex, |(neighbour, _)| neighbour);
        parent[vertex as usize] = pairs.len() as u32;
        parent[mate as usize] = pairs.len() as u32;
        pairs.push((vertex, mate));
    }
    let mut coarse = Graph { offsets: vec![0], ..Graph::default() };
    let mut slot = vec![UNMATCHED; pairs.len()];
    for (index, &(one, other)) in pairs.iter().enumerate() {
        let start = coarse.targets.len();
        let both = [one, other];
        for &vertex in &both[..if one == other { 1 } else { 2 }] {
            for (neighbour, edge) in graph.weighted_neighbours(vertex) {
                let target = parent[neighbour as usize];
                if target == index as u32 {
                    continue;
                }
                let known = slot[target as usize];
                if known != UNMATCHED && known as usize >= start {
                    coarse.edge_weights[known as usize] += edge;
                } else {
                    slot[target as usize] = coarse.targets.len() as u32;
                    coarse.targets.push(target);
                    coarse.edge_weights.push(edge);
                }
            }
        }
        coarse.offsets.push(coarse.targets.len() as u32);
        let second = if one == other { 0 } else { graph.weights[other as usize] };
        coarse.weights.push(graph.weights[one as usize] + second);
    }
    (coarse, parent)
}
