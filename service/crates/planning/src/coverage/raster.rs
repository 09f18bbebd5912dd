//! The cells of one facet and which of them a field of view holds.

use super::{Facet, FacetCoverage, FieldOfView};
use nalgebra::Vector3;
use pdn_kernel::se3::Pose;

/// The raster of a facet: for each cell, how many keyframes cover it.
#[derive(Clone, Debug)]
pub struct Raster {
    facet: Facet,
    cell_m: f64,
    cells_u: u32,
    cells_v: u32,
    views: Vec<u32>,
    covered_cells: u64,
}

/// Neighbouring cells of a row, all covered by a keyframe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    /// Index along `v`.
    pub row: u32,
    /// First index along `u`.
    pub first: u32,
    /// Last index along `u`, included.
    pub last: u32,
}

/// The facet in the camera frame: the point at (s, t) metres along its edges is `origin + s u + t v`.
struct FacetInCamera {
    origin: Vector3<f64>,
    u: Vector3<f64>,
    v: Vector3<f64>,
}

impl Raster {
    /// An uncovered raster.
    pub fn new(facet: Facet, cell_m: f64, cells_u: u32, cells_v: u32) -> Raster {
        let views = vec![0; cells_u as usize * cells_v as usize];
        Raster { facet, cell_m, cells_u, cells_v, views, covered_cells: 0 }
    }

    /// Area of the facet, m^2.
    pub fn area_m2(&self) -> f64 {
        self.facet.length_u_m * self.facet.length_v_m
    }

    /// The facet's area times the share of its cells that are covered, m^2.
    pub fn covered_m2(&self) -> f64 {
        self.area_m2() * (self.covered_cells as f64 / self.views.len() as f64)
    }

    /// One more keyframe covers these cells.
    pub fn add(&mut self, span: &Span) {
        let cells = self.cells(span);
        for views in &mut self.views[cells] {
            self.covered_cells += u64::from(*views == 0);
            *views += 1;
        }
    }

    /// One keyframe less covers these cells.
    pub fn take(&mut self, span: &Span) {
        let cells = self.cells(span);
        for views in &mut self.views[cells] {
            *views -= 1;
            self.covered_cells -= u64::from(*views == 0);
        }
    }

    /// The cells whose centre the camera sees. The field of view is convex, so each row holds at most one
    /// span; only rows within the box around the field of view are looked at.
    pub fn spans(&self, world_from_camera: &Pose, view: &FieldOfView) -> Vec<Span> {
        let camera_in_world = world_from_camera.translation.vector;
        let height_m = self.facet.u.cross(&self.facet.v).dot(&(camera_in_world - self.facet.origin));
        if height_m <= 0.0 {
            return Vec::new();
        }
        let camera_from_world = world_from_camera.inverse();
        let facet = FacetInCamera {
            origin: camera_from_world.rotation * (self.facet.origin - camera_in_world),
            u: camera_from_world.rotation * self.facet.u,
            v: camera_from_world.rotation * self.facet.v,
        };
        let frustum = Frustum::new(view);
        let Some((first_row, last_row)) = self.rows(&facet, &frustum) else { return Vec::new() };
        (first_row..=last_row).filter_map(|row| self.span(row, &facet, &frustum)).collect()
    }

    /// The raster as runs.
    pub fn facet_coverage(&self) -> FacetCoverage {
        let mut runs = vec![0_u32];
        let mut covered = false;
        for &views in &self.views {
            if (views > 0) != covered {
                covered = !covered;
                runs.push(0);
            }
            *runs.last_mut().expect("the list begins with one run") += 1;
        }
        FacetCoverage {
            cells_u: self.cells_u,
            cells_v: self.cells_v,
            covered_cells: self.covered_cells,
            runs,
        }
    }

    /// Rows whose centre lies within the box, along `v`, around the field of view's corners.
    fn rows(&self, facet: &FacetInCamera, frustum: &Frustum) -> Option<(u32, u32)> {
        let along_v = frustum.corners().map(|corner| facet.v.dot(&(corner - facet.origin)));
        let least_m = along_v.iter().copied().fold(f64::INFINITY, f64::min);
        let greatest_m = along_v.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        index_range(least_m, greatest_m, self.cell_m, self.cells_v)
    }

    /// The cells of a row that the camera sees.
    fn span(&self, row: u32, facet: &FacetInCamera, frustum: &Frustum) -> Option<Span> {
        let start = facet.origin + facet.v * centre_m(row, self.cell_m);
        let (least_m, greatest_m) = frustum.interval(&start, &facet.u)?;
        let (mut first, mut last) = index_range(least_m, greatest_m, self.cell_m, self.cells_u)?;
        let seen = |cell: u32| frustum.holds(&(start + facet.u * centre_m(cell, self.cell_m)));
        while first <= last && !seen(first) {
            first += 1;
        }
        while first < last && !seen(last) {
            last -= 1;
        }
        (first <= last).then_some(Span { row, first, last })
    }

    fn cells(&self, span: &Span) -> std::ops::RangeInclusive<usize> {
        let row = span.row as usize * self.cells_u as usize;
        row + span.first as usize..=row + span.last as usize
    }
}

/// Distance of the centre of a cell from the raster's edge, m.
fn centre_m(cell: u32, cell_m: f64) -> f64 {
    (f64::from(cell) + 0.5) * cell_m
}

/// Cells whose centre lies in an interval, and one more on each side: whoever asks tests the ends exactly, so
/// that rounding errors here change nothing.
fn index_range(least_m: f64, greatest_m: f64, cell_m: f64, cells: u32) -> Option<(u32, u32)> {
    let first = ((least_m / cell_m - 0.5).ceil() - 1.0).max(0.0);
    let last = ((greatest_m / cell_m - 0.5).floor() + 1.0).min(f64::from(cells) - 1.0);
    (first <= last).then_some((first as u32, last as u32))
}

/// The field of view as a pyramid with its tip in the camera.
struct Frustum {
    tan_x: f64,
    tan_y: f64,
    max_range_m: f64,
}

impl Frustum {
    fn new(view: &FieldOfView) -> Frustum {
        let [tan_x, tan_y] =
            [view.horizontal_rad, view.vertical_rad].map(|angle_rad| (0.5 * angle_rad).tan());
        Frustum { tan_x, tan_y, max_range_m: view.max_range_m }
    }

    /// Whether a point in the camera frame is seen.
    fn holds(&self, point: &Vector3<f64>) -> bool {
        point.z > 0.0
            && point.z <= self.max_range_m
            && point.x.abs() <= self.tan_x * point.z
            && point.y.abs() <= self.tan_y * point.z
    }

    fn corners(&self) -> [Vector3<f64>; 5] {
        let far = |x: f64, y: f64| Vector3::new(x * self.tan_x, y * self.tan_y, 1.0) * self.max_range_m;
        [Vector3::zeros(), far(-1.0, -1.0), far(-1.0, 1.0), far(1.0, -1.0), far(1.0, 1.0)]
    }

    /// The s for which `start + s direction` is seen, from the half-spaces a + b s >= 0 that bound the
    /// pyramid.
    fn interval(&self, start: &Vector3<f64>, direction: &Vector3<f64>) -> Option<(f64, f64)> {
        let bounds = |point: &Vector3<f64>, far: f64| {
            let [x, y] = [self.tan_x * point.z, self.tan_y * point.z];
            [x - point.x, x + point.x, y - point.y, y + point.y, far - point.z]
        };
        let (mut least, mut greatest) = (f64::NEG_INFINITY, f64::INFINITY);
        for (a, b) in bounds(start, self.max_range_m).into_iter().zip(bounds(direction, 0.0)) {
            if b > 0.0 {
                least = least.max(-a / b);
            } else if b < 0.0 {
                greatest = greatest.min(-a / b);
            } else if a < 0.0 {
                return None;
            }
        }
        Some((least, greatest))
    }
}
