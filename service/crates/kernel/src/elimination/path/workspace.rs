//! The elimination of one path: the fronts that it touches are assembled with its unknowns and eliminated
//! again, the terminal node last. The inverse of the last pivot is Sigma_nn.

use nalgebra::Matrix6;

use super::front_assignment::TOP;
use super::information::PathInformation;
use super::results::{FrontResult, Results};
use super::structure::PathStructure;
use super::variables::Variables;
use super::virtual_path::{LinkWeight, VirtualPath};
use crate::elimination::assembly::Assembly;
use crate::elimination::positive_definite;
use crate::elimination::system::BlockSystem;
use crate::elimination::tree::Tree;
use crate::{KernelError, Node};

/// Buffers that expected covariances are computed in; one a thread, reused from call to call.
#[derive(Debug, Default)]
pub struct Workspace {
    pub(super) structure: PathStructure,
    /// For links by their probabilities, and for all.
    results: [Results; 2],
    /// Number of the path that was analysed last.
    number: u64,
    /// Number of the path whose results may serve again.
    previous: u64,
    assembly: Assembly,
    flops: f64,
}

/// Lambda_0 and its factor.
#[derive(Clone, Copy)]
pub(super) struct Factorization<'a> {
    pub tree: &'a Tree,
    pub system: &'a BlockSystem,
}

impl Workspace {
    /// Floating point operations of all eliminations in this workspace so far.
    pub fn flops(&self) -> f64 {
        self.flops
    }

    /// Analyses a path; `previous` is the one that was analysed before, over the same elimination.
    pub(super) fn analyse(
        &mut self,
        factorization: Factorization,
        path: &VirtualPath,
        previous: Option<&VirtualPath>,
    ) -> Result<(), KernelError> {
        self.previous = if previous.is_some() { self.number } else { 0 };
        self.number += 1;
        self.structure.analyse(factorization.tree, factorization.system.len() as u32, path, previous)
    }

    /// Covariance of the terminal node of the path that was analysed last, with its links weighed so. The
    /// last front that is eliminated holds it last, and its pivot is the answer. With `record` the factors of
    /// all touched fronts are recorded.
    pub(super) fn terminal(
        &mut self,
        factorization: Factorization,
        path: &VirtualPath,
        weight: LinkWeight,
        record: bool,
    ) -> Result<Matrix6<f64>, KernelError> {
        let variables = self.structure.variables(factorization.system.len() as u32);
        let information = PathInformation::new(&self.structure, path, weight, variables);
        let results = &mut self.results[kind(weight)];
        results.reserve(factorization.tree.id_bound() + 1);
        let mut reused = vec![false; self.structure.touched.len()];
        for (index, &front) in self.structure.touched.iter().enumerate() {
            let slot = slot(factorization.tree, front);
            let result = results.front_mut(slot);
            let is_result = result.path == self.previous && self.previous > 0;
            if is_result && self.structure.is_reusable(result, index, variables, &reused, record) {
                result.path = self.number;
                reused[index] = true;
                continue;
            }
            let rows = &self.structure.rows[index];
            let ids = self.structure.ids[rows.ids.clone()].iter().copied();
            self.assembly.begin(ids, rows.frontal, variables.id_bound());
            let assemble = |assembly: &mut Assembly| {
                information.add(assembly, index);
                self.structure.add_graph(assembly, factorization, results, index);
            };
            assemble(&mut self.assembly);
            self.assembly
                .eliminate(assemble)
                .map_err(|(id, pivot)| self.structure.pivot_error(variables, path, id, pivot))?;
            self.flops += self.assembly.flops();
            let children = self.structure.children(index).count();
            let result = results.front_mut(slot);
            result.take(&self.assembly, children, record);
            result.path = self.number;
        }
        Ok(self.assembly.last_covariance())
    }

    /// The result of a touched front with links weighed so.
    pub(super) fn result(&self, tree: &Tree, weight: LinkWeight, index: usize) -> &FrontResult {
        self.results[kind(weight)].front(slot(tree, self.structure.touched[index]))
    }
}

/// Which results a weight's are.
fn kind(weight: LinkWeight) -> usize {
    usize::from(weight == LinkWeight::All)
}

/// Where a front's result is cached.
fn slot(tree: &Tree, front: u32) -> usize {
    if front == TOP { tree.id_bound() } else { front as usize }
}

impl PathStructure {
    /// Whether what a touched front was eliminated to for the path before is true for this one: it has the
    /// same rows, all unknowns in them belong to places that both paths share, and its touched children are
    /// the same and are reused.
    fn is_reusable(
        &self,
        result: &FrontResult,
        index: usize,
        variables: Variables,
        reused: &[bool],
        with_factor: bool,
    ) -> bool {
        let rows = &self.rows[index];
        let ids = &self.ids[rows.ids.clone()];
        let is_shared = |&id: &u32| id <= variables.terminal() || id < self.first_unshared;
        self.touched[index] != TOP
            && (result.factor.is_some() || !with_factor)
            && result.frontal == rows.frontal
            && result.ids == *ids
            && ids.iter().all(is_shared)
            && self.children(index).count() == result.children
            && self.children(index).all(|child| reused[child])
    }

    /// Adds what a touched front has without the path: its blocks of the system, and the update matrices of
    /// its children, of the touched ones with the path.
    fn add_graph(
        &self,
        assembly: &mut Assembly,
        factorization: Factorization,
        results: &Results,
        index: usize,
    ) {
        if self.touched[index] != TOP {
            let shape = &factorization.tree.front(self.touched[index]).shape;
            assembly.add_system(factorization.system, &shape.frontal);
            for &child in shape.children.iter().filter(|&&child| !self.touches(child)) {
                let child = factorization.tree.front(child);
                assembly.add_update(&child.shape.separator, &child.update);
            }
        }
        for child in self.children(index) {
            let child = results.front(self.touched[child] as usize);
            assembly.add_update(child.separator(), &child.update);
        }
    }

    /// The error for a row without a pivot.
    fn pivot_error(&self, variables: Variables, path: &VirtualPath, id: u32, pivot: f64) -> KernelError {
        if id < variables.base {
            return KernelError::NotPositiveDefinite { node: Node(id), pivot };
        }
        let place = variables.retained_of(id).map(|retained| self.chain.retained[retained as usize]);
        KernelError::VirtualNotPositiveDefinite { node: place.unwrap_or(path.nodes()), pivot }
    }
}

/// Covariance of the terminal node of a path on which nothing registers: the robot's, carried from node to
/// node.
///
/// With Lambda the information on a node so far, the next one has `second + unary - cross^T (Lambda +
/// first)^-1 cross`.
pub(super) fn terminal_without_links(
    path: &VirtualPath,
    robot_covariance: &Matrix6<f64>,
) -> Result<Matrix6<f64>, KernelError> {
    let lacks = |node| move |pivot| KernelError::VirtualNotPositiveDefinite { node, pivot };
    let mut information = positive_definite::inverse(robot_covariance).map_err(lacks(0))?;
    for node in 0..path.nodes() {
        let step = path.step(node);
        let carried = positive_definite::inverse(&(information + step.first)).map_err(lacks(node))?;
        let unary = path.unary(node + 1);
        let next = step.second + unary - step.cross.tr_mul(&(carried * step.cross));
        information = next.symmetric_part();
    }
    positive_definite::inverse(&information).map_err(lacks(path.nodes()))
}
