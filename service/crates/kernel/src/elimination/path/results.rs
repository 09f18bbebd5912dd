//! What the elimination of touched fronts has left, cached from one path to the next.

use crate::elimination::assembly::Assembly;

/// Results by front, for one way of weighing links.
#[derive(Debug, Default)]
pub(super) struct Results {
    fronts: Vec<FrontResult>,
}

/// A touched front with the path's unknowns in it, eliminated.
#[derive(Debug, Default)]
pub(super) struct FrontResult {
    /// Number of the last path that it is true for; 0 for none.
    pub path: u64,
    /// Block rows, those eliminated in it first.
    pub ids: Vec<u32>,
    pub frontal: usize,
    /// How many of its children were touched.
    pub children: usize,
    /// L11 over L21, if it was asked for.
    pub factor: Option<Vec<f64>>,
    /// Update matrix, packed.
    pub update: Vec<f64>,
}

impl Results {
    /// Makes room for fronts with ids below this bound.
    pub(super) fn reserve(&mut self, id_bound: usize) {
        if self.fronts.len() < id_bound {
            self.fronts.resize_with(id_bound, FrontResult::default);
        }
    }

    pub(super) fn front(&self, id: usize) -> &FrontResult {
        &self.fronts[id]
    }

    pub(super) fn front_mut(&mut self, id: usize) -> &mut FrontResult {
        &mut self.fronts[id]
    }
}

impl FrontResult {
    /// Takes over what has just been eliminated, in the memory that is there.
    pub(super) fn take(&mut self, eliminated: &Assembly, children: usize, with_factor: bool) {
        self.ids.clear();
        self.ids.extend_from_slice(eliminated.ids());
        self.frontal = eliminated.frontal_rows() / 6;
        self.children = children;
        self.update.clear();
        eliminated.copy_update(&mut self.update);
        if with_factor {
            let factor = self.factor.get_or_insert_default();
            factor.clear();
            factor.extend_from_slice(eliminated.factor());
        } else {
            self.factor = None;
        }
    }

    /// Block rows that are eliminated later.
    pub(super) fn separator(&self) -> &[u32] {
        &self.ids[self.frontal..]
    }
}
