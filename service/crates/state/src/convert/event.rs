//! Events on their way in: everything about them that can be judged without the mission.

use super::shapes::{all_finite, covariance, direction, point, pose, positive, rotation, share, within};
use crate::change::{Change, Measurement, NewKeyframe};
use crate::error::StateError;
use crate::error::translate::kernel;
use crate::event::Event;
use nalgebra::{Matrix2, Matrix3};
use pdn_kernel::gaussian;
use pdn_planning::Saliency;
use pdn_schemas::event::{Appearance, FactorKind, Keyframe};

/// What an event says.
///
/// # Errors
/// The first field that has no meaning, with its path.
pub fn change(event: Event) -> Result<Change, StateError> {
    match event {
        Event::Keyframe(event) => Ok(Change::Keyframe(keyframe(&event)?)),
        Event::Factor(event) => Ok(Change::Measurement(Box::new(measurement(&event.factor)?))),
        Event::Link(event) => {
            Ok(Change::Link { from: event.from, to: event.to, registered: event.registered })
        }
        Event::Undecodable(event) => {
            Err(StateError::Undecodable { code: event.code, message: event.message })
        }
    }
}

fn keyframe(event: &Keyframe) -> Result<NewKeyframe, StateError> {
    Ok(NewKeyframe {
        id: event.id,
        world_from_body: event.pose.as_ref().map(|wire| pose("pose", wire)).transpose()?,
        body_from_camera: event.camera.as_ref().map(|wire| pose("camera", wire)).transpose()?,
        saliency: saliency(&event.appearance)?,
    })
}

fn saliency(appearance: &Appearance) -> Result<Saliency, StateError> {
    let unsupported = |field: &str| {
        let problem =
            "only ready scores are understood by this version; send appearance.saliency or \"none\"";
        Err(StateError::Unsupported { field: format!("appearance.{field}"), problem })
    };
    match appearance {
        Appearance::Saliency { local, global } => Ok(Saliency {
            local: share("appearance.saliency.local", *local)?,
            global: share("appearance.saliency.global", *global)?,
        }),
        Appearance::Words(_) => unsupported("words"),
        Appearance::Descriptors { .. } => unsupported("descriptors"),
        Appearance::None => Ok(Saliency::NONE),
    }
}

fn measurement(factor: &FactorKind) -> Result<Measurement, StateError> {
    Ok(match factor {
        FactorKind::Prior { keyframe, pose: wire, covariance: sigma } => Measurement::Prior {
            keyframe: *keyframe,
            world_from_body: pose("factor.prior.pose", wire)?,
            covariance: covariance("factor.prior.covariance", &sigma.0)?,
        },
        FactorKind::Odometry { from, to, relative, covariance: sigma } => Measurement::Odometry {
            from: *from,
            to: *to,
            relative: pose("factor.odometry.relative", relative)?,
            covariance: covariance("factor.odometry.covariance", &sigma.0)?,
        },
        FactorKind::Relative { from, to, relative, covariance: sigma } => Measurement::Relative {
            from: *from,
            to: *to,
            relative: pose("factor.relative.relative", relative)?,
            covariance: covariance("factor.relative.covariance", &sigma.0)?,
        },
        FactorKind::Camera { from, to, direction: unit, rotation: quaternion, covariance: sigma } => {
            Measurement::Camera {
                from: *from,
                to: *to,
                direction: direction("factor.camera.direction", unit)?,
                rotation: rotation("factor.camera.rotation", quaternion)?,
                covariance: covariance("factor.camera.covariance", sigma)?,
            }
        }
        FactorKind::Attitude {
            keyframe,
            rotation: quaternion,
            tilt_variance_rad2,
            heading_variance_rad2,
        } => {
            let heading = |variance| positive("factor.attitude.heading_variance_rad2", variance);
            Measurement::Attitude {
                keyframe: *keyframe,
                rotation: rotation("factor.attitude.rotation", quaternion)?,
                tilt_variance_rad2: positive("factor.attitude.tilt_variance_rad2", *tilt_variance_rad2)?,
                heading_variance_rad2: heading_variance_rad2.map(heading).transpose()?,
            }
        }
        FactorKind::Depth { keyframe, depth_m, variance_m2 } => Measurement::Depth {
            keyframe: *keyframe,
            depth_m: depth(*depth_m)?,
            variance_m2: positive("factor.depth.variance_m2", *variance_m2)?,
        },
        FactorKind::Position { keyframe, position, covariance: sigma } => Measurement::Position {
            keyframe: *keyframe,
            position: point("factor.position.position", position)?,
            covariance: position_covariance(sigma)?,
        },
    })
}

fn depth(depth_m: f64) -> Result<f64, StateError> {
    let holds = depth_m.abs() <= super::shapes::MAX_COORDINATE_M;
    within("factor.depth.depth_m", depth_m, "in [-1e7, 1e7] m", holds)
}

/// Of all three components, or, with a third row and column of zeros, of the horizontal ones.
fn position_covariance(values: &[f64; 9]) -> Result<Matrix3<f64>, StateError> {
    let field = "factor.position.covariance";
    if [2, 5, 6, 7, 8].iter().any(|index| values[*index] != 0.0) {
        return covariance(field, values);
    }
    all_finite(field, values)?;
    let horizontal = Matrix2::new(values[0], values[1], values[3], values[4]);
    gaussian::validate(&horizontal).map_err(|error| kernel(field, error))?;
    Ok(Matrix3::from_row_slice(values))
}
