//! The normal equations Lambda x = b as 6x6 blocks, before any elimination.

use nalgebra::{Matrix6, Vector6};

use crate::{Node, SharedVec};

/// The information matrix and right-hand side of a graph of nodes, by blocks.
///
/// Lambda has a 6x6 diagonal block for each node and a block for each pair of nodes that share a
/// factor. Cloning is cheap; blocks are shared until they change.
#[derive(Clone, Debug, Default)]
pub struct BlockSystem {
    diagonal: SharedVec<Diagonal>,
    neighbours: SharedVec<Vec<Neighbour>>,
    /// Block of each pair: rows of the lower node, columns of the higher.
    edges: SharedVec<Matrix6<f64>>,
}

/// What a node has on its own.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Diagonal {
    pub block: Matrix6<f64>,
    pub rhs: Vector6<f64>,
}

/// A pair's other node, and where the pair's block is.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Neighbour {
    pub node: u32,
    pub edge: u32,
}

impl BlockSystem {
    /// A system of no nodes.
    pub fn new() -> BlockSystem {
        BlockSystem::default()
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.diagonal.len()
    }

    /// True if there is no node yet.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Appends a node with zero blocks.
    pub fn add_node(&mut self) -> Node {
        self.diagonal.push(Diagonal { block: Matrix6::zeros(), rhs: Vector6::zeros() });
        self.neighbours.push(Vec::new());
        Node(u32::try_from(self.len() - 1).expect("fewer than 2^32 nodes"))
    }

    /// Adds to a node's diagonal block and right-hand side.
    pub fn add_diagonal(&mut self, node: Node, block: &Matrix6<f64>, rhs: &Vector6<f64>) {
        let own = &mut self.diagonal[node.0 as usize];
        own.block += block;
        own.rhs += rhs;
    }

    /// Adds to the block of two different nodes, rows of `first`, columns of `second`. True if the pair is
    /// new.
    pub fn add_cross(&mut self, first: Node, second: Node, block: &Matrix6<f64>) -> bool {
        let found = self.edge(first, second);
        let edge = found.unwrap_or_else(|| {
            let edge = u32::try_from(self.edges.len()).expect("fewer than 2^32 pairs");
            self.edges.push(Matrix6::zeros());
            self.neighbours[first.0 as usize].push(Neighbour { node: second.0, edge });
            self.neighbours[second.0 as usize].push(Neighbour { node: first.0, edge });
            edge
        });
        let sum = &mut self.edges[edge as usize];
        if first < second {
            *sum += block;
        } else {
            *sum += block.transpose();
        }
        found.is_none()
    }

    /// The right-hand side of a node.
    pub fn right_hand_side(&self, node: Node) -> &Vector6<f64> {
        &self.diagonal(node.0).rhs
    }

    /// All blocks of the lower node's rows and the higher node's columns, the diagonal ones included.
    pub fn blocks(&self) -> impl Iterator<Item = (Node, Node, Matrix6<f64>)> + '_ {
        (0..self.len() as u32).flat_map(move |node| {
            let later = self.neighbours(node).iter().filter(move |neighbour| neighbour.node > node);
            let pairs = later
                .map(move |neighbour| (Node(node), Node(neighbour.node), *self.edge_block(neighbour.edge)));
            std::iter::once((Node(node), Node(node), self.diagonal(node).block)).chain(pairs)
        })
    }

    /// Sets a node's diagonal block and right-hand side to zero.
    pub(crate) fn clear_diagonal(&mut self, node: u32) {
        self.diagonal[node as usize] = Diagonal { block: Matrix6::zeros(), rhs: Vector6::zeros() };
    }

    /// Sets the block of each pair that this node is in to zero.
    pub(crate) fn clear_cross(&mut self, node: u32) {
        for place in 0..self.neighbours[node as usize].len() {
            let edge = self.neighbours[node as usize][place].edge;
            self.edges[edge as usize] = Matrix6::zeros();
        }
    }

    pub(crate) fn diagonal(&self, node: u32) -> &Diagonal {
        &self.diagonal[node as usize]
    }

    pub(crate) fn neighbours(&self, node: u32) -> &[Neighbour] {
        &self.neighbours[node as usize]
    }

    /// Rows of the lower node, columns of the higher.
    pub(crate) fn edge_block(&self, edge: u32) -> &Matrix6<f64> {
        &self.edges[edge as usize]
    }

    /// Bytes held by the blocks.
    pub(crate) fn bytes(&self) -> usize {
        self.diagonal.len() * size_of::<Diagonal>()
            + self.edges.len() * (size_of::<Matrix6<f64>>() + 2 * size_of::<Neighbour>())
    }

    fn edge(&self, first: Node, second: Node) -> Option<u32> {
        let (few, other) = {
            let (at_first, at_second) = (self.neighbours(first.0), self.neighbours(second.0));
            if at_first.len() <= at_second.len() { (at_first, second) } else { (at_second, first) }
        };
        few.iter().find(|neighbour| neighbour.node == other.0).map(|neighbour| neighbour.edge)
    }
}
