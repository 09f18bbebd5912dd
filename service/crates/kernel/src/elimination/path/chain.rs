//! Places at which nothing registers: their nodes are eliminated along the path before anything else.

use nalgebra::Matrix6;

use super::virtual_path::VirtualPath;
use crate::KernelError;
use crate::elimination::positive_definite;
use crate::information::PairInformation;

/// A path of which only the places with links, and the last, are left.
#[derive(Debug, Default)]
pub(super) struct Chain {
    /// Places (1 to m) that are left, ascending; the last is m.
    pub retained: Vec<u32>,
    /// What joins each retained place to the one before it; before the first is place 0.
    pub joins: Vec<Join>,
    /// The places taken out, ascending.
    pub gaps: Vec<Gap>,
}

/// Information between a place (`second`) and the one before it (`first`), seen from the robot: of the nodes
/// of the way out, and of those of the way back.
#[derive(Clone, Copy, Debug)]
pub(super) struct Join {
    pub out: PairInformation,
    pub back: PairInformation,
}

/// A place that was taken out.
#[derive(Debug)]
pub(super) struct Gap {
    pub place: u32,
    /// Index in `retained` of the next retained place.
    pub next_retained: u32,
    pub out: Conditional,
    pub back: Conditional,
}

/// A node that was taken out between node a before it and node b right after it: given those, its mean is
/// -A x_a - B x_b and its covariance `own`.
#[derive(Debug)]
pub(super) struct Conditional {
    own: Matrix6<f64>,
    before: Matrix6<f64>,
    after: Matrix6<f64>,
}

/// Joint covariance of two nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct PairCovariance {
    pub first: Matrix6<f64>,
    /// Rows of the first, columns of the second.
    pub cross: Matrix6<f64>,
    pub second: Matrix6<f64>,
}

impl Chain {
    /// Takes out every place but the last that `is_linked` (by place) does not name.
    pub(super) fn reduce(&mut self, path: &VirtualPath, is_linked: &[bool]) -> Result<(), KernelError> {
        self.retained.clear();
        self.joins.clear();
        self.gaps.clear();
        let step = |place: usize| {
            let steps = path.steps_to(place as u32);
            Join { out: steps.out, back: steps.back.exchanged() }
        };
        let mut join = step(1);
        for (place, &is_linked) in is_linked.iter().enumerate().skip(1) {
            if is_linked || place as u32 == path.last_place() {
                self.joins.push(join);
                self.retained.push(place as u32);
                if (place as u32) < path.last_place() {
                    join = step(place + 1);
                }
                continue;
            }
            let next = step(place + 1);
            let unary = &path.places[place].unary;
            let [out_node, back_node] = path.nodes_at(place as u32).map(Option::unwrap_or_default);
            let (out, out_join) = eliminate(&join.out, unary, &next.out, out_node)?;
            let (back, back_join) = eliminate(&join.back, unary, &next.back, back_node)?;
            join = Join { out: out_join, back: back_join };
            self.gaps.push(Gap { place: place as u32, next_retained: self.retained.len() as u32, out, back });
        }
        Ok(())
    }
}

/// Eliminates a node between two others; returns it and what then joins them.
fn eliminate(
    before: &PairInformation,
    unary: &Matrix6<f64>,
    after: &PairInformation,
    node: u32,
) -> Result<(Conditional, PairInformation), KernelError> {
    let own = positive_definite::inverse(&(before.second + unary + after.first))
        .map_err(|pivot| KernelError::VirtualNotPositiveDefinite { node, pivot })?;
    let to_before = own * before.cross.transpose();
    let to_after = own * after.cross;
    let join = PairInformation {
        first: (before.first - before.cross * to_before).symmetric_part(),
        cross: -before.cross * to_after,
        second: (after.second - after.cross.tr_mul(&to_after)).symmetric_part(),
    };
    Ok((Conditional { own, before: to_before, after: to_after }, join))
}

impl Conditional {
    /// From the joint covariance of the nodes before and after: that of the node before (first) and this one
    /// (second).
    pub(super) fn insert(&self, around: &PairCovariance) -> PairCovariance {
        let PairCovariance { first, cross, second } = around;
        // Cov(x_a, x) = -(S_aa A^T + S_ab B^T), Cov(x_b, x) = -(S_ba A^T + S_bb B^T).
        let with_before = -(first * self.before.transpose() + cross * self.after.transpose());
        let with_after = -(cross.transpose() * self.before.transpose() + second * self.after.transpose());
        let own = self.own - self.before * with_before - self.after * with_after;
        PairCovariance { first: *first, cross: with_before, second: own.symmetric_part() }
    }
}
