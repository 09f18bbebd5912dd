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
    /// Fronts on the longest path down to a leaf, this one not counted: less than the parent's.
    pub level: u32,
}

/// A front after its elimination.
#[derive(Clone, Debug)]
pub(super) struct Front {
    pub shape: Arc<Shape>,
    /// L11 (lower triangle) over L21, column-major, columns `dense::leading` apart.
    pub factor: Vec<f64>,
    /// What the separator's rows and columns gain in the parent, packed.
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
    /// A front of this shape that is not eliminated yet.
    pub(super) fn new(shape: Arc<Shape>) -> Front {
        Front { shape, factor: Vec::new(), update: Vec::new(), right: Vec::new() }
    }

    /// Puts the front together from the system and its children, and eliminates it. After an error it is what
    /// it was.
    pub(super) fn eliminate<'a>(
        &mut self,
        system: &BlockSystem,
        children: impl Iterator<Item = &'a Front> + Clone,
        assembly: &mut Assembly,
    ) -> Result<(), KernelError> {
        let shape = &self.shape;
        let assemble = |assembly: &mut Assembly| {
            assembly.add_system(system, &shape.frontal);
            for child in children.clone() {
                assembly.add_update(&child.shape.separator, &child.update);
                assembly.add_right(&child.shape.separator, &child.right[child.shape.frontal_rows()..]);
            }
        };
        let ids = shape.frontal.iter().chain(&shape.separator).copied();
        assembly.begin(ids, shape.frontal.len(), system.len());
        assemble(assembly);
        assembly
            .eliminate(assemble)
            .map_err(|(id, pivot)| KernelError::NotPositiveDefinite { node: Node(id), pivot })?;
        refill(&mut self.right, assembly.forward());
        refill(&mut self.factor, assembly.factor());
        self.update.clear();
        assembly.copy_update(&mut self.update);
        Ok(())
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        let numbers = self.factor.len() + self.update.len() + self.right.len();
        let ids = self.shape.frontal.len() + self.shape.separator.len() + self.shape.children.len();
        numbers * size_of::<f64>() + ids * size_of::<u32>() + size_of::<Front>() + size_of::<Shape>()
    }
}

/// The same values in the memory that is there.
fn refill(buffer: &mut Vec<f64>, values: &[f64]) {
    buffer.clear();
    buffer.extend_from_slice(values);
}
