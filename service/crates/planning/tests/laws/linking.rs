//! Expected registrations against the definition read aloud over all keyframes; the table of P_L.

use crate::draw::Draw;
use crate::mission::{Mission, link_model, untied};
use nalgebra::Vector3;
use pdn_kernel::Node;
use pdn_kernel::se3::Pose;
use pdn_planning::registration::{Link, links};
use pdn_planning::{LinkModel, PlanningError, Snapshot};
use proptest::prelude::*;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn links_are_the_most_probable_within_reach(
        seed: u64,
        max_links in 0..7_usize,
        angle_rad in 0.05..3.2_f64,
    ) {
        let mission = Mission::survey(3, 20, seed).snapshot;
        let mut snapshot = untied(mission.keyframes, mission.went);
        snapshot.settings.max_links = max_links;
        snapshot.settings.max_view_angle_rad = angle_rad;
        let mut draw = Draw(seed ^ 2);
        for _ in 0..5 {
            let place = snapshot.keyframes[draw.below(60)].world_from_body;
            let pose = place * Pose::new(draw.vector(0.4), draw.vector(0.2));
            let nearest = snapshot.nearest(&pose.translation.vector).unwrap();
            prop_assert_eq!(nearest, nearest_of_all(&snapshot, &pose));
            prop_assert_eq!(links(&snapshot, &pose, nearest), naive(&snapshot, &pose, nearest));
        }
    }

    #[test]
    fn an_outcome_counts_once_in_both_orders(
        outcomes in prop::collection::vec((0.0..=1.0_f64, 0.0..=1.0_f64, any::<bool>()), 0..60),
    ) {
        let mut model = link_model();
        outcomes.iter().for_each(|&(one, other, registered)| model.record(one, other, registered));
        let bin = |saliency: f64| ((saliency * 5.0) as usize).min(4);
        let cells = model.cells();
        for (index, cell) in cells.iter().enumerate() {
            let of_cell = |&&(one, other, _): &&(f64, f64, bool)| {
                let [row, column] = [bin(one), bin(other)];
                (row, column) == (index / 5, index % 5) || (column, row) == (index / 5, index % 5)
            };
            prop_assert_eq!(cell.proposed as usize, outcomes.iter().filter(of_cell).count());
            let registered = outcomes.iter().filter(of_cell).filter(|outcome| outcome.2);
            prop_assert_eq!(cell.registered as usize, registered.count());
            let mean = (cell.registered as f64 + cell.prior_registered) / (cell.proposed as f64 + 200.0);
            let centre = |bin: usize| (bin as f64 + 0.5) / 5.0;
            let probability = model.probability(centre(index / 5), centre(index % 5));
            prop_assert!((probability - mean).abs() < 1e-15 && (cell.probability() - mean).abs() < 1e-15);
            prop_assert_eq!(*cell, cells[(index % 5) * 5 + index / 5]);
        }
    }
}

#[test]
fn the_middle_of_a_piece_belongs_to_the_end_of_lower_id_whatever_the_rounding() {
    let mut draw = Draw(5);
    for _ in 0..200 {
        let snapshot = Mission::survey(1, 2, draw.0).snapshot;
        let mut pair = untied(snapshot.keyframes, snapshot.went);
        (pair.keyframes[0].id, pair.keyframes[1].id) = if draw.share() < 0.5 { (4, 8) } else { (8, 4) };
        let [one, other] = [0, 1].map(|index| pair.keyframes[index].world_from_body.translation.vector);
        let nearest = pair.nearest(&one.lerp(&other, 0.5)).unwrap();
        assert_eq!(pair.keyframe(nearest).id, 4);
    }
}

#[test]
fn a_prior_that_is_none_is_refused() {
    let even = [1.0, 1.0];
    assert!(LinkModel::new(2, &[even; 4]).is_ok());
    assert!(matches!(
        LinkModel::new(2, &[even; 3]),
        Err(PlanningError::LinkModelShape { bins: 2, pairs: 3 })
    ));
    assert!(matches!(LinkModel::new(0, &[]), Err(PlanningError::LinkModelShape { bins: 0, pairs: 0 })));
    for wrong in [[f64::NAN, 1.0], [-1.0, 2.0], [0.0, 0.0], [1.0, f64::INFINITY]] {
        assert!(matches!(LinkModel::new(1, &[wrong]), Err(PlanningError::LinkModelPrior { .. })));
    }
    let lopsided = LinkModel::new(2, &[even, [1.0, 2.0], even, even]);
    assert!(matches!(lopsided, Err(PlanningError::LinkModelPrior { row: 0, column: 1, .. })));
}

fn nearest_of_all(snapshot: &Snapshot, pose: &Pose) -> Node {
    let distance = |node: &Node| {
        let place = snapshot.keyframe(*node).world_from_body.translation.vector;
        ((place - pose.translation.vector).norm() * 1e9).round() as i64
    };
    let nodes = (0..snapshot.keyframes.len() as u32).map(Node);
    nodes.min_by_key(|node| (distance(node), snapshot.keyframe(*node).id)).unwrap()
}

fn naive(snapshot: &Snapshot, pose: &Pose, nearest: Node) -> Vec<Link> {
    let settings = &snapshot.settings;
    let current = snapshot.keyframe(nearest);
    let camera = pose * current.body_from_camera;
    let mut all = Vec::new();
    for (keyframe, node) in snapshot.keyframes.iter().zip((0..).map(Node)) {
        let relative = camera.inverse() * keyframe.world_from_body * keyframe.body_from_camera;
        let baseline_m = relative.translation.vector.norm();
        let angle_rad = (relative.rotation * Vector3::z()).z.clamp(-1.0, 1.0).acos();
        let probability = snapshot.link_model.probability(keyframe.saliency.local, current.saliency.local);
        if (0.3..=0.9).contains(&baseline_m) && angle_rad <= settings.max_view_angle_rad {
            all.push((probability, baseline_m, keyframe.id, Link { keyframe: node, probability }));
        }
    }
    all.sort_by(|one, other| (-one.0, one.1, one.2).partial_cmp(&(-other.0, other.1, other.2)).unwrap());
    all.into_iter().map(|(.., link)| link).take(settings.max_links).collect()
}
