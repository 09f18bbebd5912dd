use nalgebra::{Matrix3, Matrix5, Matrix6, SMatrix, Unit, UnitQuaternion, Vector3};

use super::{
    Factor, FactorKind, Measurement, attitude::AttitudeMeasurement, camera::CameraMeasurement,
    depth::DepthMeasurement, position::PositionMeasurement, prior::PriorMeasurement,
    relative::RelativeMeasurement,
};
use crate::gaussian::{square_root_information, standard_information, validate_finite};
use crate::{KernelError, Loss, Node, se3::Pose};

/// How far the norm of a quaternion or of a direction may be from 1. What is nearer is normalised.
///
/// Normalised in single precision it is within 4 u = 2.4e-7 to first order, u = 2^-24 (for four components
/// half of four roundings of the sum of squares, one of the root, one of the division; 2.6 u were measured),
/// and written with nine digits within another u.
const UNIT_TOLERANCE: f64 = 1e-6;

/// One constructor a kind. All refuse numbers that are not finite (`NotFinite`), rotations and directions
/// that are not of length 1 (`NotUnit`), and what is no covariance (`NotSymmetric`,
/// `CovarianceNotPositiveDefinite`); those between two keyframes also `SameNode`. The loss is none until
/// [`Factor::with_loss`].
impl Factor {
    /// `world_from_body` of `node`, known beforehand: residual Log(Z^-1 X). Covariance of the right
    /// perturbation of X.
    pub fn prior(
        node: Node,
        world_from_body: Pose,
        covariance: &Matrix6<f64>,
    ) -> Result<Factor, KernelError> {
        let world_from_body = validated_pose("prior pose", &world_from_body)?;
        let whitening = square_root_information(covariance)?;
        let measurement = Measurement::Prior(PriorMeasurement { world_from_body });
        Ok(Self::unary(FactorKind::Prior, node, measurement, whitening))
    }

    /// How the vehicle moved: `relative` maps `to` into `from`. Residual Log(Z^-1 X_from^-1 X_to)
    /// (`[PDN12, eq. 1]`).
    pub fn odometry(
        from: Node,
        to: Node,
        relative: Pose,
        covariance: &Matrix6<f64>,
    ) -> Result<Factor, KernelError> {
        Self::between(FactorKind::Odometry, from, to, &relative, covariance)
    }

    /// The same measurement of any two keyframes, such as a registered point cloud.
    pub fn relative(
        from: Node,
        to: Node,
        relative: Pose,
        covariance: &Matrix6<f64>,
    ) -> Result<Factor, KernelError> {
        Self::between(FactorKind::Relative, from, to, &relative, covariance)
    }

    /// A camera registration: the unit `direction` to the camera of `to` and its `rotation`, both seen from
    /// the camera of `from`. The covariance is of the two components of the direction in the tangent plane
    /// (basis as in [`crate::factors`]), then of the rotation vector. Cameras nearer than `min_baseline_m`
    /// (positive, else `NotPositive`) are refused once poses are known.
    ///
    /// The residual compares directions by the tangent plane's coordinates of u alone, so it does not tell u
    /// from its mirror image behind that plane; an estimate must start within 90 degrees of the measured
    /// direction.
    #[allow(clippy::too_many_arguments)]
    pub fn camera(
        from: Node,
        to: Node,
        from_body_from_camera: Pose,
        to_body_from_camera: Pose,
        direction: Vector3<f64>,
        rotation: UnitQuaternion<f64>,
        covariance: &Matrix5<f64>,
        min_baseline_m: f64,
    ) -> Result<Factor, KernelError> {
        different(from, to)?;
        if min_baseline_m.is_nan() || min_baseline_m <= 0.0 {
            return Err(KernelError::NotPositive { what: "least baseline", value: min_baseline_m });
        }
        let measurement = CameraMeasurement::new(
            &validated_pose("camera of `from`", &from_body_from_camera)?,
            &validated_pose("camera of `to`", &to_body_from_camera)?,
            &validated_direction(&direction)?,
            &validated_rotation("camera rotation", &rotation)?,
        );
        Ok(Self {
            nodes: (from, Some(to)),
            kind: FactorKind::Camera,
            measurement: Measurement::Camera { measurement, min_baseline_m },
            whitening: padded(&square_root_information(covariance)?),
            loss: Loss::None,
        })
    }

    /// `rotation` is the measured `world_from_body`. The variances (rad^2) are of the error Log(R Z^T) about
    /// the world's horizontal axes (tilt) and its vertical one (heading); `None`: the heading is not observed
    /// and its row dropped.
    ///
    /// The rows are those of the full Log even then. So `rotation` should carry a heading near the vehicle's,
    /// such as the estimated one: with a heading that is off by a, tilt counts (a/2)^2 / sin^2(a/2) times
    /// (1.02 at 30 degrees, 2.5 at 180, where its sign becomes arbitrary).
    pub fn attitude(
        node: Node,
        rotation: UnitQuaternion<f64>,
        tilt_variance: f64,
        heading_variance: Option<f64>,
    ) -> Result<Factor, KernelError> {
        let measurement = AttitudeMeasurement { world_from_body: validated_rotation("attitude", &rotation)? };
        let tilt = standard_information(tilt_variance)?;
        let heading = heading_variance.map_or(Ok(0.0), standard_information)?;
        let whitening = padded(&Matrix3::from_diagonal(&Vector3::new(tilt, tilt, heading)));
        Ok(Self::unary(FactorKind::Attitude, node, Measurement::Attitude(measurement), whitening))
    }

    /// Depth of the body's origin below the world's, metres, positive down; variance in m^2.
    pub fn depth(node: Node, depth_m: f64, variance: f64) -> Result<Factor, KernelError> {
        validate_finite("depth", &[depth_m])?;
        let whitening = padded(&SMatrix::<f64, 1, 1>::new(standard_information(variance)?));
        Ok(Self::unary(FactorKind::Depth, node, Measurement::Depth(DepthMeasurement { depth_m }), whitening))
    }

    /// `position` of the body's origin in the world, metres, with its covariance in world axes. A third row
    /// and column of zeros says that the depth is not observed.
    pub fn position(
        node: Node,
        position: Vector3<f64>,
        covariance: &Matrix3<f64>,
    ) -> Result<Factor, KernelError> {
        validate_finite("position", position.as_slice())?;
        let depth_unobserved = covariance.row(2).iter().chain(covariance.column(2).iter()).all(|v| *v == 0.0);
        let whitening = if depth_unobserved {
            padded(&square_root_information(&covariance.fixed_view::<2, 2>(0, 0).into_owned())?)
        } else {
            padded(&square_root_information(covariance)?)
        };
        let measurement = Measurement::Position(PositionMeasurement { position_in_world: position });
        Ok(Self::unary(FactorKind::Position, node, measurement, whitening))
    }

    fn between(
        kind: FactorKind,
        from: Node,
        to: Node,
        relative: &Pose,
        covariance: &Matrix6<f64>,
    ) -> Result<Factor, KernelError> {
        different(from, to)?;
        let relative = validated_pose("relative pose", relative)?;
        Ok(Self {
            nodes: (from, Some(to)),
            kind,
            measurement: Measurement::Relative(RelativeMeasurement { relative }),
            whitening: square_root_information(covariance)?,
            loss: Loss::None,
        })
    }

    fn unary(kind: FactorKind, node: Node, measurement: Measurement, whitening: Matrix6<f64>) -> Factor {
        Self { nodes: (node, None), kind, measurement, whitening, loss: Loss::None }
    }
}

fn different(from: Node, to: Node) -> Result<(), KernelError> {
    if from == to { Err(KernelError::SameNode { node: from }) } else { Ok(()) }
}

fn validated_pose(what: &'static str, pose: &Pose) -> Result<Pose, KernelError> {
    validate_finite(what, pose.translation.vector.as_slice())?;
    Ok(Pose::from_parts(pose.translation, validated_rotation(what, &pose.rotation)?))
}

fn validated_rotation(
    what: &'static str,
    rotation: &UnitQuaternion<f64>,
) -> Result<UnitQuaternion<f64>, KernelError> {
    validate_finite(what, rotation.coords.as_slice())?;
    validate_unit(what, rotation.coords.norm())?;
    Ok(Unit::new_normalize(rotation.into_inner()))
}

fn validated_direction(direction: &Vector3<f64>) -> Result<Vector3<f64>, KernelError> {
    let what = "baseline direction";
    validate_finite(what, direction.as_slice())?;
    validate_unit(what, direction.norm())?;
    Ok(direction.normalize())
}

fn validate_unit(what: &'static str, norm: f64) -> Result<(), KernelError> {
    if (norm - 1.0).abs() > UNIT_TOLERANCE { Err(KernelError::NotUnit { what, norm }) } else { Ok(()) }
}

fn padded<const D: usize>(whitening: &SMatrix<f64, D, D>) -> Matrix6<f64> {
    let mut matrix = Matrix6::zeros();
    matrix.view_mut((0, 0), (D, D)).copy_from(whitening);
    matrix
}
