//! Forward and backward substitution through a front's factor, a block column at a time.

use pulp::{Arch, Simd, WithSimd};

use super::{WIDEST, leading};

const BLOCK: usize = 6;

/// Forward substitution (`factor` is L11 over L21, `rows` x `frontal`): `right[..frontal]` becomes y = L11^-1
/// b, the rest loses L21 y. `right` is as long as a column of the factor.
pub(in crate::elimination) fn forward(factor: &[f64], rows: usize, right: &mut [f64]) {
    debug_assert_eq!(right.len(), leading(rows));
    Arch::new().dispatch(Forward { factor, right });
}

/// Backward substitution: x = L11^-T (y - L21^T x_separator), where `y` has a scalar for each eliminated row.
/// On entry `solution`, as long as a column of the factor, holds the separator's values and zeros else; on
/// return x before them.
pub(in crate::elimination) fn backward(factor: &[f64], rows: usize, y: &[f64], solution: &mut [f64]) {
    debug_assert_eq!(solution.len(), leading(rows));
    Arch::new().dispatch(Backward { factor, y, solution });
}

struct Forward<'a> {
    factor: &'a [f64],
    right: &'a mut [f64],
}

impl WithSimd for Forward<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Forward { factor, right } = self;
        let leading = right.len();
        for (block, columns) in factor.chunks_exact(BLOCK * leading).enumerate() {
            let column = BLOCK * block;
            let (before, rest) = right.split_at_mut(column + BLOCK);
            let known = &mut before[column..];
            for here in 0..BLOCK {
                let mut value = known[here];
                for left in 0..here {
                    value = (-columns[left * leading + column + here]).mul_add(known[left], value);
                }
                known[here] = value / columns[here * leading + column + here];
            }
            let below = below(columns, leading, column + BLOCK, rest.len());
            for at in 0..rest.len() {
                let mut value = rest[at];
                for left in 0..BLOCK {
                    value = (-below[left][at]).mul_add(known[left], value);
                }
                rest[at] = value;
            }
        }
    }
}

struct Backward<'a> {
    factor: &'a [f64],
    y: &'a [f64],
    solution: &'a mut [f64],
}

impl WithSimd for Backward<'_> {
    type Output = ();

    /// What is not solved yet is zero, so whole vectors of rows are taken, from the one on in which the first
    /// row below the pivot block lies. An even number of rows lies before it in that vector, fewer than a
    /// block.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Backward { factor, y, solution } = self;
        let leading = solution.len();
        for (block, columns) in factor.chunks_exact(BLOCK * leading).enumerate().rev() {
            let column = BLOCK * block;
            let pivot_block: [&[f64]; BLOCK] =
                std::array::from_fn(|here| &columns[here * leading + column..][..BLOCK]);
            // Apart from what waits for one another below, six divisions take little longer than one.
            let reciprocals: [f64; BLOCK] = std::array::from_fn(|here| pivot_block[here][here].recip());
            let aligned = (column + BLOCK) / WIDEST * WIDEST;
            let products =
                inner_products(&below(columns, leading, aligned, leading - aligned), &solution[aligned..]);
            let mut values: [f64; BLOCK] = std::array::from_fn(|here| y[column + here] - products[here]);
            for later in (0..BLOCK).rev() {
                values[later] *= reciprocals[later];
                for here in 0..later {
                    values[here] = (-pivot_block[here][later]).mul_add(values[later], values[here]);
                }
            }
            solution[column..column + BLOCK].copy_from_slice(&values);
        }
    }
}

/// The rows from `row` on of each column of a block column; `count` of them.
#[inline(always)]
fn below(columns: &[f64], leading: usize, row: usize, count: usize) -> [&[f64]; BLOCK] {
    std::array::from_fn(|of| &columns[of * leading + row..][..count])
}

/// Inner products of six columns with one, whole vectors long, each in as many partial sums as the widest
/// vector has scalars, whatever the width of the processor's.
#[inline(always)]
fn inner_products(columns: &[&[f64]; BLOCK], known: &[f64]) -> [f64; BLOCK] {
    let mut sums = [[0.0_f64; WIDEST]; BLOCK];
    for (vector, values) in known.chunks_exact(WIDEST).enumerate() {
        for of in 0..BLOCK {
            let entries = &columns[of][vector * WIDEST..][..WIDEST];
            for lane in 0..WIDEST {
                sums[of][lane] = entries[lane].mul_add(values[lane], sums[of][lane]);
            }
        }
    }
    sums.map(|sums| sums.iter().sum())
}
