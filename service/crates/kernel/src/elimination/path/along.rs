//! Covariance of every virtual node of a path, from the factors of the touched fronts.

use nalgebra::Matrix6;

use super::chain::PairCovariance;
use super::results::FrontResult;
use super::variables::{Combination, Leg, Variables};
use super::virtual_path::{LinkWeight, VirtualPath};
use super::workspace::{Factorization, Workspace};
use crate::elimination::assembly::NONE;
use crate::elimination::takahashi::FrontCovariance;

impl Workspace {
    /// Covariance of each virtual node 1 to n with links weighed by their probabilities, after `terminal` so
    /// and with `record`.
    pub(super) fn along(&self, factorization: Factorization, path: &VirtualPath) -> Vec<Matrix6<f64>> {
        let variables = self.structure.variables(factorization.system.len() as u32);
        let chain = &self.structure.chain;
        let mut covariances = vec![Matrix6::zeros(); path.nodes() as usize];
        let mut joints = vec![[None; 2]; chain.retained.len()];
        let mut has_gap = vec![false; chain.retained.len()];
        chain.gaps.iter().for_each(|gap| has_gap[gap.next_retained as usize] = true);
        let robot_wanted = has_gap[0];
        let is_wanted = |id| id >= variables.base || (robot_wanted && id == path.robot.0);
        self.descend(factorization, is_wanted, |ids, frontal, covariance| {
            let front = FrontRows { ids, covariance };
            for &id in &ids[..frontal] {
                let retained = if id >= variables.base { variables.retained_of(id) } else { None };
                if id == variables.terminal() {
                    covariances[path.nodes() as usize - 1] = front.own(&variables.start(id, Leg::Inbound));
                }
                if let Some(retained) = retained {
                    let nodes = path.nodes_at(chain.retained[retained as usize]);
                    for (node, leg) in nodes.into_iter().zip([Leg::Outbound, Leg::Inbound]) {
                        if let Some(node) = node {
                            covariances[node as usize - 1] = front.own(&variables.node(retained, leg));
                        }
                    }
                }
                // The joint covariance of two neighbours is known in the front of the lower one.
                let first = retained.unwrap_or(0);
                for later in
                    (first..(first + 2).min(variables.retained)).filter(|&later| has_gap[later as usize])
                {
                    for (joint, leg) in joints[later as usize].iter_mut().zip([Leg::Outbound, Leg::Inbound]) {
                        *joint = joint.or_else(|| front.joint(variables, path.robot.0, later, leg));
                    }
                }
            }
        });
        self.fill_gaps(path, &joints, &mut covariances);
        covariances
    }

    /// Visits the touched fronts that eliminate a wanted row, and those above them, from the top down with
    /// their ids, the number eliminated in each, and the covariance of all its rows.
    fn descend(
        &self,
        factorization: Factorization,
        is_wanted: impl Fn(u32) -> bool,
        mut visit: impl FnMut(&[u32], usize, &FrontCovariance),
    ) {
        let count = self.structure.touched.len();
        let result = |index| self.result(factorization.tree, LinkWeight::Expected, index);
        let mut needed = vec![false; count];
        for index in 0..count {
            let FrontResult { ids, frontal, .. } = result(index);
            needed[index] = ids[..*frontal].iter().any(|&id| is_wanted(id))
                || self.structure.children(index).any(|child| needed[child]);
        }
        let mut separators: Vec<Vec<f64>> = vec![Vec::new(); count];
        let mut place_of = vec![NONE; self.structure.variables(factorization.system.len() as u32).id_bound()];
        let mut covariance = FrontCovariance::default();
        let mut shared: Vec<u32> = Vec::new();
        for index in (0..count).rev().filter(|&index| needed[index]) {
            let FrontResult { ids, frontal, factor, .. } = result(index);
            let factor = factor.as_deref().expect("factors were recorded");
            let separator = std::mem::take(&mut separators[index]);
            for (place, &id) in ids.iter().enumerate() {
                place_of[id as usize] = place as u32;
            }
            // Rows before the first that is wanted here or shared with a child need no covariance.
            let children = self.structure.children(index).filter(|&child| needed[child]);
            let below = children.flat_map(|child| result(child).separator());
            let own = ids[..*frontal].iter().filter(|&&id| is_wanted(id));
            let first = own.chain(below).map(|&id| place_of[id as usize] as usize).min();
            let first = first.map_or(*frontal, |first| first.min(*frontal));
            covariance.compute(factor, 6 * ids.len(), 6 * first..6 * frontal, &separator);
            visit(ids, *frontal, &covariance);
            for child in self.structure.children(index).filter(|&child| needed[child]) {
                shared.clear();
                shared.extend(result(child).separator().iter().map(|&id| place_of[id as usize]));
                separators[child] = covariance.gather(&shared);
            }
        }
    }

    /// Puts the places that were taken out of the chain back in, from the end of the path to its beginning.
    fn fill_gaps(
        &self,
        path: &VirtualPath,
        joints: &[[Option<PairCovariance>; 2]],
        covariances: &mut [Matrix6<f64>],
    ) {
        let mut around: Option<(u32, [PairCovariance; 2])> = None;
        for gap in self.structure.chain.gaps.iter().rev() {
            let outer = match around {
                Some((next_retained, inner)) if next_retained == gap.next_retained => inner,
                _ => joints[gap.next_retained as usize]
                    .map(|joint| joint.expect("neighbours meet in the front of the lower one")),
            };
            let inserted = [gap.out.insert(&outer[0]), gap.back.insert(&outer[1])];
            for (node, pair) in path.nodes_at(gap.place).into_iter().zip(&inserted) {
                if let Some(node) = node {
                    covariances[node as usize - 1] = pair.second;
                }
            }
            around = Some((gap.next_retained, inserted));
        }
    }
}

/// The covariance of a front's rows, asked by nodes.
struct FrontRows<'a> {
    ids: &'a [u32],
    covariance: &'a FrontCovariance,
}

impl FrontRows<'_> {
    fn own(&self, node: &Combination) -> Matrix6<f64> {
        self.between(node, node).expect("its unknowns are eliminated here").symmetric_part()
    }

    /// Of the nodes of one leg at a retained place and at the one before it; none if they do not meet here.
    fn joint(&self, variables: Variables, robot: u32, later: u32, leg: Leg) -> Option<PairCovariance> {
        let second = variables.node(later, leg);
        let first = match later.checked_sub(1) {
            Some(before) => variables.node(before, leg),
            None => variables.start(robot, leg),
        };
        Some(PairCovariance {
            first: self.between(&first, &first)?,
            cross: self.between(&first, &second)?,
            second: self.between(&second, &second)?,
        })
    }

    /// Cov(one, other); none if an unknown has no row here.
    fn between(&self, one: &Combination, other: &Combination) -> Option<Matrix6<f64>> {
        let place = |wanted: u32| self.ids.iter().position(|&id| id == wanted);
        let mut sum = Matrix6::zeros();
        for &(row, of_row) in one.iter().filter(|(_, of)| *of != 0.0) {
            for &(column, of_column) in other.iter().filter(|(_, of)| *of != 0.0) {
                sum += self.covariance.block(place(row)?, place(column)?) * (of_row * of_column);
            }
        }
        Some(sum)
    }
}
