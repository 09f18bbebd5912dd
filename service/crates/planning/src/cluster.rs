//! Density-based clustering, DBSCAN [PDN12, III.B], and representatives of a cluster. Neither depends on the
//! order of the points.

use crate::distance::nanometres;
use nalgebra::Vector3;

/// Clusters of points, as sorted lists of their indices, in the order of their least ones [EKSX96].
/// `neighbours` has for each point the others within eps and their distances in nanometres.
///
/// A point with at least `min_points` points (itself included) within eps is a core point. Core points within
/// eps of each other share a cluster. Any other point joins the cluster of the nearest core point within eps,
/// ties to the core point of lower index, or else is noise and in no cluster. So with points in the order of
/// their ids nothing depends on how they came.
///
/// Cost: proportional to the neighbours.
pub fn dbscan(neighbours: &[Vec<(usize, i64)>], min_points: usize) -> Vec<Vec<usize>> {
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

/// Who represents a cluster: points with their members, by falling score (greedy non-maximum suppression).
///
/// Of the points left, the one of the greatest score, ties to the lower index, represents those within
/// `radius_m` of it, itself included; so on until none is left. So each point is within the radius of its
/// representative, and two representatives are farther apart than the radius. Members are ascending.
///
/// Cost: points times representatives.
pub fn representatives(scores: &[f64], places: &[Vector3<f64>], radius_m: f64) -> Vec<(usize, Vec<usize>)> {
    let limit = nanometres(radius_m);
    let mut left: Vec<usize> = (0..scores.len()).collect();
    let mut found = Vec::new();
    while let Some(&first) = left.first() {
        let better = |best, other| if scores[other] > scores[best] { other } else { best };
        let best = left.iter().copied().fold(first, better);
        let is_near =
            |&other: &usize| other == best || nanometres((places[other] - places[best]).norm()) <= limit;
        let (near, far) = left.into_iter().partition(is_near);
        found.push((best, near));
        left = far;
    }
    found
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
