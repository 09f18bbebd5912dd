//! Density-based clustering, DBSCAN [PDN12, III.B], with labels that do not depend on the order of the points.

use crate::distance::nanometres;
use crate::spatial::SpatialIndex;
use crate::spatial::VerletLists;
use nalgebra::Vector3;
use pdn_kernel::Node;

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
    let places = SpatialIndex::new(points.iter().map(|point| point.place).collect(), eps_m, None);
    let all: Vec<Option<Vector3<f64>>> = points.iter().map(|point| Some(point.place)).collect();
    let search = |place: &Vector3<f64>, reach_m: f64, show: &mut dyn FnMut(Node)| {
        places.visit(place, reach_m, |node, _| show(node));
    };
    let lists = VerletLists::default().update(eps_m, &all, search);
    let near = |index: usize| {
        let near = lists.of(Node(index as u32)).map(Node::index);
        within(near.map(|other| (other, points[other].place)), &points[index].place, eps_m)
    };
    let clusters = clusters((0..points.len()).map(near).collect(), min_points);
    clusters.into_iter().map(|members| members.into_iter().map(|index| points[index].id).collect()).collect()
}

/// Of these points those within `eps_m` of a place, with their distances in nanometres.
pub(crate) fn within(
    points: impl Iterator<Item = (usize, Vector3<f64>)>,
    place: &Vector3<f64>,
    eps_m: f64,
) -> Vec<(usize, i64)> {
    let distances = points.map(|(index, other)| (index, nanometres((other - place).norm())));
    distances.filter(|&(_, distance)| distance <= nanometres(eps_m)).collect()
}

/// Clusters as sorted lists of indices, in the order of their least ones, as [`dbscan`] has them; an index stands for the
/// rank of a point's id. `neighbours` has for each point the others within `eps_m` and their distances in nanometres.
///
/// Cost: proportional to the neighbours.
pub(crate) fn clusters(neighbours: Vec<Vec<(usize, i64)>>, min_points: usize) -> Vec<Vec<usize>> {
    let count = neighbours.len();
    let is_core: Vec<bool> = neighbours.iter().map(|near| near.len() + 1 >= min_points).collect();

    let mut clusters: Vec<Vec<usize>> = Vec::new();
    let mut cluster_of: Vec<Option<usize>> = vec![None; count];
    for seed in (0..count).filter(|&index| is_core[index]) {
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
    for border in (0..count).filter(|&index| !is_core[index]) {
        let cores = neighbours[border].iter().filter(|&&(other, _)| is_core[other]);
        if let Some(&(nearest, _)) = cores.min_by_key(|&&(core, distance)| (distance, core)) {
            clusters[cluster_of[nearest].expect("every core point has a cluster by now")].push(border);
        }
    }
    for members in &mut clusters {
        members.sort_unstable();
    }
    clusters.sort();
    clusters
}
