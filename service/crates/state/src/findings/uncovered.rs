//! Nothing of the target is covered: what the last cameras see of it instead.

use nalgebra::{UnitQuaternion, Vector3};
use pdn_kernel::se3::Pose;
use pdn_planning::coverage::{Facet, FieldOfView};

/// Keyframes of the graph before it is told that none covers anything: a vehicle may come from some metres
/// beside its target.
pub(crate) const MIN_KEYFRAMES: usize = 20;

/// So many of the last cameras are looked at.
pub(crate) const LOOKED_AT: usize = 8;

/// Rays along each axis by which a field of view is looked at, and how far out they go of its edge.
const RAYS: i32 = 5;
const RIM: f64 = 0.98;

/// Why a camera covers nothing, the surest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Cause {
    Behind,
    CameraSign,
    TargetSign,
    Turned,
    Far,
    Elsewhere,
}

const CAUSES: [Cause; 6] =
    [Cause::Behind, Cause::CameraSign, Cause::TargetSign, Cause::Turned, Cause::Far, Cause::Elsewhere];

/// Why none of the keyframes covers anything, by the last cameras (world_from_camera). Cost: the facets times
/// the cameras.
pub(crate) fn uncovered(keyframes: usize, cameras: &[Pose], facets: &[Facet], view: &FieldOfView) -> String {
    let mirrored: Vec<Facet> = facets.iter().map(mirrored).collect();
    let causes: Vec<Cause> = cameras.iter().map(|camera| cause(camera, facets, &mirrored, view)).collect();
    let count = |cause: Cause| causes.iter().filter(|other| **other == cause).count();
    // Of several that are as frequent the surest.
    let likeliest = CAUSES.into_iter().rev().max_by_key(|cause| count(*cause)).unwrap_or(Cause::Elsewhere);
    let range_m = view.max_range_m;
    let why = match likeliest {
        Cause::Behind => "the last ones look at facets from behind: a facet is seen from the side to which \
                          u x v points; exchange u and v in target.facets"
            .to_string(),
        Cause::CameraSign => {
            "the last ones would see it if the z of their poses had the other sign: the world \
                              is north, east, down, so z and depth_m grow downwards"
                .to_string()
        }
        Cause::TargetSign => {
            "the last ones would see it if the z of the facets had the other sign: the world \
                              is north, east, down, so z grows downwards"
                .to_string()
        }
        Cause::Turned => {
            "the last cameras look away from it: check camera.body_from_camera and the attitudes".to_string()
        }
        Cause::Far => {
            let depths = cameras.iter().filter_map(|camera| nearest(camera, facets, view));
            let depth_m = depths.map(|hit| hit.depth_m).fold(f64::INFINITY, f64::min);
            format!(
                "what the last ones look at is {depth_m:.1} m away along the optical axis, beyond \
                 camera.max_range_m = {range_m}"
            )
        }
        Cause::Elsewhere => "no facet lies in the field of view of the last ones, however far: the place of \
                             the target and the poses do not fit, or camera.body_from_camera is another"
            .to_string(),
    };
    format!("none of the {keyframes} keyframes has photographed anything of the target; {why}")
}

fn cause(camera: &Pose, facets: &[Facet], mirrored: &[Facet], view: &FieldOfView) -> Cause {
    let hit = nearest(camera, facets, view);
    let in_range = |camera: &Pose, facets: &[Facet]| {
        nearest(camera, facets, view).is_some_and(|hit| hit.depth_m <= view.max_range_m)
    };
    match hit {
        Some(hit) if hit.depth_m <= view.max_range_m && hit.is_behind => Cause::Behind,
        _ if in_range(&with_other_sign(camera), facets) => Cause::CameraSign,
        _ if in_range(camera, mirrored) => Cause::TargetSign,
        _ if in_range(&turned(camera), facets) => Cause::Turned,
        Some(_) => Cause::Far,
        None => Cause::Elsewhere,
    }
}

/// What a ray of a field of view meets.
struct Hit {
    /// Along the optical axis.
    depth_m: f64,
    /// Whether the facet shows its other side.
    is_behind: bool,
}

/// The nearest facet before a camera, by some rays of its field of view.
fn nearest(camera: &Pose, facets: &[Facet], view: &FieldOfView) -> Option<Hit> {
    let at = camera.translation.vector;
    let mut nearest: Option<Hit> = None;
    for ray in rays(view) {
        let ray = camera.rotation * ray;
        for facet in facets {
            let normal = facet.u.cross(&facet.v);
            let depth_m = (facet.origin - at).dot(&normal) / ray.dot(&normal);
            let from_corner = at + ray * depth_m - facet.origin;
            let holds = (0.0..=facet.length_u_m).contains(&from_corner.dot(&facet.u))
                && (0.0..=facet.length_v_m).contains(&from_corner.dot(&facet.v));
            let is_nearer = nearest.as_ref().is_none_or(|known| depth_m < known.depth_m);
            if depth_m > 0.0 && depth_m.is_finite() && holds && is_nearer {
                nearest = Some(Hit { depth_m, is_behind: ray.dot(&normal) > 0.0 });
            }
        }
    }
    nearest
}

/// Directions in the camera frame, of length 1 along the optical axis.
fn rays(view: &FieldOfView) -> impl Iterator<Item = Vector3<f64>> {
    let (x, y) = ((0.5 * view.horizontal_rad).tan() * RIM, (0.5 * view.vertical_rad).tan() * RIM);
    let share = |index: i32| f64::from(2 * index - (RAYS - 1)) / f64::from(RAYS - 1);
    (0..RAYS * RAYS).map(move |index| Vector3::new(x * share(index / RAYS), y * share(index % RAYS), 1.0))
}

/// The camera at the height of the other sign, with its attitude as it is.
fn with_other_sign(camera: &Pose) -> Pose {
    let mut other = *camera;
    other.translation.vector.z = -other.translation.vector.z;
    other
}

/// The facet at the height of the other sign.
fn mirrored(facet: &Facet) -> Facet {
    let mirrored = |vector: Vector3<f64>| Vector3::new(vector.x, vector.y, -vector.z);
    Facet { origin: mirrored(facet.origin), u: mirrored(facet.u), v: mirrored(facet.v), ..*facet }
}

/// The camera that looks the other way.
fn turned(camera: &Pose) -> Pose {
    let half_turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    Pose::from_parts(camera.translation, camera.rotation * half_turn)
}
