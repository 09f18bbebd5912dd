//! What may be expected at the places that round trips pass [PDN12, eqs. 1, 3]. Trips that begin alike pass
//! the same places, and what is expected there is found once, when the first of them asks.

use crate::error::PlanningError;
use crate::memo::get_or_try_init;
use crate::registration::{Link, links};
use crate::round_trip::RoundTrip;
use crate::snapshot::{Snapshot, SnapshotKeyframe};
use nalgebra::{Matrix5, Matrix6, Vector5};
use pdn_kernel::elimination::{VirtualLink, VirtualPath, VirtualPlace, VirtualSteps};
use pdn_kernel::information::PairInformation;
use pdn_kernel::se3::Pose;
use pdn_kernel::{Node, information};
use std::cmp::Ordering;
use std::sync::{Arc, OnceLock};

/// The places of some round trips, with what is expected there as far as it has been asked for.
pub struct ExpectedPlaces<'a> {
    snapshot: &'a Snapshot,
    robot: Node,
    /// The robot's place first, each after the one before it on its trips.
    places: Vec<Place>,
    /// For each trip its places, the robot's first.
    of_trips: Vec<Vec<u32>>,
}

/// A place, as it is come to from the one before.
struct Place {
    world_from_body: Pose,
    /// Index of the place before; none for the robot's.
    before: Option<u32>,
    expected: OnceLock<Arc<VirtualPlace>>,
}

impl<'a> ExpectedPlaces<'a> {
    /// Nothing is asked yet. Cost: a comparison for each place of each trip.
    ///
    /// # Errors
    /// [`PlanningError::NoKeyframe`].
    pub fn new(snapshot: &'a Snapshot, trips: &[&RoundTrip]) -> Result<ExpectedPlaces<'a>, PlanningError> {
        let robot = snapshot.robot()?;
        let mut order: Vec<usize> = (0..trips.len()).collect();
        order.sort_by(|&one, &other| by_places(trips[one], trips[other]).then(one.cmp(&other)));
        let mut places = vec![Place::new(snapshot.keyframe(robot).world_from_body, None)];
        let mut of_trips = vec![Vec::new(); trips.len()];
        let mut visited: Vec<u32> = vec![0];
        for trip in order {
            let outbound = &trips[trip].poses[..trips[trip].poses.len() / 2];
            let is_same = |(&place, pose): (&u32, &Pose)| places[place as usize].world_from_body == *pose;
            let shared = visited[1..].iter().zip(outbound).take_while(|&pair| is_same(pair)).count();
            visited.truncate(1 + shared);
            for pose in &outbound[shared..] {
                places.push(Place::new(*pose, visited.last().copied()));
                visited.push(places.len() as u32 - 1);
            }
            of_trips[trip].clone_from(&visited);
        }
        Ok(ExpectedPlaces { snapshot, robot, places, of_trips })
    }

    /// What a trip, by its index, adds to the information: Lambda_odo, Lambda_cam and the absolute sensors',
    /// with virtual node 0 at the robot. Cost: what is expected at places that no trip has asked for.
    ///
    /// # Errors
    /// The kernel's finding about a baseline.
    pub fn path(&self, trip: usize) -> Result<VirtualPath, PlanningError> {
        let places = self.of_trips[trip].iter().map(|&place| self.expected(place).cloned());
        Ok(VirtualPath { robot: self.robot, places: places.collect::<Result<_, _>>()? })
    }

    fn expected(&self, place: u32) -> Result<&Arc<VirtualPlace>, PlanningError> {
        let Place { world_from_body: pose, before, expected } = &self.places[place as usize];
        get_or_try_init(expected, || {
            let from = before.map(|before| &self.places[before as usize].world_from_body);
            let steps = |from| VirtualSteps {
                out: expected_odometry(self.snapshot, from, pose),
                back: expected_odometry(self.snapshot, pose, from),
            };
            Ok(Arc::new(VirtualPlace {
                unary: absolute_information(self.snapshot, pose),
                steps: from.map(steps),
                links: expected_registrations(self.snapshot, pose)?,
            }))
        })
    }
}

impl Place {
    fn new(world_from_body: Pose, before: Option<u32>) -> Place {
        Place { world_from_body, before, expected: OnceLock::new() }
    }
}

/// An order in which trips with common beginnings are neighbours.
pub(crate) fn by_places(one: &RoundTrip, other: &RoundTrip) -> Ordering {
    let by_coordinates = |(one, other): (&Pose, &Pose)| {
        let coordinates = one.translation.vector.iter().zip(&other.translation.vector);
        coordinates.map(|(one, other)| one.total_cmp(other)).find(|order| order.is_ne())
    };
    let differing = one.poses.iter().zip(&other.poses).find_map(by_coordinates);
    differing.unwrap_or(one.poses.len().cmp(&other.poses.len()))
}

/// H^T Q^-1 H with Q = diag(sigma^2) d, d the distance between the nodes [PDN12, eq. 1].
fn expected_odometry(snapshot: &Snapshot, from: &Pose, to: &Pose) -> PairInformation {
    let distance_m = (to.translation.vector - from.translation.vector).norm();
    let sigmas = snapshot.settings.odometry_sigmas_per_sqrt_m * distance_m.sqrt();
    information::odometry(from, to, &Matrix6::from_diagonal(&sigmas.map(|sigma| 1.0 / sigma)))
}

/// Attitude: rows R on phi, in world axes; depth: third row of R on rho. Zero with `expect_absolute` off.
fn absolute_information(snapshot: &Snapshot, pose: &Pose) -> Matrix6<f64> {
    let settings = &snapshot.settings;
    let mut sum = Matrix6::zeros();
    if !settings.expect_absolute {
        return sum;
    }
    if let Some(tilt_sigma_rad) = settings.tilt_sigma_rad {
        sum += information::attitude(pose, tilt_sigma_rad, settings.heading_sigma_rad);
    }
    if let Some(sigma_m) = settings.depth_sigma_m {
        sum += information::depth(pose, sigma_m);
    }
    sum
}

/// H^T R^-1 H of each registration that a virtual node may expect at a place [PDN12, eq. 3].
fn expected_registrations(snapshot: &Snapshot, pose: &Pose) -> Result<Vec<VirtualLink>, PlanningError> {
    let settings = &snapshot.settings;
    let [direction, rotation] = [settings.direction_sigma_rad, settings.rotation_sigma_rad].map(f64::recip);
    let weight = Matrix5::from_diagonal(&Vector5::new(direction, direction, rotation, rotation, rotation));
    let nearest = snapshot.nearest(&pose.translation.vector)?;
    let body_from_camera = &snapshot.keyframe(nearest).body_from_camera;
    let with_information = |Link { keyframe, probability }: Link| {
        let SnapshotKeyframe { world_from_body, body_from_camera: target_from_camera, .. } =
            snapshot.keyframe(keyframe);
        let information =
            information::camera(world_from_body, target_from_camera, pose, body_from_camera, &weight)?;
        Ok(VirtualLink { keyframe, information, probability })
    };
    links(snapshot, pose, nearest).into_iter().map(with_information).collect()
}
