//! Attitudes that are systematically others than the poses of their keyframes: the conventions by which they
//! may have been made.

use super::recent::{AttitudeReading, RecentEvents};
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use pdn_kernel::se3::Pose;

/// So many of the last attitudes are looked at, and at least half as many must be off in a row.
const LOOKED_AT: usize = 16;

/// An attitude that is farther from its keyframe's is off, rad: no sensor and no drift is off by 30 degrees
/// and every convention mistaken for another, unless the vehicle lies as it makes no difference.
const OFF_RAD: f64 = 0.52;

/// A convention explains an attitude that it leaves this far off, rad: half of what is off.
const EXPLAINED_RAD: f64 = 0.5 * OFF_RAD;

/// Tells of attitudes that are all off; `estimate` gives the pose of a keyframe of the graph.
pub(crate) fn attitudes(recent: &RecentEvents, estimate: impl Fn(u64) -> Option<Pose>) -> Option<String> {
    let known = |reading: AttitudeReading| Some((reading, estimate(reading.keyframe)?.rotation));
    let last: Vec<(AttitudeReading, UnitQuaternion<f64>)> =
        recent.attitudes().filter_map(known).take(LOOKED_AT).collect();
    let off = |(reading, pose): &(AttitudeReading, UnitQuaternion<f64>)| {
        angle_rad(&read(&reading.rotation), pose, reading.has_heading)
    };
    let least_rad = last.iter().map(off).fold(f64::INFINITY, f64::min);
    if last.len() < LOOKED_AT / 2 || least_rad <= OFF_RAD {
        return None;
    }
    let causes: Vec<&str> =
        CONVENTIONS.iter().filter(|one| explains(one, &last)).map(|one| one.what).collect();
    let cause = if causes.is_empty() {
        "no usual convention explains it; check the sensor's mounting and the first keyframe's pose"
            .to_string()
    } else {
        format!("as if they were sent {}", causes.join(", or "))
    };
    Some(format!(
        "the last {} attitudes are all {:.0} degrees or more off the poses of their keyframes, {cause}; \
         rotation is that of world_from_body as [x, y, z, w], the world north, east, down, the body forward, \
         right, down",
        last.len(),
        least_rad.to_degrees().floor()
    ))
}

/// A way to write an attitude other than the contract's.
struct Convention {
    /// What was sent, to follow "as if they were sent".
    what: &'static str,
    /// What is meant by what was sent.
    meant: fn(&[f64; 4]) -> UnitQuaternion<f64>,
}

const CONVENTIONS: [Convention; 5] = [
    Convention { what: "with w first", meant: |[w, x, y, z]| read(&[*x, *y, *z, *w]) },
    Convention { what: "of a body with z up", meant: |sent| read(sent) * about_x() },
    Convention { what: "in a world with z up", meant: |sent| about_x() * read(sent) },
    Convention {
        what: "of a body with z up in a world of east, north, up",
        meant: |sent| north_from_east() * read(sent) * about_x(),
    },
    Convention { what: "as body_from_world", meant: |sent| read(sent).inverse() },
];

fn explains(convention: &Convention, last: &[(AttitudeReading, UnitQuaternion<f64>)]) -> bool {
    last.iter().all(|(reading, pose)| {
        angle_rad(&(convention.meant)(&reading.rotation), pose, reading.has_heading) <= EXPLAINED_RAD
    })
}

/// The angle between two attitudes; without a heading that between their verticals.
fn angle_rad(one: &UnitQuaternion<f64>, other: &UnitQuaternion<f64>, has_heading: bool) -> f64 {
    if has_heading {
        return one.angle_to(other);
    }
    let down = |rotation: &UnitQuaternion<f64>| rotation.inverse() * Vector3::z();
    down(one).angle(&down(other))
}

/// A rotation of `[x, y, z, w]`.
fn read(values: &[f64; 4]) -> UnitQuaternion<f64> {
    UnitQuaternion::new_normalize(Quaternion::from_vector((*values).into()))
}

/// Half a turn about x.
fn about_x() -> UnitQuaternion<f64> {
    UnitQuaternion::new_unchecked(Quaternion::new(0.0, 1.0, 0.0, 0.0))
}

/// From east, north, up to north, east, down.
fn north_from_east() -> UnitQuaternion<f64> {
    let axes = Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes))
}
