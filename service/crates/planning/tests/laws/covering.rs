//! The raster against a walk over all cells, and after moves against one built anew.

use crate::draw::Draw;
use nalgebra::Vector3;
use pdn_kernel::se3::Pose;
use pdn_kernel::so3;
use pdn_planning::PlanningError;
use pdn_planning::coverage::{Coverage, Facet, FieldOfView};
use proptest::prelude::*;

const VIEW: FieldOfView = FieldOfView { horizontal_rad: 0.98, vertical_rad: 0.77, max_range_m: 3.0 };

proptest! {
    #![proptest_config(ProptestConfig::with_cases(150))]

    #[test]
    fn covered_cells_are_those_whose_centre_is_seen(seed: u64, count in 0..12_usize) {
        let mut draw = Draw(seed);
        let facets = facets(&mut draw);
        let cameras: Vec<Pose> = (0..count).map(|_| camera(&mut draw)).collect();
        let mut coverage = Coverage::new(&facets, 0.17, VIEW).unwrap();
        for (camera, keyframe) in cameras.iter().zip(0..) {
            prop_assert!(coverage.place(keyframe, camera));
        }
        let mut covered_m2 = 0.0;
        for (facet, shown) in facets.iter().zip(coverage.facets()) {
            let (cells_u, cells_v) = ((facet.length_u_m / 0.17).round(), (facet.length_v_m / 0.17).round());
            let covered = naive(facet, cells_u as u32, cells_v as u32, &cameras);
            prop_assert_eq!((shown.cells_u, shown.cells_v), (cells_u as u32, cells_v as u32));
            prop_assert_eq!(shown.covered_cells as usize, covered.iter().filter(|&&cell| cell).count());
            let cells = |(run, &length): (usize, &u32)| vec![run % 2 == 1; length as usize];
            let unpacked = shown.runs.iter().enumerate().flat_map(cells);
            prop_assert!(unpacked.eq(covered));
            let share = shown.covered_cells as f64 / (cells_u * cells_v);
            covered_m2 += share * facet.length_u_m * facet.length_v_m;
        }
        prop_assert!((coverage.covered_m2() - covered_m2).abs() < 1e-9);
    }

    #[test]
    fn after_moves_the_raster_is_as_if_built_anew(seed: u64) {
        let mut draw = Draw(seed);
        let facets = facets(&mut draw);
        let mut coverage = Coverage::new(&facets, 0.1, VIEW).unwrap();
        let mut cameras: Vec<Pose> = (0..10).map(|_| camera(&mut draw)).collect();
        for (camera, keyframe) in cameras.iter().zip(0..) {
            coverage.place(keyframe, camera);
        }
        for _ in 0..20 {
            let keyframe = draw.below(10);
            cameras[keyframe] = camera(&mut draw);
            prop_assert!(coverage.place(keyframe as u64, &cameras[keyframe]));
        }
        coverage.remove(3);
        coverage.remove(99);
        let mut anew = Coverage::new(&facets, 0.1, VIEW).unwrap();
        for (camera, keyframe) in cameras.iter().zip(0..).filter(|&(_, keyframe)| keyframe != 3) {
            anew.place(keyframe, camera);
        }
        prop_assert_eq!(coverage.facets(), anew.facets());
        prop_assert_eq!(coverage.covered_m2(), anew.covered_m2());
    }
}

#[test]
fn a_keyframe_follows_beyond_half_a_cell_only() {
    let mut coverage = Coverage::new(&[floor(4.0, 4.0)], 0.1, VIEW).unwrap();
    let at = |x: f64, tilt_rad: f64| {
        Pose::from_parts(Vector3::new(x, 2.0, -1.5).into(), so3::exp(&Vector3::new(tilt_rad, 0.0, 0.0)))
    };
    assert!(coverage.place(7, &at(2.0, 0.0)));
    // A footprint of 2 * 1.5 * tan(0.49) by 2 * 1.5 * tan(0.385), 1.60 m by 1.22 m: 16 by 12 cells.
    assert!((coverage.covered_m2() - 1.92).abs() < 1e-12);
    assert!(!coverage.place(7, &at(2.0499, 0.0)));
    assert!(coverage.place(7, &at(2.0501, 0.0)));
    assert!(!coverage.place(7, &at(2.0501, 0.05 / 3.0 - 1e-6)));
    assert!(coverage.place(7, &at(2.0501, 0.05 / 3.0 + 1e-6)));
    coverage.remove(7);
    assert_eq!(coverage.covered_m2(), 0.0);
    // From below, the hidden side.
    let below = Pose::from_parts(Vector3::new(2.0, 2.0, 1.5).into(), so3::exp(&Vector3::new(3.1, 0.0, 0.0)));
    coverage.place(8, &below);
    assert_eq!(coverage.covered_m2(), 0.0);
}

#[test]
fn a_target_that_is_none_is_refused() {
    let refused = |change: fn(&mut Facet)| {
        let mut facet = floor(4.0, 4.0);
        change(&mut facet);
        Coverage::new(&[floor(1.0, 1.0), facet], 0.1, VIEW).unwrap_err()
    };
    for change in [
        (|facet: &mut Facet| facet.u *= 1.1) as fn(&mut Facet),
        |facet| facet.v = (facet.u + facet.v).normalize(),
        |facet| facet.length_u_m = 0.0,
        |facet| facet.length_v_m = f64::NAN,
        |facet| facet.origin.x = f64::INFINITY,
        |facet| facet.length_v_m = 0.04,
    ] {
        assert!(matches!(refused(change), PlanningError::Facet { facet: 1, .. }));
    }
    assert!(matches!(refused(|facet| facet.length_u_m = 1e9), PlanningError::TooManyCells { .. }));
    for cell_m in [0.0, -0.1, f64::NAN] {
        assert!(matches!(
            Coverage::new(&[], cell_m, VIEW),
            Err(PlanningError::OutOfRange { name: "cell_m", .. })
        ));
    }
}

/// A facet at depth 0 that is seen from above, where z is negative.
fn floor(length_u_m: f64, length_v_m: f64) -> Facet {
    Facet { origin: Vector3::zeros(), u: Vector3::y(), v: Vector3::x(), length_u_m, length_v_m }
}

fn facets(draw: &mut Draw) -> [Facet; 2] {
    let mut tilted = || {
        let turn = so3::exp(&draw.vector(1.0));
        let origin = draw.vector(1.0) + Vector3::new(-1.0, -1.0, 1.0);
        let [length_u_m, length_v_m] = [draw.between(0.5, 6.0), draw.between(0.5, 6.0)];
        Facet { origin, u: turn * Vector3::y(), v: turn * Vector3::x(), length_u_m, length_v_m }
    };
    [tilted(), tilted()]
}

fn camera(draw: &mut Draw) -> Pose {
    Pose::from_parts((draw.vector(2.0) - Vector3::z()).into(), so3::exp(&draw.vector(0.8)))
}

fn naive(facet: &Facet, cells_u: u32, cells_v: u32, cameras: &[Pose]) -> Vec<bool> {
    let normal = facet.u.cross(&facet.v);
    let mut covered = Vec::new();
    for row in 0..cells_v {
        for column in 0..cells_u {
            let [along_u, along_v] = [column, row].map(|index| (f64::from(index) + 0.5) * 0.17);
            let centre = facet.origin + facet.u * along_u + facet.v * along_v;
            covered.push(cameras.iter().any(|camera| {
                let point = camera.inverse_transform_point(&centre.into());
                let visible_side = (camera.translation.vector - facet.origin).dot(&normal) > 0.0;
                visible_side
                    && point.z > 0.0
                    && point.z <= VIEW.max_range_m
                    && (point.x / point.z).abs() <= (0.5 * VIEW.horizontal_rad).tan()
                    && (point.y / point.z).abs() <= (0.5 * VIEW.vertical_rad).tan()
            }));
        }
    }
    covered
}
