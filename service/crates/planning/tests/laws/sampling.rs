//! Round trips: bisected until fine enough, the same places out and back.

use crate::draw::Draw;
use crate::mission::{Mission, untied};
use nalgebra::Vector3;
use pdn_kernel::{Node, so3};
use pdn_planning::Route;
use pdn_planning::distance::nanometres;
use pdn_planning::round_trip::{MAX_NODES, along_points, along_route};
use pdn_planning::{PlanningError, Snapshot};
use proptest::prelude::*;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn a_round_trip_is_the_bisected_polyline_there_and_back(seed: u64, spacing_m in 0.05..1.0_f64) {
        let mut snapshot = survey(seed);
        snapshot.settings.sample_spacing_m = Some(spacing_m);
        let count = snapshot.keyframes.len() as u32;
        let mut draw = Draw(seed);
        let hops = 1 + draw.below(12);
        let mut keyframes = vec![Node(count - 1)];
        keyframes.extend((0..hops).map(|hop| Node((hop * 3) as u32)));
        let pose = |node: &Node| snapshot.keyframe(*node).world_from_body;
        let route = Route { keyframes: keyframes.clone(), one_way_m: 9.0 };
        let trip = along_route(&snapshot, &route, 0).unwrap();

        let mut places = Vec::new();
        for piece in keyframes.windows(2) {
            let [from, to] = [pose(&piece[0]), pose(&piece[1])];
            let length_m = (to.translation.vector - from.translation.vector).norm();
            let mut parts = (0..20).map(|halvings| 1 << halvings);
            let parts = parts.find(|&parts| length_m / parts as f64 <= spacing_m);
            for part in 1..=parts.unwrap() {
                let share = part as f64 / parts.unwrap() as f64;
                let turn = from.rotation.slerp(&to.rotation, share);
                places.push((from.translation.vector.lerp(&to.translation.vector, share), turn));
            }
        }
        let start = pose(&keyframes[0]);
        let inbound = places.clone().into_iter().rev().skip(1);
        let expected: Vec<_> = places.clone().into_iter().chain(inbound)
            .chain([(start.translation.vector, start.rotation)]).collect();
        prop_assert_eq!(trip.poses.len(), expected.len());
        for (pose, (place, turn)) in trip.poses.iter().zip(&expected) {
            prop_assert!((pose.translation.vector - place).norm() < 1e-12);
            prop_assert!(so3::log(&(pose.rotation.inverse() * turn)).norm() < 1e-9);
        }
        let last = trip.poses.len() - 1;
        prop_assert_eq!(trip.poses[last], start);
        // Virtual nodes i and n - i are the same place.
        for (outbound, inbound) in trip.poses[..last / 2].iter().zip(trip.poses[..last].iter().rev()) {
            prop_assert_eq!(outbound, inbound);
        }
    }
}

#[test]
fn keyframes_at_the_same_place_give_one_node() {
    let mut snapshot = survey(1);
    snapshot.settings.sample_spacing_m = Some(10.0);
    let near = snapshot.keyframes[4].world_from_body;
    snapshot.keyframes[5].world_from_body = near;
    snapshot.keyframes[5].world_from_body.translation.vector.x += 0.9e-3;
    let robot = snapshot.robot().unwrap();
    let trip = |nodes: &[u32]| {
        let keyframes = [robot].into_iter().chain(nodes.iter().copied().map(Node)).collect();
        along_route(&snapshot, &Route { keyframes, one_way_m: 1.0 }, 7)
    };
    assert_eq!(trip(&[4, 5, 6]).unwrap(), trip(&[4, 6]).unwrap());
    assert!(matches!(trip(&[]), Err(PlanningError::PathEmpty { path: 7 })));
}

#[test]
fn a_drawn_path_may_name_the_robot_s_place_and_is_refused_where_it_has_no_meaning() {
    let snapshot = survey(2);
    let start = snapshot.keyframes.last().unwrap().world_from_body.translation.vector;
    let away = start + Vector3::new(-3.0, 0.0, 0.0);
    let named = along_points(&snapshot, &[start, away], 0).unwrap();
    assert_eq!(named, along_points(&snapshot, &[away], 0).unwrap());
    assert!((named.one_way_m - 3.0).abs() < 1e-12);
    assert_eq!(named.poses[named.poses.len() / 2 - 1].translation.vector, away);
    for piece in named.poses.windows(2) {
        let length_m = (piece[1].translation.vector - piece[0].translation.vector).norm();
        assert!(nanometres(length_m) <= nanometres(snapshot.spacing_m().unwrap()));
    }
    let refused = |points: &[Vector3<f64>]| along_points(&snapshot, points, 3).unwrap_err();
    assert!(matches!(refused(&[]), PlanningError::PathEmpty { path: 3 }));
    assert!(matches!(refused(&[start]), PlanningError::PathEmpty { path: 3 }));
    assert!(matches!(refused(&[away * f64::NAN]), PlanningError::PathNotFinite { path: 3 }));
    assert!(matches!(refused(&[away * 1e5]), PlanningError::PathTooLong { path: 3, limit: MAX_NODES, .. }));
}

fn survey(seed: u64) -> Snapshot {
    let snapshot = Mission::survey(3, 14, seed).snapshot;
    untied(snapshot.keyframes, snapshot.went)
}
