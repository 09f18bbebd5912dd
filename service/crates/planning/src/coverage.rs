//! Area coverage [PDN12, III.D.2]: which part of the target the cameras of the corrected trajectory have
//! seen.
//!
//! Each facet has a raster of square cells from its origin: the cells whose centre lies on the facet. A
//! keyframe covers a cell when the cell's centre lies in its camera's field of view and the camera is on the
//! facet's visible side, to which `u x v` points. Occlusion, of a facet by another one or by anything else,
//! is not considered. A_covered is the sum over facets of area times the share of cells covered.

use crate::error::PlanningError;
use crate::settings::check_positive;
use nalgebra::Vector3;
use pdn_kernel::se3::Pose;
use std::collections::BTreeMap;

mod raster;

use raster::Raster;

/// Cells over all facets at most: 4 bytes each.
pub const MAX_CELLS: usize = 1 << 26;

/// A planar rectangle in the world, seen from the side to which `u x v` points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facet {
    /// The corner from which the raster counts, in the world, m.
    pub origin: Vector3<f64>,
    /// Unit direction of the first edge.
    pub u: Vector3<f64>,
    /// Unit direction of the second edge, orthogonal to `u`.
    pub v: Vector3<f64>,
    /// Length along `u`, m.
    pub length_u_m: f64,
    /// Length along `v`, m.
    pub length_v_m: f64,
}

/// What a camera sees: the points with 0 < z <= `max_range_m`, |x/z| and |y/z| at most the tangents of half
/// the angles, in the camera frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldOfView {
    /// Full angle along the camera's x axis, rad.
    pub horizontal_rad: f64,
    /// Full angle along the camera's y axis, rad.
    pub vertical_rad: f64,
    /// Farthest distance along the optical axis at which a surface counts as photographed, m.
    pub max_range_m: f64,
}

/// The rasters of all facets, kept with the trajectory keyframe by keyframe.
#[derive(Clone, Debug)]
pub struct Coverage {
    rasters: Vec<Raster>,
    view: FieldOfView,
    cell_m: f64,
    photographed: BTreeMap<u64, Photograph>,
}

/// The cells that one keyframe covers.
#[derive(Clone, Debug)]
struct Photograph {
    world_from_camera: Pose,
    spans: Vec<(u32, raster::Span)>,
}

/// The raster of a facet, for whoever draws it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FacetCoverage {
    /// Cells along `u`.
    pub cells_u: u32,
    /// Cells along `v`.
    pub cells_v: u32,
    /// Covered cells.
    pub covered_cells: u64,
    /// Lengths of alternating runs of uncovered and covered cells, first uncovered, over the cells in the
    /// order `v * cells_u + u`.
    pub runs: Vec<u32>,
}

impl Coverage {
    /// Empty rasters with cells of edge `cell_m`.
    ///
    /// # Errors
    /// [`PlanningError::Facet`] for edges that are not orthogonal unit vectors (to 1e-6), lengths that are
    /// not positive, or a facet narrower than half a cell, which holds no cell's centre;
    /// [`PlanningError::TooManyCells`]; [`PlanningError::OutOfRange`] for the field of view and the cell.
    pub fn new(facets: &[Facet], cell_m: f64, view: FieldOfView) -> Result<Coverage, PlanningError> {
        check_positive("cell_m", cell_m)?;
        check_positive("camera.max_range_m", view.max_range_m)?;
        for (name, angle_rad) in [
            ("camera.horizontal_fov_deg", view.horizontal_rad),
            ("camera.vertical_fov_deg", view.vertical_rad),
        ] {
            if !(angle_rad > 0.0 && angle_rad < std::f64::consts::PI) {
                let value = angle_rad.to_degrees();
                return Err(PlanningError::OutOfRange {
                    name,
                    value,
                    wanted: "above 0 and below 180 degrees",
                });
            }
        }
        let mut limit = MAX_CELLS;
        let mut rasters = Vec::with_capacity(facets.len());
        for (index, facet) in facets.iter().enumerate() {
            facet.check().map_err(|problem| PlanningError::Facet { facet: index, problem })?;
            let [cells_u, cells_v] =
                [facet.length_u_m, facet.length_v_m].map(|length_m| (length_m / cell_m).round());
            if cells_u < 1.0 || cells_v < 1.0 {
                let problem = "narrower than half a cell; take a smaller cell_m or leave it out";
                return Err(PlanningError::Facet { facet: index, problem });
            }
            if cells_u * cells_v > limit as f64 {
                return Err(PlanningError::TooManyCells { limit: MAX_CELLS, cell_m });
            }
            limit -= (cells_u * cells_v) as usize;
            rasters.push(Raster::new(*facet, cell_m, cells_u as u32, cells_v as u32));
        }
        Ok(Coverage { rasters, view, cell_m, photographed: BTreeMap::new() })
    }

    /// Puts a keyframe at its corrected pose; returns whether the rasters changed hands with it. A new
    /// keyframe is added. A known one is taken out and added again if it has moved by more than half a cell:
    /// its camera's position, or its rotation times the greatest range; else it stays where it was.
    ///
    /// Cost: linear in the cells near the field of view, whatever the size of the facets.
    pub fn place(&mut self, keyframe: u64, world_from_camera: &Pose) -> bool {
        if let Some(known) = self.photographed.get(&keyframe) {
            let motion = known.world_from_camera.inverse() * world_from_camera;
            let swing_m = motion.rotation.angle() * self.view.max_range_m;
            if motion.translation.vector.norm() <= 0.5 * self.cell_m && swing_m <= 0.5 * self.cell_m {
                return false;
            }
        }
        self.remove(keyframe);
        let mut spans = Vec::new();
        for (raster, facet) in self.rasters.iter_mut().zip(0_u32..) {
            let seen = raster.spans(world_from_camera, &self.view);
            seen.iter().for_each(|span| raster.add(span));
            spans.extend(seen.into_iter().map(|span| (facet, span)));
        }
        self.photographed.insert(keyframe, Photograph { world_from_camera: *world_from_camera, spans });
        true
    }

    /// Takes a keyframe out; an unknown one changes nothing.
    pub fn remove(&mut self, keyframe: u64) {
        if let Some(photograph) = self.photographed.remove(&keyframe) {
            for (facet, span) in &photograph.spans {
                self.rasters[*facet as usize].take(span);
            }
        }
    }

    /// A_covered, m^2: the sum over facets of area times the share of cells covered.
    pub fn covered_m2(&self) -> f64 {
        self.rasters.iter().map(Raster::covered_m2).sum()
    }

    /// The sum of the facets' areas, m^2: A_target unless the mission has its own figure.
    pub fn facets_m2(&self) -> f64 {
        self.rasters.iter().map(Raster::area_m2).sum()
    }

    /// Edge of a cell, m.
    pub fn cell_m(&self) -> f64 {
        self.cell_m
    }

    /// The rasters in the order of the facets. Cost: linear in all cells.
    pub fn facets(&self) -> Vec<FacetCoverage> {
        self.rasters.iter().map(Raster::facet_coverage).collect()
    }
}

impl Facet {
    fn check(&self) -> Result<(), &'static str> {
        const TOLERANCE: f64 = 1e-6;
        let finite = self.origin.iter().chain(&self.u).chain(&self.v).all(|value| value.is_finite());
        let unit = |edge: &Vector3<f64>| (edge.norm() - 1.0).abs() <= TOLERANCE;
        let positive = |length_m: f64| length_m.is_finite() && length_m > 0.0;
        if !finite {
            Err("origin, u and v must be finite")
        } else if !unit(&self.u) || !unit(&self.v) {
            Err("u and v must be unit vectors")
        } else if self.u.dot(&self.v).abs() > TOLERANCE {
            Err("u and v must be orthogonal")
        } else if !positive(self.length_u_m) || !positive(self.length_v_m) {
            Err("length_u_m and length_v_m must be above zero")
        } else {
            Ok(())
        }
    }
}
