//! What the residuals mean: worked numbers, consistency with poses, agreement with the expected information.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Matrix5, Matrix6, UnitQuaternion, Vector3, Vector6};
use proptest::prelude::*;

use crate::factors::camera::tangent_basis;
use crate::factors::{Factor, FactorKind};
use crate::information::{self, PairInformation};
use crate::se3::{self, Pose};
use crate::testing::{agree, covariances, directions, poses, rotation_vectors, tangents};
use crate::{KernelError, Node, gaussian, so3};

const FIRST: Node = Node(3);
const SECOND: Node = Node(5);

fn pair(factor: &Factor, first: &Pose, second: &Pose) -> PairInformation {
    let [on_first, on_second] = factor.linearize(first, Some(second)).unwrap().jacobians;
    PairInformation::from_jacobians(&on_first, &on_second)
}

fn same(a: &PairInformation, b: &PairInformation) -> Result<(), String> {
    // Measurements rebuilt from poses differ by roundings, some 1e-14 of the poses' 10 m over a baseline of
    // 0.3 m, and whitening raises them by the condition of the covariance.
    agree(&a.first, &b.first, 1e-10)?;
    agree(&a.cross, &b.cross, 1e-10)?;
    agree(&a.second, &b.second, 1e-10)
}

proptest! {
    // A measurement that says what the poses say has no residual, and its information is the expected one.
    #[test]
    fn information_at_zero_residual_is_the_expected_one(
        first in poses(), mounts in (poses(), poses()), direction in directions(), length in 0.3..3.0f64,
        turn in rotation_vectors(), q in covariances::<6>(), mut r in covariances::<5>(),
    ) {
        // Where the two smallest components of the direction tie, a rounding turns the basis by a right
        // angle, which only a covariance without preferred direction does not see.
        let mut components = [direction.x.abs(), direction.y.abs(), direction.z.abs()];
        components.sort_by(f64::total_cmp);
        if components[1] - components[0] < 1e-9 {
            r = Matrix5::from_diagonal(&[0.09, 0.09, 0.01, 0.02, 0.03].into());
        }
        let motion = Pose::from_parts((direction * length).into(), so3::exp(&turn));
        let second = first * mounts.0 * motion * mounts.1.inverse();

        let camera = Factor::camera(
            FIRST, SECOND, mounts.0, mounts.1, direction, motion.rotation, &r, 0.2,
        ).unwrap();
        let whitening = gaussian::square_root_information(&r).unwrap();
        let expected = information::camera(&first, &mounts.0, &second, &mounts.1, &whitening).unwrap();
        prop_assert_eq!(same(&expected, &pair(&camera, &first, &second)), Ok(()));

        let odometry = Factor::odometry(FIRST, SECOND, first.inverse() * second, &q).unwrap();
        let whitening = gaussian::square_root_information(&q).unwrap();
        let expected = information::odometry(&first, &second, &whitening);
        prop_assert_eq!(same(&expected, &pair(&odometry, &first, &second)), Ok(()));

        for heading in [None, Some(0.3)] {
            let variance = heading.map(|sigma: f64| sigma * sigma);
            let attitude = Factor::attitude(FIRST, first.rotation, 0.04, variance).unwrap();
            let expected = information::attitude(&first, 0.2, heading);
            prop_assert_eq!(agree(&expected, &pair(&attitude, &first, &second).first, 1e-13), Ok(()));
        }
        let depth = Factor::depth(FIRST, first.translation.z, 0.04).unwrap();
        let expected = information::depth(&first, 0.2);
        prop_assert_eq!(agree(&expected, &pair(&depth, &first, &second).first, 1e-13), Ok(()));
    }

    // Exchanging the two ends of an odometry measurement exchanges the blocks: Log(Y^-1) = -Log(Y) turns the
    // covariance by the adjoint of the motion.
    #[test]
    fn odometry_reads_the_same_backwards(first in poses(), second in poses(), q in covariances::<6>()) {
        let forward = information::odometry(&first, &second, &gaussian::square_root_information(&q).unwrap());
        // With Ad = Ad(X_i^-1 X_j), Q' = Ad Q Ad^T has the square-root information W Ad^-1.
        let whitening = gaussian::square_root_information(&q).unwrap()
            * se3::adjoint(&(second.inverse() * first));
        let backward = information::odometry(&second, &first, &whitening).exchanged();
        let scale = forward.first.amax().max(forward.second.amax()).max(1.0);
        // Ad of up to 20 m enters four times.
        prop_assert!((forward.first - backward.first).amax() <= 1e-10 * scale);
        prop_assert!((forward.cross - backward.cross).amax() <= 1e-10 * scale);
        prop_assert!((forward.second - backward.second).amax() <= 1e-10 * scale);
    }

    // A camera does not see the length of its baseline: moving the second camera along it changes no
    // residual.
    #[test]
    fn cameras_are_blind_along_the_baseline(
        first in poses(), direction in directions(), length in 0.3..3.0f64, turn in rotation_vectors(),
    ) {
        let motion = Pose::from_parts((direction * length).into(), so3::exp(&turn));
        let second = first * motion;
        let mount = Pose::identity();
        let expected = information::camera(&first, &mount, &second, &mount, &Matrix5::identity()).unwrap();
        let along = se3::join(&(motion.rotation.inverse() * direction), &Vector3::zeros());
        prop_assert!((expected.second * along).norm() <= 1e-12 / (length * length));
        // Across it, a step of one metre turns the direction by 1 / length radians.
        let across = motion.rotation.inverse() * tangent_basis(&direction).row(0).transpose();
        let across = se3::join(&across, &Vector3::zeros());
        let information = across.dot(&(expected.second * across));
        prop_assert!((information * length * length - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_tangent_basis_is_orthonormal_everywhere(direction in directions()) {
        let basis = tangent_basis(&direction);
        prop_assert!((basis * basis.transpose() - nalgebra::Matrix2::identity()).amax() < 1e-15);
        prop_assert!((basis * direction).amax() < 1e-15);
    }

    #[test]
    fn the_other_pose_leaves_no_residual(pose in poses(), motion in tangents()) {
        let measured = se3::exp(&motion);
        let covariance = Matrix6::identity();
        for factor in [
            Factor::odometry(FIRST, SECOND, measured, &covariance).unwrap(),
            Factor::relative(FIRST, SECOND, measured, &covariance).unwrap(),
        ] {
            let to = factor.pose_of_other(FIRST, &pose).unwrap();
            prop_assert!(factor.chi2(&pose, Some(&to)).unwrap() < 1e-24);
            let from = factor.pose_of_other(SECOND, &pose).unwrap();
            prop_assert!(factor.chi2(&from, Some(&pose)).unwrap() < 1e-24);
            prop_assert_eq!(factor.pose_of_other(Node(4), &pose), None);
        }
        let prior = Factor::prior(FIRST, measured, &covariance).unwrap();
        let own = prior.pose_of_other(FIRST, &pose).unwrap();
        prop_assert!(prior.chi2(&own, None).unwrap() < 1e-24);
    }
}

/// Along x, the axis of smallest |z_a| is y: b1 = x cross y = z and b2 = x cross z = -y.
#[test]
fn camera_residual_in_worked_numbers() {
    let factor = Factor::camera(
        FIRST,
        SECOND,
        Pose::identity(),
        Pose::identity(),
        Vector3::x(),
        UnitQuaternion::identity(),
        &Matrix5::identity(),
        0.1,
    )
    .unwrap();
    let second = Pose::new(Vector3::new(0.36, 0.48, 0.8) * 2.0, Vector3::new(0.0, 0.0, 0.3));
    let residual = factor.linearize(&Pose::identity(), Some(&second)).unwrap().residual;
    assert!((residual - Vector6::new(0.8, -0.48, 0.0, 0.0, 0.3, 0.0)).amax() < 1e-15);
    assert_eq!(factor.dimension(), 5);
    assert_eq!(factor.nodes(), (FIRST, Some(SECOND)));
    assert_eq!(factor.pose_of_other(FIRST, &second), None);
}

/// The vehicle is pitched up by 0.1 about an east axis while heading east: the error is about the world's
/// axes.
#[test]
fn attitude_errors_stand_in_world_axes() {
    let measured = UnitQuaternion::from_euler_angles(0.0, 0.0, PI / 2.0);
    let truth = UnitQuaternion::from_scaled_axis(Vector3::new(0.1, 0.0, 0.0)) * measured;
    let factor = Factor::attitude(FIRST, measured, 0.01, Some(0.04)).unwrap();
    let pose = Pose::from_parts(Vector3::zeros().into(), truth);
    let residual = factor.linearize(&pose, None).unwrap().residual;
    assert!((residual - Vector6::new(1.0, 0.0, 0.0, 0.0, 0.0, 0.0)).amax() < 1e-14);
}

/// A heading that is not observed costs nothing when it is wrong, but scales tilt as documented.
#[test]
fn an_unobserved_heading_scales_tilt_as_documented() {
    for (degrees, scale) in [(0.0, 1.0), (30.0, 1.0233), (90.0, 1.2337), (179.0, 2.44)] {
        let heading = f64::to_radians(degrees);
        let measured = UnitQuaternion::from_euler_angles(0.0, 0.0, -heading);
        let factor = Factor::attitude(FIRST, measured, 1.0, None).unwrap();
        let linearized = factor.linearize(&Pose::identity(), None).unwrap();
        assert!(linearized.residual.amax() < 1e-15);
        let information = linearized.jacobians[0].tr_mul(&linearized.jacobians[0]);
        assert!((information[(3, 3)] / scale - 1.0).abs() < 1e-2);
        assert!((information[(4, 4)] / scale - 1.0).abs() < 1e-2);
    }
}

/// The step of an unrotated vehicle by 1 m along x: turning the first one moves the second one sideways.
#[test]
fn odometry_information_in_worked_numbers() {
    let ahead = Pose::translation(1.0, 0.0, 0.0);
    let information = information::odometry(&Pose::identity(), &ahead, &Matrix6::identity());
    assert_eq!(information.second, Matrix6::identity());
    // J_first = -Ad of a step back: heading of the first (column 5) moves y by -(+1) and turns heading by -1.
    assert_eq!(information.cross[(5, 1)], -1.0);
    assert_eq!(information.cross[(5, 5)], -1.0);
    assert_eq!(information.first[(5, 5)], 2.0);
}

#[test]
fn kinds_have_names_in_order() {
    let names: Vec<&str> = FactorKind::ALL.iter().map(|kind| kind.name()).collect();
    assert_eq!(names, ["prior", "odometry", "relative", "camera", "attitude", "depth", "position"]);
}

#[test]
fn coinciding_cameras_have_no_expected_information() {
    let pose = Pose::translation(1.0, 2.0, 3.0);
    let mount = Pose::identity();
    assert!(matches!(
        information::camera(&pose, &mount, &pose, &mount, &Matrix5::identity()),
        Err(KernelError::DegenerateBaseline { baseline_m: 0.0, .. })
    ));
    assert_eq!(information::depth(&pose, 1.0).fixed_view::<3, 3>(3, 3), Matrix3::zeros());
}
