//! DBSCAN against a naive one that follows the definition and against another order of the points;
//! representatives against what they promise.

use crate::draw::Draw;
use nalgebra::Vector3;
use pdn_planning::cluster::{dbscan, representatives};
use pdn_planning::distance::nanometres;
use proptest::prelude::*;
use std::collections::BTreeMap;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn clusters_follow_the_definition(points in points(), eps_m in 0.3..2.0_f64, min_points in 1..6_usize) {
        prop_assert_eq!(clusters(&points, eps_m, min_points), naive(&points, eps_m, min_points));
    }

    #[test]
    fn clusters_do_not_depend_on_the_order(points in points(), eps_m in 0.3..2.0_f64, seed: u64) {
        let mut shuffled = points.clone();
        Draw(seed).shuffle(&mut shuffled);
        prop_assert_eq!(clusters(&points, eps_m, 4), clusters(&shuffled, eps_m, 4));
    }

    #[test]
    fn representatives_are_near_their_own_and_far_from_each_other(
        points in points(), radius_m in 0.3..4.0_f64, levels in 1..6_usize, seed: u64,
    ) {
        let places: Vec<Vector3<f64>> = points.iter().map(|point| point.place).collect();
        let mut draw = Draw(seed);
        let scores: Vec<f64> = places.iter().map(|_| draw.below(levels) as f64).collect(); // with ties
        let found = representatives(&scores, &places, radius_m);
        let distance = |one: usize, other: usize| nanometres((places[one] - places[other]).norm());
        let mut members: Vec<usize> = found.iter().flat_map(|(_, members)| members.clone()).collect();
        members.sort_unstable();
        prop_assert_eq!(members, (0..places.len()).collect::<Vec<_>>());
        for (at, (best, members)) in found.iter().enumerate() {
            prop_assert!(members.contains(best) && members.is_sorted());
            prop_assert!(members.iter().all(|&member| distance(member, *best) <= nanometres(radius_m)));
            prop_assert!(found[..at].iter().all(|(other, _)| distance(*other, *best) > nanometres(radius_m)));
            // Nobody who was left then is better, or as good with a lower index.
            let left = found[at..].iter().flat_map(|(_, members)| members);
            let rank = |index: usize| (-(scores[index] as i64), index);
            prop_assert_eq!(left.map(|&member| rank(member)).min(), Some(rank(*best)));
        }
    }

    #[test]
    fn without_bound_the_best_represents_all(points in points(), seed: u64) {
        let places: Vec<Vector3<f64>> = points.iter().map(|point| point.place).collect();
        let mut draw = Draw(seed);
        let scores: Vec<f64> = places.iter().map(|_| draw.below(3) as f64).collect();
        let found = representatives(&scores, &places, f64::MAX);
        let best = (0..places.len()).min_by_key(|&index| (-(scores[index] as i64), index));
        let expected: Vec<(usize, Vec<usize>)> =
            best.into_iter().map(|best| (best, (0..places.len()).collect())).collect();
        prop_assert_eq!(found, expected);
    }
}

#[test]
fn a_border_point_between_two_cores_joins_the_nearer_and_in_a_tie_the_lower_id() {
    let with_border = |x: f64| {
        let cores = [(20, 0.0), (21, 0.1), (22, 0.2), (23, 0.3), (10, 2.1), (11, 2.2), (12, 2.3), (13, 2.4)];
        let points = cores.into_iter().chain([(1, x)]);
        clusters(
            &points.map(|(id, x)| Point { id, place: Vector3::new(x, 0.0, 0.0) }).collect::<Vec<_>>(),
            0.95,
            4,
        )
    };
    assert_eq!(with_border(1.2), [vec![1, 10, 11, 12, 13], vec![20, 21, 22, 23]]);
    assert_eq!(with_border(1.18), [vec![1, 20, 21, 22, 23], vec![10, 11, 12, 13]]);
}

/// A point to be clustered.
#[derive(Clone, Copy, Debug)]
struct Point {
    id: u64,
    place: Vector3<f64>,
}

/// Clusters as sorted ids: what [`dbscan`] makes of all pairs of the points, in the order of their ids.
fn clusters(points: &[Point], eps_m: f64, min_points: usize) -> Vec<Vec<u64>> {
    let mut points = points.to_vec();
    points.sort_by_key(|point| point.id);
    let distance = |one: usize, other: usize| nanometres((points[one].place - points[other].place).norm());
    let near = |one: usize| {
        let others = (0..points.len()).filter(move |&other| other != one);
        let with_distance = others.map(|other| (other, distance(one, other)));
        with_distance.filter(|&(_, distance)| distance <= nanometres(eps_m)).collect()
    };
    let neighbours: Vec<Vec<(usize, i64)>> = (0..points.len()).map(near).collect();
    let ids = |members: Vec<usize>| members.into_iter().map(|index| points[index].id).collect();
    dbscan(&neighbours, min_points).into_iter().map(ids).collect()
}

/// Places on a coarse lattice, so that ties and distances of exactly eps occur, with a few anywhere.
fn points() -> impl Strategy<Value = Vec<Point>> {
    let coordinate = prop_oneof![4 => (0..12).prop_map(|step| 0.5 * f64::from(step)), 1 => 0.0..6.0_f64];
    prop::collection::vec((coordinate.clone(), coordinate), 0..45).prop_map(|places| {
        let ids = (0..places.len() as u64).map(|index| index * 7919 % 101);
        ids.zip(places).map(|(id, (x, y))| Point { id, place: Vector3::new(x, y, 0.0) }).collect()
    })
}

fn naive(points: &[Point], eps_m: f64, min_points: usize) -> Vec<Vec<u64>> {
    let distance = |one: &Point, other: &Point| nanometres((one.place - other.place).norm());
    let near = |one: &Point, other: &Point| distance(one, other) <= nanometres(eps_m);
    let cores: Vec<&Point> = points
        .iter()
        .filter(|one| points.iter().filter(|other| near(one, other)).count() >= min_points)
        .collect();
    let mut label: BTreeMap<u64, u64> = cores.iter().map(|core| (core.id, core.id)).collect();
    for _ in 0..cores.len() {
        for one in &cores {
            let least = cores.iter().filter(|other| near(one, other)).map(|other| label[&other.id]).min();
            label.insert(one.id, least.expect("a core point is near itself"));
        }
    }
    let mut clusters: BTreeMap<u64, Vec<u64>> = BTreeMap::new();
    for point in points {
        let nearest =
            cores.iter().filter(|core| near(core, point)).min_by_key(|core| (distance(core, point), core.id));
        let own = label.get(&point.id).copied().or_else(|| nearest.map(|core| label[&core.id]));
        if let Some(own) = own {
            clusters.entry(own).or_default().push(point.id);
        }
    }
    let mut clusters: Vec<Vec<u64>> = clusters.into_values().collect();
    clusters.iter_mut().for_each(|members| members.sort_unstable());
    clusters.sort();
    clusters
}
