//! Exact minimum degree for small graphs, on bit rows.

/// Order in which to eliminate the first `interior` vertices of a small graph.
///
/// The other vertices are a halo: they are eliminated later by someone else, but they count in
/// the degrees. `edges` lists each edge once or twice. Ties go to the lower vertex.
pub(super) fn order(interior: usize, vertices: usize, edges: impl Iterator<Item = (u32, u32)>) -> Vec<u32> {
    let mut rows = BitRows::new(vertices);
    for (one, other) in edges {
        rows.connect(one as usize, other as usize);
    }
    let mut left: Vec<u32> = (0..interior as u32).collect();
    let mut degrees: Vec<u32> = (0..vertices).map(|vertex| rows.count(vertex)).collect();
    let mut order = Vec::with_capacity(interior);
    let mut clique = Vec::new();
    while !left.is_empty() {
        let place =
            (0..left.len()).min_by_key(|&place| degrees[left[place] as usize]).expect("something is left");
        // Removing in place keeps the list ascending, so that ties go to the lower vertex.
        let pivot = left.remove(place) as usize;
        order.push(pivot as u32);
        rows.members(pivot, &mut clique);
        for &member in &clique {
            rows.absorb(member as usize, pivot);
            degrees[member as usize] = rows.count(member as usize);
        }
    }
    order
}

/// A symmetric adjacency matrix, a bit an entry.
struct BitRows {
    words: usize,
    bits: Vec<u64>,
}

impl BitRows {
    fn new(vertices: usize) -> BitRows {
        let words = vertices.div_ceil(64);
        BitRows { words, bits: vec![0; words * vertices] }
    }

    fn row(&self, vertex: usize) -> &[u64] {
        &self.bits[vertex * self.words..(vertex + 1) * self.words]
    }

    fn connect(&mut self, one: usize, other: usize) {
        if one != other {
            self.bits[one * self.words + other / 64] |= 1 << (other % 64);
            self.bits[other * self.words + one / 64] |= 1 << (one % 64);
        }
    }

    fn count(&self, vertex: usize) -> u32 {
        self.row(vertex).iter().map(|word| word.count_ones()).sum()
    }

    fn members(&self, vertex: usize, members: &mut Vec<u32>) {
        members.clear();
        for (index, &word) in self.row(vertex).iter().enumerate() {
            let mut rest = word;
            while rest != 0 {
                members.push(index as u32 * 64 + rest.trailing_zeros());
                rest &= rest - 1;
            }
        }
    }

    /// The neighbours of `pivot` become neighbours of `vertex`; `pivot` and `vertex` itself do not.
    fn absorb(&mut self, vertex: usize, pivot: usize) {
        for word in 0..self.words {
            let from_pivot = self.bits[pivot * self.words + word];
            self.bits[vertex * self.words + word] |= from_pivot;
        }
        self.bits[vertex * self.words + vertex / 64] &= !(1 << (vertex % 64));
        self.bits[vertex * self.words + pivot / 64] &= !(1 << (pivot % 64));
    }
}

#[cfg(test)]
mod tests {
    use super::order;

    #[test]
    fn leaves_of_a_star_come_before_its_centre() {
        let edges = (1..6).map(|leaf| (0, leaf));
        let order = order(6, 6, edges);
        let centre = order.iter().position(|&vertex| vertex == 0).expect("each vertex is ordered");
        assert!(centre >= 4, "{order:?}");
    }

    #[test]
    fn the_halo_counts_but_is_not_ordered() {
        // 0 - 1 - 2 with two halo vertices at 0: its degree is 3, so 2 (degree 1) goes first.
        let order = order(3, 5, [(0, 1), (1, 2), (0, 3), (0, 4)].into_iter());
        assert_eq!(order, vec![2, 1, 0]);
    }
}
