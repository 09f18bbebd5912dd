//! The elimination as its users see it.

use nalgebra::{DMatrix, Matrix6, Vector6};

use super::marginals;
use super::solution::Solution;
use super::system::BlockSystem;
use super::tree::{Tree, TreeScratch};
use super::tree_state::{Ordered, TreeState};
use crate::{KernelError, Node};

/// All nodes are ordered anew once eliminating them costs more than this many times what a good order would
/// cost.
const QUALITY_LOSS: f64 = 2.0;

/// So they are once the tree is higher than this many times what it was when last ordered, and `ROOM_ABOVE`
/// fronts more: every candidate goes along a path to the root. New keyframes come in at the top, where they
/// make a chain.
const HEIGHT_LOSS: u32 = 2;
const ROOM_ABOVE: u32 = 128;

/// How the cost of a good order grows with the number of nodes: that of nested dissection on a surface.
const GROWTH: f64 = 1.5;

/// The information matrix Lambda_0 and its Cholesky factor on a tree of fronts.
///
/// Cloning is cheap: fronts and blocks are shared until one of the copies changes them.
#[derive(Debug, Default)]
pub struct Elimination {
    system: BlockSystem,
    tree: Tree,
    /// The tree when everything was last ordered at once.
    ordered: Ordered,
    scratch: TreeScratch,
}

/// Size and cost of an elimination.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Keyframes.
    pub nodes: usize,
    /// Fronts of the tree.
    pub fronts: usize,
    /// Fronts on the longest path from a leaf to a root.
    pub height: usize,
    /// Scalar rows of the largest front.
    pub largest_front: usize,
    /// Floating point operations of eliminating everything once.
    pub flops: f64,
    /// Bytes held by factors, update matrices and blocks.
    pub bytes: usize,
}

impl Clone for Elimination {
    fn clone(&self) -> Self {
        // Scratch holds nothing between calls; a copy grows its own when it needs it.
        Elimination {
            system: self.system.clone(),
            tree: self.tree.clone(),
            ordered: self.ordered,
            scratch: TreeScratch::default(),
        }
    }
}

impl Elimination {
    /// Eliminates a whole system at once. Errors: [`KernelError::NotPositiveDefinite`].
    pub fn of(system: BlockSystem) -> Result<Elimination, KernelError> {
        let mut elimination = Elimination { system, ..Elimination::default() };
        elimination.rebuild()?;
        Ok(elimination)
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.system.len()
    }

    /// True if there is no node yet.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The blocks before elimination.
    pub fn system(&self) -> &BlockSystem {
        &self.system
    }

    /// The solution x of Lambda x = b for all nodes, in their order.
    pub fn solve(&self) -> Vec<Vector6<f64>> {
        let mut solution = Solution::default();
        for _ in 0..self.len() {
            solution.add_node();
        }
        solution.update(&self.tree, &self.downward(), 0.0);
        (0..self.len() as u32).map(|node| *solution.value(node)).collect()
    }

    /// Covariance of one node, `[rho; phi]`: its 6x6 block of the inverse. Cost: one path to the root.
    /// Errors: [`KernelError::UnknownNode`].
    pub fn marginal(&self, node: Node) -> Result<Matrix6<f64>, KernelError> {
        self.check(node)?;
        Ok(marginals::marginal(&self.tree, node.0))
    }

    /// Covariance of these nodes together, in their order: their rows and columns of the inverse. Cost: the
    /// paths from the nodes to the root. Errors: [`KernelError::UnknownNode`].
    pub fn joint(&self, nodes: &[Node]) -> Result<DMatrix<f64>, KernelError> {
        nodes.iter().try_for_each(|node| self.check(*node))?;
        Ok(marginals::joint(&self.tree, nodes))
    }

    /// Covariance of each node, in their order. Cost: about two eliminations.
    pub fn marginals(&self) -> Vec<Matrix6<f64>> {
        let mut covariances = vec![Matrix6::zeros(); self.len()];
        marginals::marginals(&self.tree, self.len(), None, |node, covariance| {
            covariances[node as usize] = covariance;
        });
        covariances
    }

    /// Covariances of these nodes (ascending, once each), in their order. Cost: the fronts between them and
    /// the roots. Errors: [`KernelError::UnknownNode`].
    pub fn marginals_of(&self, nodes: &[Node]) -> Result<Vec<Matrix6<f64>>, KernelError> {
        nodes.last().map_or(Ok(()), |&last| self.check(last))?;
        let mut covariances = vec![Matrix6::zeros(); nodes.len()];
        marginals::marginals(&self.tree, self.len(), Some(nodes), |node, covariance| {
            if let Ok(place) = nodes.binary_search(&Node(node)) {
                covariances[place] = covariance;
            }
        });
        Ok(covariances)
    }

    /// Size and cost of this elimination. Cost: a visit to each front.
    pub fn statistics(&self) -> Statistics {
        let mut statistics = Statistics {
            nodes: self.len(),
            flops: self.tree.flops(),
            bytes: self.system.bytes(),
            ..Statistics::default()
        };
        for front in self.tree.ids().map(|id| self.tree.front(id)) {
            statistics.fronts += 1;
            statistics.height = statistics.height.max(front.shape.level as usize + 1);
            statistics.largest_front = statistics.largest_front.max(front.shape.rows());
            statistics.bytes += front.bytes();
        }
        statistics
    }

    /// What does not follow from the blocks: the tree.
    pub(crate) fn state(&self) -> TreeState {
        self.tree.state(self.ordered)
    }

    /// Eliminates the whole system on this tree. Errors: [`KernelError::OtherGraph`] for a tree over other
    /// nodes, else as of [`Elimination::of`].
    pub(crate) fn restore(&mut self, state: &TreeState) -> Result<(), KernelError> {
        self.tree = Tree::restore(state, &self.system, &mut self.scratch)?;
        self.ordered = state.ordered;
        Ok(())
    }

    /// The blocks, to be changed; `refresh` or `restructure` must follow.
    pub(crate) fn system_mut(&mut self) -> &mut BlockSystem {
        &mut self.system
    }

    /// Whether nodes were added since the last `restructure`.
    pub(crate) fn has_new_nodes(&self) -> bool {
        !self.new_nodes().is_empty()
    }

    /// Nodes added since the last `restructure`.
    pub(crate) fn new_nodes(&self) -> std::ops::Range<u32> {
        self.tree.nodes() as u32..self.len() as u32
    }

    /// Solves again if steps above a front have moved by more than `prune` since it was solved. Cost: every
    /// front then.
    pub(crate) fn back_substitute(&self, solution: &mut Solution, prune: f64) {
        if solution.has_unpropagated(prune) {
            solution.update(&self.tree, &self.downward(), prune);
        }
    }

    /// All fronts, parents before children.
    fn downward(&self) -> Vec<u32> {
        let mut fronts: Vec<u32> = self.tree.ids().collect();
        fronts.sort_unstable_by_key(|&id| std::cmp::Reverse((self.tree.front(id).shape.level, id)));
        fronts
    }

    /// Follows changed numbers of these nodes, and solves. Returns what was done.
    pub(crate) fn refresh(
        &mut self,
        touched: &[u32],
        solution: &mut Solution,
        prune: f64,
    ) -> Result<Update, KernelError> {
        solution.push_down(&self.tree, &self.tree.upward(touched, &mut self.scratch));
        let fronts = self.tree.refresh(&self.system, touched, &mut self.scratch)?;
        Ok(self.finish(&fronts, solution, prune))
    }

    /// Follows new nodes and new pairs between these nodes, and solves. Everything is ordered anew when
    /// eliminating the tree costs more than `QUALITY_LOSS` times what it cost when last ordered, scaled to
    /// today's size, or when it is more than `HEIGHT_LOSS` times as high and `ROOM_ABOVE`. Returns what was
    /// done.
    pub(crate) fn restructure(
        &mut self,
        touched: &[u32],
        solution: &mut Solution,
        prune: f64,
    ) -> Result<Update, KernelError> {
        solution.push_down(&self.tree, &self.tree.upward(touched, &mut self.scratch));
        let mut fronts = self.tree.restructure(&self.system, touched, &mut self.scratch)?;
        if self.has_deteriorated(&fronts) {
            self.rebuild()?;
            fronts = self.downward();
        }
        Ok(self.finish(&fronts, solution, prune))
    }

    /// Whether ordering everything anew is due; `fronts` were just made, the highest first.
    fn has_deteriorated(&self, fronts: &[u32]) -> bool {
        let Ordered { nodes, flops, height } = self.ordered;
        let growth = (self.len() as f64 / nodes.max(1) as f64).powf(GROWTH);
        self.tree.flops() > QUALITY_LOSS * flops * growth
            || self.height_of(fronts) > HEIGHT_LOSS.saturating_mul(height).saturating_add(ROOM_ABOVE)
    }

    /// Fronts on the longest path up to the first of these.
    fn height_of(&self, fronts: &[u32]) -> u32 {
        fronts.first().map_or(0, |&highest| self.tree.front(highest).shape.level + 1)
    }

    fn rebuild(&mut self) -> Result<(), KernelError> {
        let fronts = self.tree.rebuild(&self.system, &mut self.scratch)?;
        let (nodes, flops, height) = (self.len() as u64, self.tree.flops(), self.height_of(&fronts));
        self.ordered = Ordered { nodes, flops, height };
        Ok(())
    }

    fn finish(&self, fronts: &[u32], solution: &mut Solution, prune: f64) -> Update {
        let eliminated_nodes = fronts.iter().map(|&id| self.tree.front(id).shape.frontal.len()).sum();
        let visited = solution.update(&self.tree, fronts, prune);
        Update { visited, eliminated_fronts: fronts.len(), eliminated_nodes }
    }

    pub(super) fn tree(&self) -> &Tree {
        &self.tree
    }

    /// Errors: [`KernelError::UnknownNode`].
    pub(super) fn check(&self, node: Node) -> Result<(), KernelError> {
        if node.index() < self.len() {
            Ok(())
        } else {
            Err(KernelError::UnknownNode { node, nodes: self.len() })
        }
    }
}

/// What following a change took.
#[derive(Debug)]
pub(crate) struct Update {
    /// Nodes whose value was solved for.
    pub visited: Vec<u32>,
    pub eliminated_fronts: usize,
    pub eliminated_nodes: usize,
}
