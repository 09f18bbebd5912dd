//! Update matrices between fronts: symmetric, of which the lower triangle is kept by block columns.
//!
//! Block column c of s is six columns of the rows from block c on, 6 (s - c) scalars each; the block columns
//! follow one another. So a child's matrix is read in one go, and where its rows lie side by side in the
//! parent they are added as one.

/// Scalars of a matrix of so many block rows.
pub(super) fn len(blocks: usize) -> usize {
    18 * blocks * (blocks + 1)
}

/// Appends the blocks `first..end` of a column-major matrix, its lower triangle.
pub(super) fn append(matrix: &[f64], leading: usize, first: usize, end: usize, into: &mut Vec<f64>) {
    into.reserve(len(end - first));
    for block in first..end {
        for column in 6 * block..6 * block + 6 {
            into.extend_from_slice(&matrix[column * leading..][6 * block..6 * end]);
        }
    }
}

/// Adds a packed matrix to the lower triangle of a column-major one, block row k at block row `places[k]`.
pub(super) fn add(places: &[u32], packed: &[f64], matrix: &mut [f64], leading: usize) {
    let mut rest = packed;
    for (from, &to) in places.iter().enumerate() {
        let height = 6 * (places.len() - from);
        let (columns, after) = rest.split_at(6 * height);
        rest = after;
        add_block_column(&places[from..], columns, height, 6 * to as usize, matrix, leading);
    }
}

fn add_block_column(
    places: &[u32],
    columns: &[f64],
    height: usize,
    column: usize,
    matrix: &mut [f64],
    leading: usize,
) {
    let mut from = 0;
    while from < places.len() {
        let place = places[from];
        // As many rows as lie side by side on the same side of the diagonal.
        let mut end = from + 1;
        while end < places.len() && places[end] == places[end - 1] + 1 && place >= places[0] {
            end += 1;
        }
        let (start, row) = (6 * from, 6 * place as usize);
        if place >= places[0] {
            let target = matrix[column * leading..].chunks_exact_mut(leading);
            for (source, target) in columns.chunks_exact(height).zip(target) {
                let source = &source[start..6 * end];
                for (target, value) in target[row..][..source.len()].iter_mut().zip(source) {
                    *target += value;
                }
            }
        } else {
            // The parent eliminates this row before the column: the block stands mirrored.
            for (offset, source) in columns.chunks_exact(height).enumerate() {
                for (at, value) in source[start..start + 6].iter().enumerate() {
                    matrix[(row + at) * leading + column + offset] += value;
                }
            }
        }
        from = end;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Entry of a symmetric matrix by its rows' numbers in the parent.
    fn entry(one: usize, other: usize) -> f64 {
        (1 + one.min(other) * 100 + one.max(other)) as f64
    }

    #[test]
    fn a_matrix_arrives_where_its_rows_belong_in_any_order() {
        for places in [vec![0, 1, 2], vec![1, 3, 4], vec![3, 0, 1], vec![4, 2, 0]] {
            let row = |local: usize| 6 * places[local / 6] as usize + local % 6;
            let scalars = 6 * places.len();
            let full: Vec<f64> =
                (0..scalars * scalars).map(|at| entry(row(at / scalars), row(at % scalars))).collect();
            let mut update = Vec::new();
            append(&full, scalars, 0, places.len(), &mut update);
            assert_eq!(update.len(), len(places.len()));

            let mut matrix = vec![0.0; 30 * 30];
            add(&places, &update, &mut matrix, 30);
            for (at, &found) in matrix.iter().enumerate() {
                let (column, row) = (at / 30, at % 30);
                let is_there = |row: usize| places.contains(&(row as u32 / 6));
                if row >= column && is_there(row) && is_there(column) {
                    assert_eq!(found, entry(row, column), "{places:?} {row} {column}");
                }
            }
        }
    }
}
