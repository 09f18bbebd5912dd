//! A front of the elimination tree with its numbers.

use std::sync::Arc;

use super::assembly::Assembly;
use super::system::BlockSystem;
use crate::KernelError;
use crate::Node;

/// Which nodes a front eliminates and what it is joined to. It does not change while the front exists.
#[derive(Debug)]
pub(super) struct Shape {
    /// Nodes eliminated here, in elimination order.
    pub frontal: Vec<u32>,
    /// Nodes eliminated later that the eliminated ones are joined to.
    pub separator: Vec<u32>,
    /// Fronts directly below.
    pub children: Vec<u32>,
    /// Fronts on the longest way down to a leaf, this one not counted: less than the parent's.
    pub level: u32,
}

/// A front after its elimination.
#[derive(Clone, Debug)]
pub(super) struct Front {
    pub shape: Arc<Shape>,
    /// L11 (lower triangle) over L21, column-major.
    pub factor: Vec<f64>,
    /// What the separator's rows and columns gain in the parent: square, column-major, lower triangle valid.
    pub update: Vec<f64>,
    /// y = L11^-1 b, then what the separator's right-hand side gains.
    pub right: Vec<f64>,
}

impl Shape {
    /// Scalar rows of the whole front.
    pub(super) fn rows(&self) -> usize {
        6 * (self.frontal.len() + self.separator.len())
    }

    /// Scalar rows eliminated here.
    pub(super) fn frontal_rows(&self) -> usize {
        6 * self.frontal.len()
    }

    /// Floating point operations of eliminating this front.
    pub(super) fn flops(&self) -> f64 {
        let (p, q) = (self.frontal_rows() as f64, 6.0 * self.separator.len() as f64);
        p * p * p / 3.0 + p * p * q + p * q * q
    }
}

impl Front {
    /// Puts a front together from the system and its children, and eliminates it.
    pub(super) fn eliminate<'a>(
        shape: Arc<Shape>,
        system: &BlockSystem,
        children: impl Iterator<Item = &'a Front> + Clone,
        assembly: &mut Assembly,
    ) -> Result<Front, KernelError> {
        let put_together = |assembly: &mut Assembly| {
            assembly.add_system(system, &shape.frontal);
            for child in children.clone() {
                assembly.add_update(&child.shape.separator, &child.update);
            }
        };
        let ids = shape.frontal.iter().chain(&shape.separator).copied();
        assembly.begin(ids, shape.frontal.len(), system.len());
        put_together(assembly);
        for child in children.clone() {
            assembly.add_right(&child.shape.separator, &child.right[child.shape.frontal_rows()..]);
        }
        assembly
            .eliminate(put_together)
            .map_err(|(id, pivot)| KernelError::NotPositiveDefinite { node: Node(id), pivot })?;
        let right = assembly.forward().to_vec();
        let factor = assembly.factor().to_vec();
        let mut update = Vec::with_capacity(36 * shape.separator.len() * shape.separator.len());
        assembly.copy_update(&mut update);
        Ok(Front { shape, factor, update, right })
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        let numbers = self.factor.len() + self.update.len() + self.right.len();
        let ids = self.shape.frontal.len() + self.shape.separator.len() + self.shape.children.len();
        numbers * size_of::<f64>() + ids * size_of::<u32>() + size_of::<Front>() + size_of::<Shape>()
    }
}
