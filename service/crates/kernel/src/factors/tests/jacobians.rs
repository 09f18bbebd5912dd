//! Every factor's Jacobians against central differences of its residual.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};
use proptest::prelude::*;

use crate::factors::{Factor, Linearized};
use crate::se3::{self, Pose};
use crate::testing::{agree, covariances, directions, numerical_jacobian, poses, rotation_vectors};
use crate::{Loss, Node, so3};

const FIRST: Node = Node(0);
const SECOND: Node = Node(1);

/// The numerical error is some 1e-11 of the values (see `numerical_jacobian`); whitening by covariances whose
/// scaled condition is below 1e3 mixes rows and a baseline of 0.3 m takes the fourth power of step / baseline
/// to 1e-12. A wrong term shows at 1e-3 and more.
const TOLERANCE: f64 = 1e-8;

fn at(factor: &Factor, first: &Pose, second: &Pose) -> Linearized {
    factor.linearize(first, Some(second)).expect("generated poses are finite and apart")
}

fn numerical(factor: &Factor, first: &Pose, second: &Pose) -> [Matrix6<f64>; 2] {
    [
        numerical_jacobian(|d| at(factor, &(first * se3::exp(d)), second).residual),
        numerical_jacobian(|d| at(factor, first, &(second * se3::exp(d))).residual),
    ]
}

fn check(factor: &Factor, first: &Pose, second: &Pose) -> Result<(), String> {
    let analytic = at(factor, first, second).jacobians;
    let numerical = numerical(factor, first, second);
    for (side, (analytic, numerical)) in analytic.iter().zip(&numerical).enumerate() {
        agree(analytic, numerical, TOLERANCE).map_err(|error| format!("pose {side}: {error}"))?;
    }
    Ok(())
}

/// Errors of a measurement: up to 5 m and 2.5 rad, so that the Jacobians of Log matter and its cut at pi is
/// not touched.
fn errors() -> impl Strategy<Value = Vector6<f64>> {
    (directions(), 0.0..5.0f64, rotation_vectors())
        .prop_map(|(direction, length, phi)| se3::join(&(direction * length), &(phi * (2.5 / PI))))
}

/// Second camera seen from the first: baselines from 0.3 m, among them exactly along the optical axis and
/// along the other axes of the image.
fn camera_motions() -> impl Strategy<Value = Pose> {
    (directions(), 0.3..3.0f64, rotation_vectors())
        .prop_map(|(direction, length, phi)| Pose::from_parts((direction * length).into(), so3::exp(&phi)))
}

proptest! {
    #[test]
    fn prior(pose in poses(), error in errors(), covariance in covariances::<6>()) {
        let factor = Factor::prior(FIRST, pose * se3::exp(&error), &covariance).unwrap();
        prop_assert_eq!(check(&factor, &pose, &pose), Ok(()));
    }

    #[test]
    fn relative(first in poses(), second in poses(), error in errors(), covariance in covariances::<6>()) {
        let measured = first.inverse() * second * se3::exp(&error);
        let odometry = Factor::odometry(FIRST, SECOND, measured, &covariance).unwrap();
        let relative = Factor::relative(FIRST, SECOND, measured, &covariance).unwrap();
        prop_assert_eq!(check(&odometry, &first, &second), Ok(()));
        prop_assert_eq!(at(&odometry, &first, &second), at(&relative, &first, &second));
    }

    #[test]
    fn camera(
        first in poses(), motion in camera_motions(), mounts in (poses(), poses()),
        turn in rotation_vectors(), error in errors(), covariance in covariances::<5>(),
    ) {
        let second = first * mounts.0 * motion * mounts.1.inverse();
        // Up to a right angle between measured and predicted direction, which the residual can tell.
        let direction = so3::exp(&(turn * 0.45)) * motion.translation.vector.normalize();
        let rotation = motion.rotation * so3::exp(&se3::parts(&error).1);
        let factor =
            Factor::camera(FIRST, SECOND, mounts.0, mounts.1, direction, rotation, &covariance, 0.2).unwrap();
        prop_assert_eq!(check(&factor, &first, &second), Ok(()));
    }

    // A vehicle that goes straight up along a ship's side with its camera to starboard: azimuth and elevation
    // would be singular where the camera looks along the baseline, and here is nothing special.
    #[test]
    fn camera_of_a_vertical_motion(first in poses(), up in prop_oneof![0.3..3.0f64, -3.0..-0.3f64]) {
        let second = Pose::from_parts(
            (first.translation.vector + Vector3::new(0.0, 0.0, up)).into(), first.rotation,
        );
        let mount = Pose::rotation(Vector3::new(0.0, PI / 2.0, 0.0));
        let motion = (first * mount).inverse() * (second * mount);
        let factor = Factor::camera(
            FIRST, SECOND, mount, mount, motion.translation.vector.normalize(), motion.rotation,
            &nalgebra::Matrix5::identity(), 0.2,
        ).unwrap();
        prop_assert!(at(&factor, &first, &second).residual.norm() < 1e-13);
        prop_assert_eq!(check(&factor, &first, &second), Ok(()));
    }

    #[test]
    fn attitude(
        pose in poses(),
        error in errors(),
        tilt in 1e-4..1.0f64,
        heading in prop::option::of(1e-4..1.0f64),
    ) {
        let measured = so3::exp(&se3::parts(&error).1) * pose.rotation;
        let factor = Factor::attitude(FIRST, measured, tilt, heading).unwrap();
        prop_assert_eq!(check(&factor, &pose, &pose), Ok(()));
        prop_assert_eq!(factor.dimension(), if heading.is_some() { 3 } else { 2 });
    }

    #[test]
    fn depth_and_position(
        pose in poses(), elsewhere in poses(), variance in 1e-4..1.0f64, covariance in covariances::<3>(),
    ) {
        let depth = Factor::depth(FIRST, elsewhere.translation.z, variance).unwrap();
        prop_assert_eq!(check(&depth, &pose, &pose), Ok(()));
        let position = Factor::position(FIRST, elsewhere.translation.vector, &covariance).unwrap();
        prop_assert_eq!(check(&position, &pose, &pose), Ok(()));
        let mut horizontal = covariance;
        horizontal.row_mut(2).fill(0.0);
        horizontal.column_mut(2).fill(0.0);
        let position = Factor::position(FIRST, elsewhere.translation.vector, &horizontal).unwrap();
        prop_assert_eq!(check(&position, &pose, &pose), Ok(()));
        prop_assert_eq!((depth.dimension(), position.dimension()), (1, 2));
    }

    // sqrt(w) scales residual and Jacobians alike, so J^T J is w times the information; w is not
    // differentiated.
    #[test]
    fn a_loss_scales_by_the_root_of_its_weight(first in poses(), second in poses(), c in 0.1..10.0f64) {
        let identity = Matrix6::identity();
        let factor = Factor::relative(FIRST, SECOND, Pose::identity(), &identity).unwrap();
        let plain = at(&factor, &first, &second);
        let r_squared = plain.residual.norm_squared();
        for loss in [Loss::Huber(c), Loss::Cauchy(c)] {
            let robust = factor.clone().with_loss(loss);
            let root = loss.weight(r_squared).sqrt();
            let weighted = at(&robust, &first, &second);
            prop_assert_eq!(agree(&weighted.residual, &(plain.residual * root), 1e-15), Ok(()));
            for side in 0..2 {
                let expected = plain.jacobians[side] * root;
                prop_assert_eq!(agree(&weighted.jacobians[side], &expected, 1e-15), Ok(()));
            }
            let chi2 = robust.chi2(&first, Some(&second)).unwrap();
            prop_assert!((chi2 - weighted.residual.norm_squared()).abs() <= 1e-14 * chi2);
        }
    }
}

/// The check must be able to fail: plausible mistakes in each Jacobian are told from the truth.
#[test]
fn broken_twins_are_caught() {
    let first = se3::exp(&Vector6::new(1.0, 2.0, 3.0, 0.3, -0.4, 2.9));
    let motion = se3::exp(&Vector6::new(0.6, 0.1, -0.2, 0.2, 0.1, -0.3));
    let mount = se3::exp(&Vector6::new(0.2, 0.0, 0.1, 0.1, 1.5, 0.2));
    let second = first * mount * motion * mount.inverse();
    let error = se3::exp(&Vector6::new(0.1, -0.1, 0.2, 0.2, -0.1, 0.1));
    let caught = |factor: &Factor, side: usize, twin: Matrix6<f64>| {
        let numerical = numerical(factor, &first, &second)[side];
        assert_eq!(agree(&at(factor, &first, &second).jacobians[side], &numerical, TOLERANCE), Ok(()));
        agree(&twin, &numerical, TOLERANCE).is_err()
    };

    let relative =
        Factor::relative(FIRST, SECOND, first.inverse() * second * error, &Matrix6::identity()).unwrap();
    let residual = at(&relative, &first, &second).residual;
    let jacobians = at(&relative, &first, &second).jacobians;
    assert!(caught(&relative, 1, Matrix6::identity()), "the Jacobian of Log left out");
    assert!(caught(&relative, 1, se3::left_jacobian_inverse(&residual)), "left for right");
    assert!(caught(&relative, 0, -jacobians[0]), "sign");
    let wrong_way = -(jacobians[1] * se3::adjoint(&(first.inverse() * second)));
    assert!(caught(&relative, 0, wrong_way), "adjoint of the inverse");

    let camera = Factor::camera(
        FIRST,
        SECOND,
        mount,
        mount,
        (error.rotation * motion.translation.vector).normalize(),
        motion.rotation * error.rotation,
        &nalgebra::Matrix5::identity(),
        0.1,
    )
    .unwrap();
    let jacobians = at(&camera, &first, &second).jacobians;
    let mut without_lever_arm = jacobians[0];
    without_lever_arm.fixed_view_mut::<2, 3>(0, 3).fill(0.0);
    assert!(caught(&camera, 0, without_lever_arm), "lever arm");
    let in_camera_axes = jacobians[1] * se3::adjoint(&mount);
    assert!(caught(&camera, 1, in_camera_axes), "camera's axes for body's");

    let attitude = Factor::attitude(FIRST, error.rotation * first.rotation, 1.0, Some(1.0)).unwrap();
    let rotation = first.rotation.to_rotation_matrix().into_inner();
    let mut in_body_axes = Matrix6::zeros();
    in_body_axes.fixed_view_mut::<3, 3>(0, 3).copy_from(&Matrix3::identity());
    assert!(caught(&attitude, 0, in_body_axes), "body axes for world axes");
    let mut to_first_order = Matrix6::zeros();
    to_first_order.fixed_view_mut::<3, 3>(0, 3).copy_from(&rotation);
    assert!(caught(&attitude, 0, to_first_order), "the Jacobian of Log left out");

    let depth = Factor::depth(FIRST, 1.0, 1.0).unwrap();
    let mut down = Matrix6::zeros();
    down[(0, 2)] = 1.0;
    assert!(caught(&depth, 0, down), "the world's vertical for the body's");
}
