//! Undirected graphs with weights, as the orderings see them.

/// Adjacency lists in one array. Each edge stands at both of its ends.
#[derive(Clone, Debug, Default)]
pub(crate) struct Graph {
    /// Vertex v's edges are `offsets[v]..offsets[v + 1]`.
    pub offsets: Vec<u32>,
    pub targets: Vec<u32>,
    /// Number of original edges that an edge stands for; parallel to `targets`.
    pub edge_weights: Vec<u32>,
    /// Number of original vertices that a vertex stands for.
    pub weights: Vec<u32>,
}

impl Graph {
    /// A graph whose vertices and edges all weigh one.
    pub(crate) fn unweighted(offsets: Vec<u32>, targets: Vec<u32>) -> Graph {
        let edge_weights = vec![1; targets.len()];
        let weights = vec![1; offsets.len() - 1];
        Graph { offsets, targets, edge_weights, weights }
    }

    pub(crate) fn len(&self) -> usize {
        self.weights.len()
    }

    pub(crate) fn neighbours(&self, vertex: u32) -> &[u32] {
        &self.targets[self.range(vertex)]
    }

    pub(crate) fn weighted_neighbours(&self, vertex: u32) -> impl Iterator<Item = (u32, u32)> {
        let range = self.range(vertex);
        self.targets[range.clone()].iter().copied().zip(self.edge_weights[range].iter().copied())
    }

    pub(crate) fn total_weight(&self) -> u32 {
        self.weights.iter().sum()
    }

    fn range(&self, vertex: u32) -> std::ops::Range<usize> {
        self.offsets[vertex as usize] as usize..self.offsets[vertex as usize + 1] as usize
    }
}
