//! Update matrices of touched fronts, while they wait for their parent.

use super::assembly::Assembly;
use super::tree::Tree;

/// A stack: fronts come children before parents, each subtree in one piece, so that a parent finds the
/// update matrices of its children on top.
#[derive(Debug, Default)]
pub(super) struct UpdateStack {
    ids: Vec<u32>,
    values: Vec<f64>,
    entries: Vec<Entry>,
}

#[derive(Debug)]
struct Entry {
    front: u32,
    first_id: usize,
    first_value: usize,
}

impl UpdateStack {
    pub(super) fn clear(&mut self) {
        self.ids.clear();
        self.values.clear();
        self.entries.clear();
    }

    pub(super) fn len(&self) -> usize {
        self.entries.len()
    }

    /// The first of the entries that wait for this front; they are the last ones.
    pub(super) fn first_below(&self, tree: &Tree, front: u32) -> usize {
        self.entries.iter().rposition(|entry| tree.parent(entry.front) != front).map_or(0, |place| place + 1)
    }

    /// Whether this front's matrix is among the entries from `first` on.
    pub(super) fn holds(&self, first: usize, front: u32) -> bool {
        self.entries[first..].iter().any(|entry| entry.front == front)
    }

    /// Block rows of an entry.
    pub(super) fn ids(&self, entry: usize) -> &[u32] {
        let end = self.entries.get(entry + 1).map_or(self.ids.len(), |next| next.first_id);
        &self.ids[self.entries[entry].first_id..end]
    }

    /// Matrix of an entry.
    pub(super) fn values(&self, entry: usize) -> &[f64] {
        let end = self.entries.get(entry + 1).map_or(self.values.len(), |next| next.first_value);
        &self.values[self.entries[entry].first_value..end]
    }

    /// Drops the entries from `first` on, which have been used, and puts an eliminated front's matrix in their place.
    pub(super) fn replace(&mut self, first: usize, front: u32, eliminated: &Assembly) {
        if let Some(entry) = self.entries.get(first) {
            self.ids.truncate(entry.first_id);
            self.values.truncate(entry.first_value);
        }
        self.entries.truncate(first);
        self.entries.push(Entry { front, first_id: self.ids.len(), first_value: self.values.len() });
        self.ids.extend_from_slice(eliminated.separator());
        eliminated.copy_update(&mut self.values);
    }
}
