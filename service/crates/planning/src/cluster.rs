//! Density-based clustering, DBSCAN [PDN12, III.B], with labels that do not depend on the order of the points.

use crate::distance::nanometres;
use nalgebra::Vector3;
use rstar::RTree;
use rstar::primitives::GeomWithData;

/// A point to be clustered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// By which ties are broken; unique.
    pub id: u64,
    /// Where it is, m.
    pub place: Vector3<f64>,
}

/// Clusters of points, as sorted lists of their ids, in the order of their least ids.
///
/// A point with at least `min_points` points (itself included) within `eps_m` is a core point. Core points within
/// `eps_m` of each other share a cluster. Any other point joins the cluster of the nearest core point within
/// `eps_m`, ties to the core point of lower id, or else is noise and in no cluster. Distances are compared to the
/// nanometre.
///
/// Cost: proportional to the points and their neighbours within `eps_m`.
pub fn dbscan(points: &[Point], eps_m: f64, min_points: usize) -> Vec<Vec<u64>> {
    let mut points = points.to_vec();
    points.sort_by_key(|point| point.id);
    let neighbours = neighbours(&points, eps_m);
    let is_core: Vec<bool> = neighbours.iter().map(|near| near.len() >= min_points).collect();

    let mut clusters: Vec<Vec<usize>> = Vec::new();
    let mut cluster_of: Vec<Option<usize>> = vec![None; points.len()];
    for seed in (0..points.len()).filter(|&index| is_core[index]) {
        if cluster_of[seed].is_some() {
            continue;
        }
        let cluster = clusters.len();
        cluster_of[seed] = Some(cluster);
        let mut members = vec![seed];
        let mut reached = 0;
        while let Some(&core) = members.get(reached) {
            reached += 1;
            for &(other, _) in neighbours[core].iter().filter(|&&(other, _)| is_core[other]) {
                if cluster_of[other].is_none() {
                    cluster_of[other] = Some(cluster);
                    members.push(other);
                }
            }
        }
        clusters.push(members);
    }
    for border in (0..points.len()).filter(|&index| !is_core[index]) {
        let cores = neighbours[border].iter().filter(|&&(other, _)| is_core[other]);
        if let Some(&(nearest, _)) = cores.min_by_key(|&&(core, distance)| (distance, core)) {
            clusters[cluster_of[nearest].expect("every core point has a cluster by now")].push(border);
        }
    }
    for members in &mut clusters {
        members.sort_unstable();
    }
    clusters.sort();
    clusters.into_iter().map(|members| members.into_iter().map(|index| points[index].id).collect()).collect()
}

/// For each point the points within `eps_m`, itself included, by index, with their distances in nanometres.
fn neighbours(points: &[Point], eps_m: f64) -> Vec<Vec<(usize, i64)>> {
    let places = points.iter().enumerate();
    let tree = RTree::bulk_load(
        places.map(|(index, point)| GeomWithData::new(<[f64; 3]>::from(point.place), index)).collect(),
    );
    let reach_m = eps_m + 1e-8;
    let near = |point: &Point| {
        let mut near: Vec<(usize, i64)> = tree
            .locate_within_distance(point.place.into(), reach_m * reach_m)
            .map(|other| (other.data, nanometres((points[other.data].place - point.place).norm())))
            .filter(|&(_, distance)| distance <= nanometres(eps_m))
            .collect();
        near.sort_unstable();
        near
    };
    points.iter().map(near).collect()
}
