//! The factorisation of large fronts, by faer's blocked kernels.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{
    LltParams, LltRegularization, cholesky_in_place, cholesky_in_place_scratch,
};
use faer::linalg::matmul::triangular::{BlockStructure, matmul};
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::prelude::{Reborrow, ReborrowMut};
use faer::{Accum, Auto, MatMut, Par, Spec};

use super::{is_lost, leading};

/// As [`super::eliminate_large`].
pub(super) fn eliminate(matrix: &mut [f64], rows: usize, frontal: usize, original: &[f64]) -> Option<()> {
    let whole = MatMut::from_column_major_slice_with_stride_mut(matrix, rows, rows, leading(rows));
    let (mut pivot_block, _, mut below, mut rest) = whole.split_at_mut(frontal, frontal);
    let params: Spec<LltParams, f64> = <LltParams as Auto<f64>>::auto().into();
    let mut memory = MemBuffer::new(cholesky_in_place_scratch::<f64>(frontal, Par::Seq, params));
    cholesky_in_place(
        pivot_block.rb_mut(),
        LltRegularization::default(),
        Par::Seq,
        MemStack::new(&mut memory),
        params,
    )
    .ok()?;
    if original.iter().enumerate().any(|(at, &original)| is_lost(pivot_block[(at, at)].powi(2), original)) {
        return None;
    }
    if rows > frontal {
        solve_lower_triangular_in_place(pivot_block.rb(), below.rb_mut().transpose_mut(), Par::Seq);
        matmul(
            rest.rb_mut(),
            BlockStructure::TriangularLower,
            Accum::Add,
            below.rb(),
            BlockStructure::Rectangular,
            below.rb().transpose(),
            BlockStructure::Rectangular,
            -1.0,
            Par::Seq,
        );
    }
    Some(())
}
