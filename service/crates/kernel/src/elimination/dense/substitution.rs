//! Forward and backward substitution through a front's factor, a block column at a time.

use pulp::{Arch, Simd, WithSimd};

use super::{WIDEST, leading};

const BLOCK: usize = 6;

/// Forward substitution (`factor` is L11 over L21, `rows` x `frontal`): `right[..frontal]` becomes y = L11^-1 b, the rest
/// loses L21 y. `right` is as long as a column of the factor.
pub(in crate::elimination) fn forward(factor: &[f64], rows: usize, right: &mut [f64]) {
    debug_assert_eq!(right.len(), leading(rows));
    Arch::new().dispatch(Forward { factor, right });
}

/// Backward substitution: x = L11^-T (y - L21^T x_separator), where `y` has a scalar for each eliminated row.
/// On entry `solution`, as long as a column of the factor, holds the separator's values and zeros else; on return x before
/// them.
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

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Backward { factor, y, solution } = self;
        let leading = solution.len();
        for (block, columns) in factor.chunks_exact(BLOCK * leading).enumerate().rev() {
            let column = BLOCK * block;
            let (before, known) = solution.split_at_mut(column + BLOCK);
            let below = below(columns, leading, column + BLOCK, known.len());
            let products = inner_products(&below, known);
            for here in (0..BLOCK).rev() {
                let mut value = y[column + here] - products[here];
                let entries = &columns[here * leading..];
                for later in here + 1..BLOCK {
                    value = (-entries[column + later]).mul_add(before[column + later], value);
                }
                before[column + here] = value / entries[column + here];
            }
        }
    }
}

/// The rows from `row` on of each column of a block column; `count` of them.
#[inline(always)]
fn below(columns: &[f64], leading: usize, row: usize, count: usize) -> [&[f64]; BLOCK] {
    std::array::from_fn(|of| &columns[of * leading + row..][..count])
}

/// Inner products of six columns with one, each in as many partial sums as the widest vector has scalars, whatever the
/// width of the processor's.
#[inline(always)]
fn inner_products(columns: &[&[f64]; BLOCK], known: &[f64]) -> [f64; BLOCK] {
    let mut sums = [[0.0_f64; WIDEST]; BLOCK];
    let whole = known.len() / WIDEST * WIDEST;
    let mut at = 0;
    while at < whole {
        let values = &known[at..at + WIDEST];
        for of in 0..BLOCK {
            let entries = &columns[of][at..at + WIDEST];
            for lane in 0..WIDEST {
                sums[of][lane] = entries[lane].mul_add(values[lane], sums[of][lane]);
            }
        }
        at += WIDEST;
    }
    let mut products = [0.0_f64; BLOCK];
    for of in 0..BLOCK {
        for lane in 0..WIDEST {
            products[of] += sums[of][lane];
        }
        for row in whole..known.len() {
            products[of] = columns[of][row].mul_add(known[row], products[of]);
        }
    }
    products
}
