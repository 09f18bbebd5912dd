//! The area that has been photographed, by the corrected trajectory: the raster follows the linearisation points.

use pdn_kernel::se3::Pose;
use pdn_planning::Coverage;

/// The rasters, and where they have each keyframe.
#[derive(Clone, Debug)]
pub(crate) struct Trail {
    coverage: Coverage,
    /// By node.
    followed: Vec<Followed>,
}

/// The way back from one [`Trail::follow`]: nodes whose camera moved in the raster, and from where.
#[derive(Clone, Debug, Default)]
pub(crate) struct Moved {
    nodes_before: usize,
    cameras: Vec<(usize, u64, Option<Pose>)>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Followed {
    /// The linearisation point that the raster was last compared with; none to compare again.
    world_from_body: Option<Pose>,
    /// The pose of the camera that is in the raster; none before the first.
    world_from_camera: Option<Pose>,
}

impl Trail {
    /// Nothing photographed yet.
    pub(crate) fn new(coverage: Coverage) -> Trail {
        Trail { coverage, followed: Vec::new() }
    }

    /// The rasters.
    pub(crate) fn coverage(&self) -> &Coverage {
        &self.coverage
    }

    /// By node, where its photograph lies; none before the first.
    pub(crate) fn cameras(&self) -> Vec<Option<Pose>> {
        self.followed.iter().map(|followed| followed.world_from_camera).collect()
    }

    /// Puts the photographs of an empty trail where [`Trail::cameras`] had them; `keyframe` gives a node's keyframe.
    pub(crate) fn restore(&mut self, cameras: Vec<Option<Pose>>, keyframe: impl Fn(usize) -> u64) {
        for (node, world_from_camera) in cameras.into_iter().enumerate() {
            if let Some(pose) = &world_from_camera {
                self.coverage.place(keyframe(node), pose);
            }
            self.followed.push(Followed { world_from_body: None, world_from_camera });
        }
    }

    /// Moves the rasters to where the keyframes are linearised now; `camera` gives a node's keyframe and its
    /// `body_from_camera`. Cost: a comparison for a node that has not moved, its cells for one that has.
    pub(crate) fn follow(&mut self, linearizations: &[Pose], camera: impl Fn(usize) -> (u64, Pose)) -> Moved {
        let mut moved = Moved { nodes_before: self.followed.len(), cameras: Vec::new() };
        self.followed.resize_with(linearizations.len(), Followed::default);
        for (node, (followed, world_from_body)) in self.followed.iter_mut().zip(linearizations).enumerate() {
            if followed.world_from_body.as_ref() == Some(world_from_body) {
                continue;
            }
            followed.world_from_body = Some(*world_from_body);
            let (keyframe, body_from_camera) = camera(node);
            let world_from_camera = world_from_body * body_from_camera;
            if self.coverage.place(keyframe, &world_from_camera) {
                moved.cameras.push((node, keyframe, followed.world_from_camera.replace(world_from_camera)));
            }
        }
        moved
    }

    /// Takes one [`Trail::follow`] back; the last one first.
    pub(crate) fn step_back(&mut self, moved: Moved) {
        for (node, keyframe, before) in moved.cameras {
            self.coverage.remove(keyframe);
            if let Some(world_from_camera) = &before {
                self.coverage.place(keyframe, world_from_camera);
            }
            self.followed[node] = Followed { world_from_body: None, world_from_camera: before };
        }
        self.followed.truncate(moved.nodes_before);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use pdn_planning::coverage::{Facet, FieldOfView};

    fn floor() -> Trail {
        let facet = Facet {
            origin: Vector3::new(-3.0, -3.0, 1.5),
            u: Vector3::y(),
            v: Vector3::x(),
            length_u_m: 6.0,
            length_v_m: 6.0,
        };
        let view = FieldOfView { horizontal_rad: 0.98, vertical_rad: 0.77, max_range_m: 3.0 };
        Trail::new(Coverage::new(&[facet], 0.1, view).expect("a plain floor"))
    }

    fn follow(trail: &mut Trail, poses: &[Pose]) -> Moved {
        trail.follow(poses, |node| (node as u64, Pose::identity()))
    }

    /// Poses that differ by less than half a cell are told apart only by where the raster was before: if a step back left
    /// anything, it would show in some of the places.
    #[test]
    fn a_step_back_leaves_nothing() {
        for place in 0..20 {
            let at = |offset_m: f64| Pose::translation(0.01 * f64::from(place) + offset_m, 0.0, 0.0);
            let (mut straight, mut detour) = (floor(), floor());
            for trail in [&mut straight, &mut detour] {
                follow(trail, &[at(0.0)]);
            }
            let moved = follow(&mut detour, &[at(0.2), at(0.5)]);
            assert_eq!(moved.cameras.len(), 2);
            detour.step_back(moved);
            assert_eq!(detour.coverage().facets(), straight.coverage().facets());
            for trail in [&mut straight, &mut detour] {
                follow(trail, &[at(0.03), at(0.53)]);
            }
            assert_eq!(detour.coverage().facets(), straight.coverage().facets());
        }
    }
}
