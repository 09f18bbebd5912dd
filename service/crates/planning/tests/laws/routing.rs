//! Routes against Bellman-Ford over all pairs, and against another order of the keyframes.

use crate::draw::Draw;
use crate::mission::untied;
use nalgebra::{UnitQuaternion, Vector3};
use pdn_kernel::Node;
use pdn_kernel::se3::Pose;
use pdn_planning::route::routes;
use pdn_planning::{Saliency, Snapshot, SnapshotKeyframe};
use proptest::prelude::*;
use std::collections::BTreeMap;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn routes_are_the_cheapest(seed: u64, count in 2..40_usize, lattice: bool) {
        let snapshot = scattered(seed, count, lattice);
        let goals: Vec<Node> = (0..count as u32).map(Node).collect();
        let expected = bellman_ford(&snapshot);
        for (goal, route) in goals.iter().zip(routes(&snapshot, &goals).unwrap()) {
            let Some(route) = route else {
                prop_assert_eq!(expected[goal.index()], f64::INFINITY);
                continue;
            };
            prop_assert_eq!(route.keyframes[0], Node(count as u32 - 1));
            prop_assert_eq!(route.keyframes.last(), Some(goal));
            let steps = || route.keyframes.windows(2).map(|step| (step[0].index(), step[1].index()));
            let cost: f64 = steps().map(|(from, to)| edge(&snapshot, from, to)).sum();
            let length: f64 = steps().map(|(from, to)| distance_m(&snapshot, from, to)).sum();
            // 0.5 pm of rounding an edge, at most 40 edges on either route.
            let least = expected[goal.index()];
            prop_assert!((cost - least).abs() < 5e-11, "{} {}", cost, least);
            prop_assert!((length - route.one_way_m).abs() < 1e-12);
        }
    }

    #[test]
    fn routes_do_not_depend_on_the_order_of_addition(seed: u64, count in 2..40_usize) {
        let snapshot = scattered(seed, count, true);
        let mut order: Vec<usize> = (0..count - 1).collect();
        Draw(seed ^ 1).shuffle(&mut order);
        order.push(count - 1);
        let place: BTreeMap<usize, u32> = order.iter().copied().zip(0..).collect();
        let keyframes = order.iter().map(|&old| snapshot.keyframes[old]).collect();
        let went = snapshot.went.iter().map(|&(a, b)| (Node(place[&a.index()]), Node(place[&b.index()])));
        let mut other = untied(keyframes, went.collect());
        other.settings = snapshot.settings.clone();
        let ids = |snapshot: &Snapshot, goals: &[Node]| {
            let routes = routes(snapshot, goals).unwrap().into_iter();
            let ids = routes.map(|route| route.map(|route| {
                route.keyframes.iter().map(|&node| snapshot.keyframe(node).id).collect::<Vec<u64>>()
            }));
            ids.collect::<Vec<_>>()
        };
        let goals: Vec<Node> = (0..count as u32).map(Node).collect();
        let moved: Vec<Node> = (0..count).map(|old| Node(place[&old])).collect();
        prop_assert_eq!(ids(&snapshot, &goals), ids(&other, &moved));
    }
}

#[test]
fn the_radius_itself_does_not_connect_and_the_vehicle_s_own_way_ignores_the_view_angle() {
    let turned = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), 2.0);
    let keyframe = |id: u64, x: f64, rotation: UnitQuaternion<f64>| SnapshotKeyframe {
        id,
        world_from_body: Pose::from_parts(Vector3::new(x, 0.0, 0.0).into(), rotation),
        body_from_camera: Pose::identity(),
        saliency: Saliency::NONE,
    };
    let level = UnitQuaternion::identity();
    let reach = |other_rotation, went: &[(u32, u32)], radius_m: f64| {
        let keyframes = vec![keyframe(0, 1.0, other_rotation), keyframe(1, 0.0, level)];
        let mut snapshot = untied(keyframes, went.iter().map(|&(from, to)| (Node(from), Node(to))).collect());
        snapshot.settings.edge_radius_m = Some(radius_m);
        routes(&snapshot, &[Node(0)]).unwrap()[0].is_some()
    };
    assert!(reach(level, &[], 1.000_001));
    assert!(!reach(level, &[], 1.0));
    assert!(!reach(turned, &[], 1.5));
    assert!(reach(turned, &[(0, 1)], 1.5));
    assert!(reach(turned, &[(1, 0)], 1.5));
}

#[test]
fn of_two_ways_that_cost_the_same_the_one_over_the_lower_id_is_taken() {
    let through = |above: u64, below: u64| {
        let places = [(7, 2.1, 0.0), (above, 1.0, 0.3), (below, 1.0, -0.3), (9, 0.1, 0.0)];
        let keyframes = places.map(|(id, x, y)| SnapshotKeyframe {
            id,
            world_from_body: Pose::translation(x, y, 0.0),
            body_from_camera: Pose::identity(),
            saliency: Saliency::NONE,
        });
        let mut snapshot = untied(keyframes.into(), Vec::new());
        snapshot.settings.edge_radius_m = Some(1.5);
        let route = routes(&snapshot, &[Node(0)]).unwrap().remove(0).unwrap();
        snapshot.keyframe(route.keyframes[1]).id
    };
    assert_eq!((through(3, 5), through(5, 3)), (3, 3));
}

fn scattered(seed: u64, count: usize, lattice: bool) -> Snapshot {
    let mut draw = Draw(seed);
    let mut cells: Vec<usize> = (0..64).collect();
    draw.shuffle(&mut cells);
    let keyframes = (0..count).map(|index| {
        let cell = Vector3::new((cells[index] % 8) as f64, (cells[index] / 8) as f64, 1.0);
        let place = cell + if lattice { Vector3::zeros() } else { draw.vector(0.4) };
        let roll = [0.0, 0.2, 1.2][draw.below(3)];
        SnapshotKeyframe {
            id: (index as u64 * 7919) % 211,
            world_from_body: Pose::from_parts(
                place.into(),
                UnitQuaternion::from_euler_angles(roll, 0.0, 0.3),
            ),
            body_from_camera: Pose::identity(),
            saliency: Saliency { local: [0.0, 0.25, 0.5, 1.0][draw.below(4)], global: 0.5 },
        }
    });
    let keyframes = keyframes.collect::<Vec<_>>();
    let went = (1..count as u32).map(|node| (Node(node - 1), Node(node))).collect();
    let mut snapshot = untied(keyframes, went);
    snapshot.settings.edge_radius_m = Some(draw.between(1.1, 2.1));
    snapshot
}

fn bellman_ford(snapshot: &Snapshot) -> Vec<f64> {
    let count = snapshot.keyframes.len();
    let mut cost = vec![f64::INFINITY; count];
    cost[count - 1] = 0.0;
    for _ in 0..count {
        for from in 0..count {
            for to in 0..count {
                cost[to] = cost[to].min(cost[from] + edge(snapshot, from, to));
            }
        }
    }
    cost
}

/// (2 - S_L(target)) * distance, infinite where two keyframes are not connected.
fn edge(snapshot: &Snapshot, from: usize, to: usize) -> f64 {
    let [one, other] = [from, to].map(|index| &snapshot.keyframes[index]);
    let axis = |keyframe: &SnapshotKeyframe| keyframe.world_from_body * Vector3::z();
    let same_side = axis(one).dot(&axis(other)) >= snapshot.settings.max_view_angle_rad.cos();
    let went = from.abs_diff(to) == 1;
    let distance = distance_m(snapshot, from, to);
    let near = distance < snapshot.settings.edge_radius_m.expect("set above");
    if from != to && near && (same_side || went) {
        (2.0 - other.saliency.local) * distance
    } else {
        f64::INFINITY
    }
}

fn distance_m(snapshot: &Snapshot, from: usize, to: usize) -> f64 {
    let place = |index: usize| snapshot.keyframes[index].world_from_body.translation.vector;
    (place(to) - place(from)).norm()
}
