//! For each of many points that move a little those near it: Verlet lists, taken over from one state by the
//! next.
//!
//! A list has the points that were within a reach and a skin when it was made. Until one of two points has
//! gone more than half the skin from its reference position, the list of each names the other whenever they
//! are within the reach. A point that goes farther is taken out and put in again. Distances are always those
//! from where the points are now, so what is told is a function of that and of nothing else, once whoever
//! asks has left out what is beyond the radius.

use nalgebra::Vector3;
use pdn_kernel::{Node, SharedVec};
use std::sync::Arc;

/// The skin, in reaches.
const SKIN: f64 = 0.125;

/// The reach of new lists, in radii that they are asked for: a radius that follows an estimate may grow a
/// little.
const REACH: f64 = 1.05;

/// Lists of more than this many times the radius that is wanted are made anew.
const TOO_FAR: f64 = 1.5;

/// Beyond this share of points that have moved it is quicker to make all lists anew.
const MOVED_SHARE: usize = 4;

/// The lists, by node. Copies share what stays.
#[derive(Clone, Debug, Default)]
pub(crate) struct VerletLists {
    reach_m: f64,
    /// Reference position of each point; none for nodes that are no points.
    reference: SharedVec<Option<Vector3<f64>>>,
    /// Ascending, without the node itself.
    lists: SharedVec<Arc<[u32]>>,
}

impl VerletLists {
    /// Lists for a radius, from those for an earlier or later state.
    ///
    /// `now` has the point of each node, if it is one. `search` shows at least all points within a distance
    /// of a place, in any order. Cost: a comparison for each node, a search and its neighbours' lists for
    /// each point that is new or has moved.
    pub(crate) fn update(
        mut self,
        radius_m: f64,
        now: &[Option<Vector3<f64>>],
        search: impl Fn(&Vector3<f64>, f64, &mut dyn FnMut(Node)),
    ) -> VerletLists {
        let serves = radius_m <= self.reach_m && self.reach_m <= TOO_FAR * radius_m;
        let moved = if serves { self.moved(now) } else { Vec::new() };
        if !serves || moved.len() * MOVED_SHARE > now.len() {
            return VerletLists::new(REACH * radius_m, now, search);
        }
        for &node in &moved {
            self.remove(node);
        }
        for &node in &moved {
            if let Some(Some(place)) = now.get(node as usize) {
                self.insert(node, *place, &search);
            }
        }
        self
    }

    /// At least all points within the radius of a node's point, itself left out, ascending.
    pub(crate) fn of(&self, node: Node) -> impl ExactSizeIterator<Item = Node> {
        self.lists[node.index()].iter().copied().map(Node)
    }

    fn new(
        reach_m: f64,
        now: &[Option<Vector3<f64>>],
        search: impl Fn(&Vector3<f64>, f64, &mut dyn FnMut(Node)),
    ) -> VerletLists {
        let mut made = VerletLists { reach_m, ..VerletLists::default() };
        now.iter().for_each(|point| made.reference.push(*point));
        for (node, point) in (0..).zip(now) {
            let near = point.map_or(Vec::new(), |place| made.near(node, &place, &search));
            made.lists.push(near.into());
        }
        made
    }

    /// Nodes whose point is new, gone, or no longer within half the skin of its reference position,
    /// ascending.
    fn moved(&self, now: &[Option<Vector3<f64>>]) -> Vec<u32> {
        // A little of the skin is left for rounding.
        let limit_m = 0.49 * SKIN * self.reach_m;
        let stays = |reference: &Option<Vector3<f64>>, now: &Option<Vector3<f64>>| match (reference, now) {
            (Some(reference), Some(now)) => (now - reference).norm_squared() <= limit_m * limit_m,
            (None, None) => true,
            _ => false,
        };
        let known = (0_u32..).zip(self.reference.iter().zip(now));
        let moved = known.filter(|(_, (reference, now))| !stays(reference, now)).map(|(node, _)| node);
        let gone = (now.len()..self.reference.len()).filter(|&node| self.reference[node].is_some());
        let new = self.reference.len()..now.len();
        moved.chain(gone.chain(new).map(|node| node as u32)).collect()
    }

    fn remove(&mut self, node: u32) {
        let nodes = node as usize + 1;
        self.reference.extend_to(nodes, &None);
        self.lists.extend_to(nodes, &Arc::default());
        self.reference[node as usize] = None;
        let near = std::mem::take(&mut self.lists[node as usize]);
        for &other in near.iter() {
            let list = &mut self.lists[other as usize];
            *list = list.iter().copied().filter(|&known| known != node).collect();
        }
    }

    fn insert(
        &mut self,
        node: u32,
        place: Vector3<f64>,
        search: &impl Fn(&Vector3<f64>, f64, &mut dyn FnMut(Node)),
    ) {
        let near = self.near(node, &place, search);
        for &other in &near {
            let list = &mut self.lists[other as usize];
            let at = list.partition_point(|&known| known < node);
            *list = list[..at].iter().chain([&node]).chain(&list[at..]).copied().collect();
        }
        self.reference[node as usize] = Some(place);
        self.lists[node as usize] = near.into();
    }

    /// Points that the lists have within the reach and the skin of a place, ascending, but for one node.
    fn near(
        &self,
        node: u32,
        place: &Vector3<f64>,
        search: &impl Fn(&Vector3<f64>, f64, &mut dyn FnMut(Node)),
    ) -> Vec<u32> {
        let skin_m = SKIN * self.reach_m;
        let listed_m = self.reach_m + skin_m;
        let mut near = Vec::new();
        // A point is within half the skin of its reference position.
        search(place, listed_m + 0.5 * skin_m, &mut |other| {
            let reference =
                if other.index() < self.reference.len() { self.reference[other.index()] } else { None };
            if reference.is_some_and(|reference| (reference - place).norm() <= listed_m) && other.0 != node {
                near.push(other.0);
            }
        });
        near.sort_unstable();
        near
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    type Points = Vec<Option<Vector3<f64>>>;

    /// What becomes of the points from one state to the next.
    #[derive(Clone, Debug)]
    enum Change {
        /// Those of every so many nodes go a way.
        Move {
            every: usize,
            by: [f64; 3],
        },
        /// All go a share of the way to a place: those near it go little, and yet come near each other.
        Gather {
            to: [f64; 3],
            share: f64,
        },
        Add([f64; 3]),
        /// From the end.
        Remove(usize),
        /// A node's point stops being one, or becomes one.
        Toggle {
            node: usize,
            place: [f64; 3],
        },
    }

    fn place() -> impl Strategy<Value = [f64; 3]> {
        prop::array::uniform3((0..8).prop_map(|step| 0.4 * f64::from(step)))
    }

    fn way() -> impl Strategy<Value = [f64; 3]> {
        let far_m = prop_oneof![Just(1e-5), Just(0.03), Just(0.07), Just(2.0)];
        (far_m, prop::array::uniform3(-1.0..1.0_f64)).prop_map(|(far_m, by)| by.map(|share| far_m * share))
    }

    fn change() -> impl Strategy<Value = Change> {
        prop_oneof![
            4 => (1..9_usize, way()).prop_map(|(every, by)| Change::Move { every, by }),
            4 => (place(), 0.01..0.05_f64).prop_map(|(to, share)| Change::Gather { to, share }),
            3 => place().prop_map(Change::Add),
            1 => (0..3_usize).prop_map(Change::Remove),
            1 => (0..40_usize, place()).prop_map(|(node, place)| Change::Toggle { node, place }),
        ]
    }

    fn apply(change: &Change, points: &mut Points) {
        match *change {
            Change::Move { every, by } => {
                points.iter_mut().step_by(every).flatten().for_each(|place| *place += Vector3::from(by))
            }
            Change::Gather { to, share } => {
                points.iter_mut().flatten().for_each(|place| *place = place.lerp(&to.into(), share));
            }
            Change::Add(place) => points.push(Some(place.into())),
            Change::Remove(count) => points.truncate(points.len() - count.min(points.len())),
            Change::Toggle { node, place } => {
                if let Some(point) = points.get_mut(node) {
                    *point = if point.is_none() { Some(place.into()) } else { None };
                }
            }
        }
    }

    fn follow(lists: VerletLists, radius_m: f64, points: &Points) -> VerletLists {
        lists.update(radius_m, points, |place, reach_m, show| {
            for (node, point) in (0..).map(Node).zip(points) {
                if point.is_some_and(|point| (point - place).norm() <= reach_m) {
                    show(node);
                }
            }
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(400))]

        /// Nobody within the radius is missing, whoever is named is no farther than the skin allows, and
        /// nobody twice.
        #[test]
        fn the_lists_have_whoever_is_near(
            begun in prop::collection::vec(place(), 0..40),
            changes in prop::collection::vec((change(), 0.95..1.05_f64), 1..25),
        ) {
            let mut points: Points = begun.into_iter().map(|place| Some(place.into())).collect();
            let mut lists = VerletLists::default();
            for (change, radius_m) in changes {
                apply(&change, &mut points);
                lists = follow(lists, radius_m, &points);
                for (node, point) in points.iter().enumerate() {
                    let named: Vec<usize> = lists.of(Node(node as u32)).map(Node::index).collect();
                    let far_m = |other: usize| Some((points[other]? - (*point)?).norm());
                    let within = |other: usize, far: f64| far_m(other).is_some_and(|far_m| far_m <= far);
                    let is_near = |&other: &usize| other != node && within(other, radius_m);
                    let near: Vec<usize> = (0..points.len()).filter(is_near).collect();
                    let has_all = near.iter().all(|other| named.contains(other));
                    prop_assert!(has_all, "{node}: {near:?}, {named:?}");
                    let farthest_m = TOO_FAR * radius_m * (1.0 + 2.0 * SKIN);
                    prop_assert!(named.iter().all(|&other| within(other, farthest_m)));
                    prop_assert!(named.is_sorted_by(|one, other| one < other));
                }
            }
        }
    }

    #[test]
    fn what_stays_is_shared_and_what_moves_is_put_in_again() {
        let mut points: Points =
            (0..400).map(|at| Some(Vector3::new(0.5 * f64::from(at), 0.0, 0.0))).collect();
        let before = follow(VerletLists::default(), 1.2, &points);
        points.iter_mut().flatten().for_each(|place| place.y += 0.01);
        points[200] = Some(Vector3::new(0.25, 0.0, 0.0));
        points.push(Some(Vector3::new(200.0, 0.0, 0.0)));
        let after = follow(before.clone(), 1.2, &points);
        let anew: Vec<usize> =
            (0..400).filter(|&node| !Arc::ptr_eq(&before.lists[node], &after.lists[node])).collect();
        assert_eq!(anew, [0, 1, 2, 3, 198, 199, 200, 201, 202, 398, 399]);
    }
}
