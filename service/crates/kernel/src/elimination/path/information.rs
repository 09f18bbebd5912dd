//! What a path adds to the touched fronts, in its unknowns.

use nalgebra::Matrix6;

use super::chain::Join;
use super::front_assignment::TOP;
use super::structure::{LinkAt, PathStructure};
use super::variables::{Combination, Leg, Variables};
use super::virtual_path::{LinkWeight, VirtualPath};
use crate::elimination::assembly::Assembly;
use crate::information::PairInformation;

/// A path's information with its links weighed in one way.
pub(super) struct PathInformation<'a> {
    structure: &'a PathStructure,
    path: &'a VirtualPath,
    weight: LinkWeight,
    variables: Variables,
    /// Information of a node on its own at each place: sensors, and the part of the registrations.
    own: Vec<Matrix6<f64>>,
}

impl<'a> PathInformation<'a> {
    pub(super) fn new(
        structure: &'a PathStructure,
        path: &'a VirtualPath,
        weight: LinkWeight,
        variables: Variables,
    ) -> PathInformation<'a> {
        let mut own: Vec<Matrix6<f64>> = path.places.iter().map(|place| place.unary).collect();
        for (place, link) in path.links() {
            own[place as usize] += link.information.second * weight.of(link);
        }
        PathInformation { structure, path, weight, variables, own }
    }

    /// Adds what belongs to a touched front.
    pub(super) fn add(&self, assembly: &mut Assembly, index: usize) {
        let PathInformation { structure, path, variables, .. } = *self;
        let rows = &structure.rows[index];
        for link in &structure.links[rows.links.clone()] {
            self.add_link(assembly, link);
        }
        if structure.robot_at == index as u32 {
            let robot = variables.start(path.robot.0, Leg::Outbound);
            add_pair(assembly, &structure.chain.joins[0].out, &robot, &variables.node(0, Leg::Outbound));
        }
        for &(_, retained) in &structure.eliminated[rows.eliminated.clone()] {
            let own = self.own[structure.chain.retained[retained as usize] as usize]
                * variables.own_share(retained);
            variables.of(retained).for_each(|id| assembly.add_diagonal(id, &own));
            self.add_joins(assembly, index, retained);
        }
        if structure.touched[index] == TOP {
            assembly.add_diagonal(variables.terminal(), &self.own[0]);
        }
    }

    /// Both nodes of a place register with the keyframe: twice on the keyframe, and with their sum.
    fn add_link(&self, assembly: &mut Assembly, at: &LinkAt) {
        let link = &self.path.places[at.place as usize].links[at.index as usize];
        let weight = self.weight.of(link);
        let nodes = self.path.nodes_at(at.place).into_iter().flatten().count() as f64;
        let id = self.structure.linked(self.variables, at.place);
        assembly.add_diagonal(link.keyframe.0, &(link.information.first * (nodes * weight)));
        assembly.add_cross(link.keyframe.0, id, &(link.information.cross * weight));
    }

    /// What joins a place that is eliminated here to its neighbours that are not eliminated before.
    fn add_joins(&self, assembly: &mut Assembly, index: usize, retained: u32) {
        let PathInformation { structure, variables, path, .. } = *self;
        let joins = &structure.chain.joins;
        if retained == 0 {
            let terminal = variables.start(path.robot.0, Leg::Inbound);
            add_pair(assembly, &joins[0].back, &terminal, &variables.node(0, Leg::Inbound));
        } else if assembly.has(variables.sum(retained - 1)) {
            self.add_join(assembly, &joins[retained as usize], retained);
        }
        // If the next place is eliminated here too, its own turn adds what joins them.
        let next_front = structure.front_of.get(retained as usize + 1);
        let is_elsewhere = next_front.is_some_and(|&next| next != structure.touched[index]);
        if is_elsewhere && assembly.has(variables.sum(retained + 1)) {
            self.add_join(assembly, &joins[retained as usize + 1], retained + 1);
        }
    }

    fn add_join(&self, assembly: &mut Assembly, join: &Join, retained: u32) {
        for (information, leg) in [(&join.out, Leg::Outbound), (&join.back, Leg::Inbound)] {
            let before = self.variables.node(retained - 1, leg);
            add_pair(assembly, information, &before, &self.variables.node(retained, leg));
        }
    }
}

/// Adds information between two nodes that are combinations of unknowns.
fn add_pair(
    assembly: &mut Assembly,
    information: &PairInformation,
    first: &Combination,
    second: &Combination,
) {
    add_own(assembly, &information.first, first);
    add_own(assembly, &information.second, second);
    for &(row, of_row) in first.iter().filter(|(_, of)| *of != 0.0) {
        for &(column, of_column) in second.iter().filter(|(_, of)| *of != 0.0) {
            assembly.add_cross(row, column, &(information.cross * (of_row * of_column)));
        }
    }
}

fn add_own(assembly: &mut Assembly, block: &Matrix6<f64>, node: &Combination) {
    let [(one, of_one), (other, of_other)] = *node;
    assembly.add_diagonal(one, &(block * (of_one * of_one)));
    if of_other != 0.0 {
        assembly.add_diagonal(other, &(block * (of_other * of_other)));
        assembly.add_cross(one, other, &(block * (of_one * of_other)));
    }
}
