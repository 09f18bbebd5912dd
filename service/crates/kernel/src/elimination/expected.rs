//! Expected covariance of a path: only the fronts it touches are eliminated again.

use nalgebra::Matrix6;

use super::assembly::Assembly;
use super::attachment::Attachment;
use super::contribution::Contribution;
use super::homes::TOP;
use super::system::BlockSystem;
use super::tree::Tree;
use super::update_stack::UpdateStack;
use super::variables::Variables;
use super::virtual_path::{LinkWeight, VirtualPath};
use super::{along, positive_definite};
use crate::{KernelError, Node};

/// Buffers that expected covariances are computed in; one a thread, reused from call to call.
#[derive(Debug, Default)]
pub struct Workspace {
    pub(super) attachment: Attachment,
    pub(super) record: along::Record,
    assembly: Assembly,
    updates: UpdateStack,
    flops: f64,
}

/// What is needed of the elimination.
#[derive(Clone, Copy)]
pub(super) struct Ground<'a> {
    pub tree: &'a Tree,
    pub system: &'a BlockSystem,
}

impl Workspace {
    /// Floating point operations of all eliminations in this workspace so far.
    pub fn flops(&self) -> f64 {
        self.flops
    }

    /// Covariance of the terminal node of the path that is attached, its links weighed so; the last front that is
    /// eliminated holds it last, and its pivot is the answer. With `record` the factors of all touched fronts are kept.
    pub(super) fn terminal(
        &mut self,
        ground: Ground,
        path: &VirtualPath,
        weight: LinkWeight,
        record: bool,
    ) -> Result<Matrix6<f64>, KernelError> {
        self.record.clear();
        self.updates.clear();
        let variables = self.attachment.variables(ground.system.len() as u32);
        let contribution = Contribution::new(&self.attachment, path, weight, variables);
        for index in 0..self.attachment.touched.len() {
            let front = self.attachment.touched[index];
            let below = self.updates.first_below(ground.tree, front);
            let rows = &self.attachment.rows[index];
            let ids = self.attachment.ids[rows.ids.clone()].iter().copied();
            self.assembly.begin(ids, rows.frontal, variables.id_bound());
            let updates = &self.updates;
            let put_together = |assembly: &mut Assembly| {
                contribution.add(assembly, index);
                add_graph(assembly, ground, front, updates, below);
            };
            put_together(&mut self.assembly);
            self.assembly
                .eliminate(put_together)
                .map_err(|(id, pivot)| self.attachment.lost(variables, path, id, pivot))?;
            self.flops += self.assembly.flops();
            self.updates.replace(below, front, &self.assembly);
            if record {
                self.record.push(&self.assembly);
            }
        }
        let information = self.assembly.last_pivot();
        Ok(positive_definite::inverse(&information).expect("a pivot that was accepted is positive definite"))
    }
}

/// What a touched front has without the path: its blocks of the system, and the update matrices of its children, those of
/// the touched ones from the stack.
fn add_graph(assembly: &mut Assembly, ground: Ground, front: u32, updates: &UpdateStack, below: usize) {
    if front != TOP {
        let shape = &ground.tree.front(front).shape;
        assembly.add_system(ground.system, &shape.frontal);
        for &child in shape.children.iter().filter(|&&child| !updates.holds(below, child)) {
            let child = ground.tree.front(child);
            assembly.add_update(&child.shape.separator, &child.update);
        }
    }
    for entry in below..updates.len() {
        assembly.add_update(updates.ids(entry), updates.values(entry));
    }
}

impl Attachment {
    /// The error for a row without a pivot.
    fn lost(&self, variables: Variables, path: &VirtualPath, id: u32, pivot: f64) -> KernelError {
        if id < variables.base {
            return KernelError::NotPositiveDefinite { node: Node(id), pivot };
        }
        let place = variables.kept_of(id).map(|kept| self.chain.kept[kept as usize]);
        KernelError::VirtualNotPositiveDefinite { node: place.unwrap_or(path.nodes()), pivot }
    }
}

/// Covariance of the terminal node of a path on which nothing registers: the robot's, carried from node to node.
///
/// With Lambda the information on a node so far, the next one has `second + unary - cross^T (Lambda + first)^-1 cross`.
pub(super) fn terminal_without_links(
    path: &VirtualPath,
    robot_covariance: &Matrix6<f64>,
) -> Result<Matrix6<f64>, KernelError> {
    let lacks = |node| move |pivot| KernelError::VirtualNotPositiveDefinite { node, pivot };
    let mut information = positive_definite::inverse(robot_covariance).map_err(lacks(0))?;
    for node in 0..path.nodes() {
        let step = path.step(node);
        let carried = positive_definite::inverse(&(information + step.first)).map_err(lacks(node))?;
        let unary = &path.unary[path.place_of(node + 1) as usize];
        let kept = step.second + unary - step.cross.tr_mul(&(carried * step.cross));
        information = kept.symmetric_part();
    }
    positive_definite::inverse(&information).map_err(lacks(path.nodes()))
}
