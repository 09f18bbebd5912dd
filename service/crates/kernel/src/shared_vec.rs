//! A vector whose copies share their chunks until one of them changes an element.

use std::ops::{Index, IndexMut};
use std::sync::Arc;

/// Elements a chunk. Larger chunks make a copy of the vector cheaper and the
/// first change after it dearer.
const CHUNK: usize = 64;

/// Grows at its end; cloning costs one reference count a chunk, and the first change
/// of an element after that copies its chunk.
#[derive(Clone, Debug)]
pub struct SharedVec<T> {
    chunks: Vec<Arc<Vec<T>>>,
    length: usize,
}

impl<T> Default for SharedVec<T> {
    fn default() -> Self {
        SharedVec { chunks: Vec::new(), length: 0 }
    }
}

impl<T: Clone> SharedVec<T> {
    /// Number of elements.
    pub fn len(&self) -> usize {
        self.length
    }

    /// Whether there is no element.
    pub fn is_empty(&self) -> bool {
        self.length == 0
    }

    /// Appends an element.
    pub fn push(&mut self, value: T) {
        if self.length.is_multiple_of(CHUNK) {
            self.chunks.push(Arc::new(Vec::with_capacity(CHUNK)));
        }
        let last = self.chunks.last_mut().expect("a chunk was just made if there was none");
        Arc::make_mut(last).push(value);
        self.length += 1;
    }

    /// Appends copies of a value up to this length, if it is shorter.
    pub fn extend_to(&mut self, length: usize, value: &T) {
        while self.length < length {
            self.push(value.clone());
        }
    }

    /// All elements, in order.
    pub fn iter(&self) -> impl Iterator<Item = &T> {
        self.chunks.iter().flat_map(|chunk| chunk.iter())
    }
}

impl<T> Index<usize> for SharedVec<T> {
    type Output = T;

    fn index(&self, index: usize) -> &T {
        &self.chunks[index / CHUNK][index % CHUNK]
    }
}

impl<T: Clone> IndexMut<usize> for SharedVec<T> {
    fn index_mut(&mut self, index: usize) -> &mut T {
        &mut Arc::make_mut(&mut self.chunks[index / CHUNK])[index % CHUNK]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_copy_keeps_its_elements() {
        let mut vector = SharedVec::default();
        for value in 0..200 {
            vector.push(value);
        }
        let copy = vector.clone();
        vector[70] = -1;
        vector.push(200);
        assert_eq!((vector[70], copy[70]), (-1, 70));
        assert_eq!((vector.len(), copy.len()), (201, 200));
        assert!(copy.iter().copied().eq(0..200));
    }
}
