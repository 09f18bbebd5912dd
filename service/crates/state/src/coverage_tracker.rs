//! The area that has been photographed, by the corrected trajectory: the raster follows the linearisation
//! points.

use pdn_kernel::Node;
use pdn_kernel::se3::Pose;
use pdn_planning::Coverage;

/// The rasters, and where they have each keyframe.
#[derive(Clone, Debug)]
pub(crate) struct CoverageTracker {
    coverage: Coverage,
    /// By node, the pose of the camera that is in the raster.
    cameras: Vec<Option<Pose>>,
}

/// What leads back from one [`CoverageTracker::follow`]: nodes whose camera moved in the raster, and from
/// where.
#[derive(Clone, Debug, Default)]
pub(crate) struct MovedCameras {
    nodes_before: usize,
    cameras: Vec<(usize, u64, Option<Pose>)>,
}

impl CoverageTracker {
    /// Nothing photographed yet.
    pub(crate) fn new(coverage: Coverage) -> CoverageTracker {
        CoverageTracker { coverage, cameras: Vec::new() }
    }

    /// The rasters.
    pub(crate) fn coverage(&self) -> &Coverage {
        &self.coverage
    }

    /// By node, where its photograph lies; none before the first.
    pub(crate) fn cameras(&self) -> Vec<Option<Pose>> {
        self.cameras.clone()
    }

    /// Puts the photographs of an empty tracker where [`CoverageTracker::cameras`] had them; `keyframe` gives
    /// a node's keyframe.
    pub(crate) fn restore(&mut self, cameras: Vec<Option<Pose>>, keyframe: impl Fn(usize) -> u64) {
        for (node, world_from_camera) in cameras.iter().enumerate() {
            if let Some(pose) = world_from_camera {
                self.coverage.place(keyframe(node), pose);
            }
        }
        self.cameras = cameras;
    }

    /// Moves the rasters to where the keyframes are linearised now. `moved` names those that have moved since
    /// the last time, in any order; new ones need not be named. `camera` gives a node's keyframe and its
    /// `body_from_camera`. Cost: that of a look at these, and the cells of those that are elsewhere.
    pub(crate) fn follow(
        &mut self,
        linearizations: &[Pose],
        moved: &[Node],
        camera: impl Fn(usize) -> (u64, Pose),
    ) -> MovedCameras {
        let mut followed = MovedCameras { nodes_before: self.cameras.len(), cameras: Vec::new() };
        let known = moved.iter().map(|node| node.index()).filter(|&node| node < self.cameras.len());
        let mut nodes: Vec<usize> = known.chain(self.cameras.len()..linearizations.len()).collect();
        nodes.sort_unstable();
        nodes.dedup();
        self.cameras.resize(linearizations.len(), None);
        for node in nodes {
            let (keyframe, body_from_camera) = camera(node);
            let world_from_camera = linearizations[node] * body_from_camera;
            if self.coverage.place(keyframe, &world_from_camera) {
                followed.cameras.push((node, keyframe, self.cameras[node].replace(world_from_camera)));
            }
        }
        followed
    }

    /// Takes one [`CoverageTracker::follow`] back; the last one first.
    pub(crate) fn roll_back(&mut self, moved: MovedCameras) {
        for (node, keyframe, before) in moved.cameras {
            self.coverage.remove(keyframe);
            if let Some(world_from_camera) = &before {
                self.coverage.place(keyframe, world_from_camera);
            }
            self.cameras[node] = before;
        }
        self.cameras.truncate(moved.nodes_before);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use pdn_planning::coverage::{Facet, FieldOfView};

    fn floor() -> CoverageTracker {
        let facet = Facet {
            origin: Vector3::new(-3.0, -3.0, 1.5),
            u: Vector3::y(),
            v: Vector3::x(),
            length_u_m: 6.0,
            length_v_m: 6.0,
        };
        let view = FieldOfView { horizontal_rad: 0.98, vertical_rad: 0.77, max_range_m: 3.0 };
        CoverageTracker::new(Coverage::new(&[facet], 0.1, view).expect("a plain floor"))
    }

    fn follow(tracker: &mut CoverageTracker, poses: &[Pose]) -> MovedCameras {
        let all: Vec<Node> = (0..poses.len() as u32).map(Node).collect();
        tracker.follow(poses, &all, |node| (node as u64, Pose::identity()))
    }

    /// Poses that differ by less than half a cell are told apart only by where the raster was before: if a
    /// roll back left anything, it would show in some of the places.
    #[test]
    fn a_roll_back_leaves_nothing() {
        for place in 0..20 {
            let at = |offset_m: f64| Pose::translation(0.01 * f64::from(place) + offset_m, 0.0, 0.0);
            let (mut straight, mut detour) = (floor(), floor());
            for tracker in [&mut straight, &mut detour] {
                follow(tracker, &[at(0.0)]);
            }
            let moved = follow(&mut detour, &[at(0.2), at(0.5)]);
            assert_eq!(moved.cameras.len(), 2);
            detour.roll_back(moved);
            assert_eq!(detour.coverage().facets(), straight.coverage().facets());
            for tracker in [&mut straight, &mut detour] {
                follow(tracker, &[at(0.03), at(0.53)]);
            }
            assert_eq!(detour.coverage().facets(), straight.coverage().facets());
        }
    }

    /// Told of what moved alone, and twice, in any order, the raster is where it is when it looks at every
    /// keyframe.
    #[test]
    fn a_look_at_what_moved_is_a_look_at_all() {
        let (mut told, mut asked) = (floor(), floor());
        let mut poses: Vec<Pose> = Vec::new();
        for step in 0..120_usize {
            let mut moved = Vec::new();
            for node in (0..poses.len()).rev().filter(|node| (node + step) % 7 == 0) {
                poses[node].translation.x += 0.02 * (1.0 + (step % 4) as f64);
                moved.extend([Node(node as u32); 2]);
            }
            poses.push(Pose::translation(0.04 * step as f64 - 2.0, 0.3 * (step % 5) as f64, 0.0));
            let camera = |node: usize| (node as u64, Pose::identity());
            let before = told.coverage().facets();
            for _ in 0..step % 3 {
                let rollback = told.follow(&poses, &moved, camera);
                told.roll_back(rollback);
                assert_eq!(told.coverage().facets(), before, "back from {step}");
            }
            told.follow(&poses, &moved, camera);
            follow(&mut asked, &poses);
            assert_eq!(told.coverage().facets(), asked.coverage().facets(), "{step}");
        }
    }
}
