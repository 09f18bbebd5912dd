//! What is refused, and with which numbers.

use nalgebra::{Matrix3, Matrix5, Matrix6, Quaternion, UnitQuaternion, Vector3};

use crate::factors::Factor;
use crate::se3::Pose;
use crate::{KernelError, Node};

const A: Node = Node(0);
const B: Node = Node(1);

fn camera(direction: Vector3<f64>, min_baseline_m: f64) -> Result<Factor, KernelError> {
    let mount = Pose::identity();
    let rotation = UnitQuaternion::identity();
    Factor::camera(A, B, mount, mount, direction, rotation, &Matrix5::identity(), min_baseline_m)
}

fn rotation(w: f64, x: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::new_unchecked(Quaternion::new(w, x, 0.0, 0.0))
}

#[test]
fn numbers_that_are_not_finite() {
    let nan = f64::NAN;
    let lost = Pose::translation(0.0, nan, 0.0);
    let unit = Matrix6::identity();
    for refused in [
        Factor::prior(A, lost, &unit),
        Factor::odometry(A, B, lost, &unit),
        Factor::relative(A, B, Pose::identity(), &(unit * f64::INFINITY)),
        Factor::attitude(A, rotation(nan, 0.0), 1.0, None),
        Factor::attitude(A, rotation(1.0, 0.0), nan, None),
        Factor::attitude(A, rotation(1.0, 0.0), 1.0, Some(f64::INFINITY)),
        Factor::depth(A, f64::NEG_INFINITY, 1.0),
        Factor::depth(A, 0.0, nan),
        Factor::position(A, Vector3::new(0.0, nan, 0.0), &Matrix3::identity()),
        camera(Vector3::new(nan, 0.0, 1.0), 0.3),
    ] {
        assert!(matches!(refused, Err(KernelError::NotFinite { .. })), "{refused:?}");
    }
}

#[test]
fn lengths_that_are_not_one() {
    for refused in [
        camera(Vector3::new(0.0, 0.0, 1.00001), 0.3),
        camera(Vector3::zeros(), 0.3),
        Factor::attitude(A, rotation(0.9, 0.0), 1.0, None),
        Factor::attitude(A, rotation(0.0, 0.0), 1.0, None),
        Factor::prior(
            A,
            Pose::from_parts(Vector3::zeros().into(), rotation(1.0, 0.01)),
            &Matrix6::identity(),
        ),
    ] {
        assert!(matches!(refused, Err(KernelError::NotUnit { .. })), "{refused:?}");
    }
    assert!(camera(Vector3::new(0.0, 0.0, 1.0 + 5e-7), 0.3).is_ok());
}

#[test]
fn covariances_that_are_none() {
    let mut skewed = Matrix6::identity();
    skewed[(0, 5)] = 0.1;
    assert!(matches!(
        Factor::prior(A, Pose::identity(), &skewed),
        Err(KernelError::NotSymmetric { row: 5, column: 0, .. })
    ));
    let mut flat = Matrix6::identity();
    flat[(4, 4)] = 0.0;
    for refused in [
        Factor::odometry(A, B, Pose::identity(), &flat),
        Factor::depth(A, 0.0, 0.0),
        Factor::attitude(A, rotation(1.0, 0.0), 0.0, None),
        Factor::attitude(A, rotation(1.0, 0.0), 1.0, Some(-1.0)),
        Factor::position(A, Vector3::zeros(), &Matrix3::zeros()),
        Factor::position(A, Vector3::zeros(), &Matrix3::from_diagonal(&[1.0, 0.0, 1.0].into())),
    ] {
        assert!(matches!(refused, Err(KernelError::CovarianceNotPositiveDefinite { .. })), "{refused:?}");
    }
    // A depth variance of zero that is still correlated with the rest is a mistake, not "unobserved".
    let mut correlated = Matrix3::from_diagonal(&[1.0, 1.0, 0.0].into());
    correlated[(0, 2)] = 0.1;
    assert!(Factor::position(A, Vector3::zeros(), &correlated).is_err());
}

#[test]
fn ties_that_tie_nothing() {
    let unit = Matrix6::identity();
    assert_eq!(Factor::odometry(A, A, Pose::identity(), &unit), Err(KernelError::SameNode { node: A }));
    let odometry = Factor::odometry(A, B, Pose::identity(), &unit).unwrap();
    let missing = Err(KernelError::MissingPose { node: B });
    assert_eq!(odometry.chi2(&Pose::identity(), None), missing);
    assert_eq!(odometry.linearize(&Pose::identity(), None).map(|_| 0.0), missing);
    assert_eq!(odometry.validate_geometry(&Pose::identity(), None).map(|()| 0.0), missing);
}

/// 0.3 m are asked for: 0.25 m are refused on arrival, tolerated later, and a collapsed baseline never is.
#[test]
fn baselines_too_short() {
    for min_baseline_m in [0.0, -1.0, f64::NAN] {
        assert!(matches!(camera(Vector3::x(), min_baseline_m), Err(KernelError::NotPositive { .. })));
    }
    let factor = camera(Vector3::x(), 0.3).unwrap();
    let origin = Pose::identity();
    let at = |x: f64| Pose::translation(x, 0.0, 0.0);
    assert_eq!(factor.validate_geometry(&origin, Some(&at(0.31))), Ok(()));
    assert_eq!(
        factor.validate_geometry(&origin, Some(&at(0.25))),
        Err(KernelError::DegenerateBaseline { baseline_m: 0.25, min_baseline_m: 0.3 })
    );
    assert!(factor.linearize(&origin, Some(&at(0.25))).is_ok());
    for baseline_m in [0.02, 0.0] {
        assert!(matches!(
            factor.linearize(&origin, Some(&at(baseline_m))),
            Err(KernelError::DegenerateBaseline { .. })
        ));
    }
}

#[test]
fn poses_that_are_not_finite_give_an_error_and_no_numbers() {
    let lost = Pose::translation(f64::NAN, 0.0, 0.0);
    let factors = [
        Factor::prior(A, Pose::identity(), &Matrix6::identity()).unwrap(),
        Factor::odometry(A, B, Pose::identity(), &Matrix6::identity()).unwrap(),
        Factor::position(A, Vector3::zeros(), &Matrix3::identity()).unwrap(),
        camera(Vector3::x(), 0.3).unwrap(),
    ];
    for factor in factors {
        let other = Pose::translation(1.0, 0.0, 0.0);
        assert!(matches!(factor.linearize(&lost, Some(&other)), Err(KernelError::NotFinite { .. })));
        assert!(matches!(factor.chi2(&lost, Some(&other)), Err(KernelError::NotFinite { .. })));
    }
}

/// Every kind with a covariance takes one turned in single precision, whatever its scale.
#[test]
fn covariances_in_single_precision_are_taken() {
    let turn = crate::so3::exp(&Vector3::new(0.4, -0.2, 0.9));
    let carry = crate::se3::adjoint(&Pose::from_parts(Vector3::new(0.3, 0.1, -0.2).into(), turn));
    for scale in [1.0, 1e-3, 1e-10] {
        let sigma = Matrix6::from_diagonal(&[1.0, 4.0, 9.0, 0.01, 0.04, 0.09].into()) * scale;
        let (carry, sigma) = (carry.cast::<f32>(), sigma.cast::<f32>());
        let covariance = ((carry * sigma) * carry.transpose()).cast::<f64>();
        let of_camera = covariance.fixed_view::<5, 5>(0, 0).into_owned();
        let of_position = covariance.fixed_view::<3, 3>(0, 0).into_owned();
        assert_ne!(covariance, covariance.transpose());
        let mount = Pose::identity();
        let level = UnitQuaternion::identity();
        for taken in [
            Factor::prior(A, Pose::identity(), &covariance),
            Factor::odometry(A, B, Pose::identity(), &covariance),
            Factor::relative(A, B, Pose::identity(), &covariance),
            Factor::position(A, Vector3::zeros(), &of_position),
            Factor::camera(A, B, mount, mount, Vector3::x(), level, &of_camera, 0.3),
        ] {
            assert!(taken.is_ok(), "{taken:?}");
        }
    }
}
