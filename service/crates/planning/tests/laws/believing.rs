//! Expected covariances against the inverse of the whole information matrix, dense, made from the factors and
//! from Jacobians that are derived here once more.

use crate::draw::Draw;
use crate::mission::{Mission, add};
use nalgebra::{DMatrix, Matrix3, Matrix6, Vector3, Vector6};
use pdn_kernel::Node;
use pdn_kernel::se3::Pose;
use pdn_planning::decide::decide;
use pdn_planning::expected_places::ExpectedPlaces;
use pdn_planning::round_trip::{RoundTrip, along_route};
use pdn_planning::route::routes;
use pdn_planning::{Candidate, Question, Snapshot};

/// |difference| of two covariances, at most, in products of standard deviations.
const AGREEMENT: f64 = 1e-9;

#[test]
fn every_covariance_of_a_decision_is_the_dense_inverse() {
    for (lines, along, seed) in [(2, 10, 1), (3, 13, 2), (3, 20, 3), (4, 22, 4), (5, 30, 5)] {
        let mission = Mission::survey(lines, along, seed);
        assert!(check(&mission) >= 1, "no candidate in the survey of {lines} lines");
    }
}

#[test]
fn so_it_is_with_other_sensors_and_links() {
    let changes: [fn(&mut Snapshot); 5] = [
        |snapshot| snapshot.settings.expect_absolute = false,
        |snapshot| snapshot.settings.heading_sigma_rad = None,
        |snapshot| (snapshot.settings.tilt_sigma_rad, snapshot.settings.depth_sigma_m) = (None, None),
        |snapshot| snapshot.settings.max_links = 0,
        |snapshot| snapshot.last_odometry = None,
    ];
    for (change, seed) in changes.into_iter().zip(10..) {
        let mut mission = Mission::survey(3, 16, seed);
        change(&mut mission.snapshot);
        mission.snapshot.settings.sample_spacing_m = Some(0.37);
        mission.snapshot.settings.odometry_sigmas_per_sqrt_m =
            Vector6::new(0.01, 0.02, 0.03, 1e-3, 2e-3, 3e-3);
        assert!(check(&mission) >= 1, "no candidate with seed {seed}");
    }
}

/// An old keyframe that was tied to the graph late stands behind the robot's in the list.
#[test]
fn so_it_is_wherever_the_robot_stands_in_the_list() {
    for (back, seed) in [(1, 20), (5, 21), (20, 22)] {
        let mut mission = Mission::survey(3, 16, seed);
        mission.snapshot.newest = Some(Node(mission.snapshot.keyframes.len() as u32 - 1 - back));
        assert!(check(&mission) >= 1, "no candidate with seed {seed}");
    }
}

/// Trips that begin alike, differ and are the same, in any order, ask for no other information than each
/// alone.
#[test]
fn what_a_trip_may_expect_does_not_depend_on_the_others() {
    let snapshot = Mission::survey(4, 22, 4).snapshot;
    let nodes = snapshot.keyframes.len() as u32;
    let goals: Vec<Node> = (0..nodes - 1).step_by(5).chain([10, 10, nodes - 2]).map(Node).collect();
    let found = routes(&snapshot, &goals).unwrap().into_iter().flatten();
    let mut trips: Vec<RoundTrip> = found.map(|route| along_route(&snapshot, &route, 0).unwrap()).collect();
    Draw(3).shuffle(&mut trips);
    let expected = ExpectedPlaces::new(&snapshot, &trips.iter().collect::<Vec<_>>()).unwrap();
    for (index, trip) in trips.iter().enumerate() {
        let alone = ExpectedPlaces::new(&snapshot, &[trip]).unwrap().path(0).unwrap();
        let path = expected.path(index).unwrap();
        assert_eq!(path, alone);
    }
}

/// Checks each number that a belief brings into a decision; returns the number of candidates.
fn check(mission: &Mission) -> usize {
    let snapshot = &mission.snapshot;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let decision = decide(snapshot, &Question::default(), &pool, &|| false).unwrap();

    let robot = covariances(mission.dense_information(0), snapshot.robot().unwrap().index(), 1)[0];
    assert_close(&decision.robot.covariance, &robot);
    let expected = match &snapshot.last_odometry {
        Some(step) => {
            let carry = adjoint(&step.earlier_from_later.inverse());
            carry * robot * carry.transpose() + step.covariance
        }
        None => robot,
    };
    assert_close(&decision.exploration.covariance, &expected);

    for candidate in &decision.candidates {
        let nodes = candidate.poses.len();
        let weighted = |weight: &dyn Fn(f64) -> f64, count: usize| {
            let information = mission.dense_information(nodes);
            let first = snapshot.keyframes.len() + nodes - count;
            covariances(with_path(snapshot, candidate, information, weight), first, count)
        };
        let ratio = |covariance: &Matrix6<f64>| {
            let log_determinant = 2.0 * covariance.cholesky().unwrap().l().diagonal().map(f64::ln).sum();
            ((log_determinant - decision.allowable.log_determinant()) / 6.0).exp()
        };
        let along = weighted(&|probability| probability, nodes);
        let terminal = along[along.len() - 1];
        let peak = along.iter().map(ratio).fold(0.0, f64::max);
        assert_close(&candidate.covariance, &terminal);
        let all = ratio(&weighted(&|_| 1.0, 1)[0]);
        let none = ratio(&weighted(&|_| 0.0, 1)[0]);
        for (found, expected) in [
            (candidate.uncertainty, ratio(&terminal)),
            (candidate.uncertainty_all_links, all),
            (candidate.uncertainty_no_links, none),
            (candidate.peak_uncertainty, peak),
        ] {
            assert!((found / expected - 1.0).abs() < 6.0 * AGREEMENT, "{found} against {expected}");
        }
        assert!(candidate.uncertainty_all_links <= candidate.uncertainty * (1.0 + AGREEMENT));
        assert!(candidate.uncertainty <= candidate.uncertainty_no_links * (1.0 + AGREEMENT));
        assert!(candidate.peak_uncertainty >= candidate.uncertainty);
        let sum: f64 = candidate.links.iter().map(|link| link.2).sum();
        assert!((candidate.expected_links - sum).abs() < 1e-12 * (1.0 + sum));
    }
    decision.candidates.len()
}

/// Lambda_pdn [PDN12, eq. 4]: the information of the graph with that of the candidate's virtual nodes behind
/// it.
fn with_path(
    snapshot: &Snapshot,
    candidate: &Candidate,
    mut information: DMatrix<f64>,
    weight: &dyn Fn(f64) -> f64,
) -> DMatrix<f64> {
    let (robot, first) = (snapshot.robot().unwrap().index(), snapshot.keyframes.len());
    let settings = &snapshot.settings;
    let mut add_pair = |first: usize, second: usize, [of_first, of_second]: [Rows; 2], scale: f64| {
        add(&mut information, first, first, &(of_first.tr_mul(&of_first) * scale));
        add(&mut information, second, second, &(of_second.tr_mul(&of_second) * scale));
        add(&mut information, first, second, &(of_first.tr_mul(&of_second) * scale));
        add(&mut information, second, first, &(of_second.tr_mul(&of_first) * scale));
    };
    let (mut previous, mut before_it) = (snapshot.keyframes[robot].world_from_body, robot);
    for (pose, index) in candidate.poses.iter().zip(first..) {
        let distance_m = (pose.translation.vector - previous.translation.vector).norm();
        let weights = settings.odometry_sigmas_per_sqrt_m.map(|sigma| 1.0 / (sigma * distance_m.sqrt()));
        let whiten = Matrix6::from_diagonal(&weights);
        let before = -adjoint(&(previous.inverse() * pose).inverse());
        add_pair(before_it, index, [whiten * before, whiten], 1.0);
        (previous, before_it) = (*pose, index);
    }
    for &(node, id, probability) in &candidate.links {
        let keyframe = snapshot.keyframes.iter().position(|keyframe| keyframe.id == id).unwrap();
        let pose = &candidate.poses[node as usize - 1];
        let rows = camera_rows(snapshot, keyframe, pose);
        add_pair(keyframe, first + node as usize - 1, rows, weight(probability));
    }
    for (pose, index) in candidate.poses.iter().zip(first..) {
        let rotation = pose.rotation.to_rotation_matrix().into_inner();
        if let (true, Some(tilt)) = (settings.expect_absolute, settings.tilt_sigma_rad) {
            let heading = settings.heading_sigma_rad.map_or(0.0, |sigma| 1.0 / sigma);
            let rows = Matrix3::from_diagonal(&Vector3::new(1.0 / tilt, 1.0 / tilt, heading)) * rotation;
            add(
                &mut information,
                index,
                index,
                &blocks(Matrix3::zeros(), Matrix3::zeros(), rows.tr_mul(&rows)),
            );
        }
        if let (true, Some(sigma)) = (settings.expect_absolute, settings.depth_sigma_m) {
            let row = rotation.row(2) / sigma;
            add(
                &mut information,
                index,
                index,
                &blocks(row.tr_mul(&row), Matrix3::zeros(), Matrix3::zeros()),
            );
        }
    }
    information
}

type Rows = Matrix6<f64>;

/// Whitened Jacobians of a registration by keyframe and virtual pose, three rows of direction (of which the
/// plane across it counts, for its noise is the same all round) and three of rotation.
///
/// With T = C_m^-1 C_i and cameras that move by eta: t changes by R rho_i - rho_m + [t] phi_m, the direction
/// t/|t| by the part of that across it over |t|, and the rotation by phi_i - R^T phi_m. eta = Ad(E^-1) xi for
/// a camera mounted at E.
fn camera_rows(snapshot: &Snapshot, keyframe: usize, pose: &Pose) -> [Rows; 2] {
    let mount = |keyframe: usize| snapshot.keyframes[keyframe].body_from_camera;
    let nearest = nearest_of_all(snapshot, pose).index();
    let camera_m = snapshot.keyframes[keyframe].world_from_body * mount(keyframe);
    let relative = camera_m.inverse() * (pose * mount(nearest));
    let t = relative.translation.vector;
    let rotation = relative.rotation.to_rotation_matrix().into_inner();
    let across = (Matrix3::identity() - t * t.transpose() / t.norm_squared()) / t.norm();
    let first = blocks(-across, across * t.cross_matrix(), -rotation.transpose());
    let second = blocks(across * rotation, Matrix3::zeros(), Matrix3::identity());
    let settings = &snapshot.settings;
    let [direction, turn] =
        [settings.direction_sigma_rad, settings.rotation_sigma_rad].map(|sigma| 1.0 / sigma);
    let whiten = Matrix6::from_diagonal(&Vector6::new(direction, direction, direction, turn, turn, turn));
    [
        whiten * first * adjoint(&mount(keyframe).inverse()),
        whiten * second * adjoint(&mount(nearest).inverse()),
    ]
}

fn nearest_of_all(snapshot: &Snapshot, pose: &Pose) -> Node {
    let distance = |node: &Node| {
        let place = snapshot.keyframe(*node).world_from_body.translation.vector;
        ((place - pose.translation.vector).norm() * 1e9).round() as i64
    };
    let nodes = (0..snapshot.keyframes.len() as u32).map(Node);
    nodes.min_by_key(|node| (distance(node), snapshot.keyframe(*node).id)).unwrap()
}

/// [[upper_left, upper_right], [0, lower_right]].
fn blocks(upper_left: Matrix3<f64>, upper_right: Matrix3<f64>, lower_right: Matrix3<f64>) -> Matrix6<f64> {
    let mut all = Matrix6::zeros();
    all.fixed_view_mut::<3, 3>(0, 0).copy_from(&upper_left);
    all.fixed_view_mut::<3, 3>(0, 3).copy_from(&upper_right);
    all.fixed_view_mut::<3, 3>(3, 3).copy_from(&lower_right);
    all
}

fn adjoint(pose: &Pose) -> Matrix6<f64> {
    let rotation = pose.rotation.to_rotation_matrix().into_inner();
    blocks(rotation, pose.translation.vector.cross_matrix() * rotation, rotation)
}

/// The 6x6 blocks of `count` nodes from `first` on, on the diagonal of the inverse.
fn covariances(information: DMatrix<f64>, first: usize, count: usize) -> Vec<Matrix6<f64>> {
    let mut columns = DMatrix::zeros(information.nrows(), 6 * count);
    columns.view_mut((6 * first, 0), (6 * count, 6 * count)).fill_with_identity();
    let inverse = information.cholesky().expect("positive definite").solve(&columns);
    (0..count).map(|index| inverse.fixed_view::<6, 6>(6 * (first + index), 6 * index).into_owned()).collect()
}

fn assert_close(found: &Matrix6<f64>, expected: &Matrix6<f64>) {
    for row in 0..6 {
        for column in 0..6 {
            let scale = (expected[(row, row)] * expected[(column, column)]).sqrt();
            let difference = (found[(row, column)] - expected[(row, column)]).abs() / scale;
            assert!(difference < AGREEMENT, "entry ({row}, {column}) is off by {difference:e}");
        }
    }
}
