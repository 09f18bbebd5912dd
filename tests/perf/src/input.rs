//! The input of one run as arrays: the information matrix, the candidates, and the stream of factors.

use std::io::Result;
use std::sync::Arc;

use nalgebra::{Matrix6, Vector6};

use crate::arrays::Arrays;
use crate::kernel::{
    BlockSystem, Node, PairInformation, Pose, VirtualLink, VirtualPath, VirtualPlace, VirtualSteps,
};
use crate::survey::{self, Keyframe, Measured};

/// What the blocks of Lambda_0 are, by the pair of their nodes (rows of the lower, columns of the higher).
pub fn put_system(arrays: &mut Arrays, system: &BlockSystem) {
    let pairs = system.blocks().flat_map(|(row, column, _)| [row.0, column.0]);
    arrays.put_u32("system_pairs", &[2], pairs);
    arrays.put_f64("system_blocks", &[6, 6], system.blocks().flat_map(|(_, _, block)| row_major(&block)));
}

/// The blocks of Lambda_0, read.
pub struct Blocks {
    pairs: Vec<u32>,
    values: Vec<f64>,
}

impl Blocks {
    pub fn read(arrays: &Arrays) -> Result<Blocks> {
        Ok(Blocks { pairs: arrays.u32("system_pairs")?, values: arrays.f64("system_blocks")? })
    }

    pub fn system(&self) -> BlockSystem {
        let mut system = BlockSystem::new();
        for (pair, block) in self.pairs.chunks_exact(2).zip(self.values.chunks_exact(36)) {
            let (row, column, block) = (Node(pair[0]), Node(pair[1]), Matrix6::from_row_slice(block));
            while system.len() <= column.index() {
                system.add_node();
            }
            if row == column {
                system.add_diagonal(row, &block, &Vector6::zeros());
            } else {
                system.add_cross(row, column, &block);
            }
        }
        system
    }
}

/// Virtual nodes and links of each candidate one after the other, with their counts.
pub fn put_paths(arrays: &mut Arrays, paths: &[VirtualPath]) {
    let pair = |pair: &PairInformation| {
        [pair.first, pair.cross, pair.second].map(|block| row_major(&block)).concat()
    };
    let unary = |path: &VirtualPath, node: u32| row_major(path.unary(node));
    arrays.put_u32("path_nodes", &[], paths.iter().map(VirtualPath::nodes));
    arrays.put_u32("path_links", &[], paths.iter().map(|path| path.node_links().count() as u32));
    let nodes = || paths.iter().flat_map(|path| (1..=path.nodes()).map(move |node| (path, node)));
    arrays.put_f64("unary", &[6, 6], nodes().flat_map(|(path, node)| unary(path, node)));
    arrays.put_f64("steps", &[3, 6, 6], nodes().flat_map(|(path, node)| pair(path.step(node - 1))));
    let links = || paths.iter().flat_map(VirtualPath::node_links);
    arrays.put_u32("link_ends", &[2], links().flat_map(|(node, link)| [node, link.keyframe.0]));
    arrays.put_f64("link_probability", &[], links().map(|(_, link)| link.probability));
    arrays.put_f64("links", &[3, 6, 6], links().flat_map(|(_, link)| pair(&link.information)));
}

/// The candidates, made one at a time.
pub fn paths(arrays: &Arrays, robot: Node) -> Result<impl Iterator<Item = VirtualPath> + use<>> {
    let (nodes, links) = (arrays.u32("path_nodes")?, arrays.u32("path_links")?);
    let (unary, steps) = (arrays.f64("unary")?, arrays.f64("steps")?);
    let (ends, probability) = (arrays.u32("link_ends")?, arrays.f64("link_probability")?);
    let information = arrays.f64("links")?;
    let (mut node, mut link) = (0, 0);
    Ok(nodes.into_iter().zip(links).map(move |(node_count, link_count)| {
        let (first_node, links) = (node, link..link + link_count as usize);
        let places = node_count as usize / 2;
        (node, link) = (node + node_count as usize, links.end);
        let mut links_at: Vec<Vec<VirtualLink>> = vec![Vec::new(); places + 1];
        for at in links {
            let place = if ends[2 * at] == node_count { 0 } else { ends[2 * at] as usize };
            // A link of the way back is that of the way out once more.
            if place <= places {
                links_at[place].push(VirtualLink {
                    keyframe: Node(ends[2 * at + 1]),
                    information: pair_information(&information, at),
                    probability: probability[at],
                });
            }
        }
        // The nodes of the way out stand at the places 1 to m, the terminal one at place 0.
        let place = |(place, links): (usize, Vec<VirtualLink>)| {
            let steps = (place > 0).then(|| VirtualSteps {
                out: pair_information(&steps, first_node + place - 1),
                back: pair_information(&steps, node - place),
            });
            let own = if place == 0 { node - 1 } else { first_node + place - 1 };
            Arc::new(VirtualPlace { unary: block(&unary, own), steps, links })
        };
        VirtualPath { robot, places: links_at.into_iter().enumerate().map(place).collect() }
    }))
}

/// The measurements in their order, the first estimate and the saliency of each keyframe.
pub fn put_stream(arrays: &mut Arrays, keyframes: &[Keyframe], first_estimates: &[Pose]) {
    let (mut ends, mut poses, mut sigmas) = (Vec::new(), Vec::new(), Vec::new());
    for (index, keyframe) in keyframes.iter().enumerate() {
        for measured in keyframe.measured() {
            let (kind, other, pose, sigma) = row(index, measured, &first_estimates[index]);
            ends.extend([index as u32, kind, other as u32]);
            poses.extend(pose_row(&pose));
            sigmas.extend(sigma.iter().copied());
        }
    }
    arrays.put_u32("stream_ends", &[3], ends);
    arrays.put_f64("stream_poses", &[7], poses);
    arrays.put_f64("stream_sigmas", &[6], sigmas);
    arrays.put_f64("stream_first_estimates", &[7], first_estimates.iter().flat_map(pose_row));
    let saliency = |keyframe: &Keyframe| [keyframe.local_saliency, keyframe.global_saliency];
    arrays.put_f64("saliency", &[2], keyframes.iter().flat_map(saliency));
    arrays.put_f64("body_from_camera", &[7], pose_row(&survey::body_from_camera()));
}

/// Where the information is linearised.
pub fn put_poses(arrays: &mut Arrays, poses: &[Pose]) {
    arrays.put_f64("poses", &[7], poses.iter().flat_map(pose_row));
}

/// Kind (0 prior, 1 odometry, 2 attitude, 3 depth, 4 camera), the other keyframe, the measurement as a pose,
/// its deviations.
fn row(index: usize, measured: &Measured, first_estimate: &Pose) -> (u32, usize, Pose, Vector6<f64>) {
    let pair = |[first, second]: [f64; 2]| Vector6::new(first, first, first, second, second, second);
    match measured {
        Measured::Prior { world_from_body, sigmas } => (0, index, *world_from_body, *sigmas),
        Measured::Odometry { earlier_from_later, sigmas } => (1, index - 1, *earlier_from_later, *sigmas),
        Measured::Attitude { rotation } => {
            let pose = Pose::from_parts(first_estimate.translation, *rotation);
            (2, index, pose, pair([0.0, survey::ATTITUDE_SIGMA_RAD]))
        }
        Measured::Depth { depth_m } => {
            let mut pose = *first_estimate;
            pose.translation.z = *depth_m;
            (3, index, pose, pair([survey::DEPTH_SIGMA_M, 0.0]))
        }
        Measured::Camera { earlier, earlier_from_later } => {
            (4, *earlier, *earlier_from_later, pair(survey::CAMERA_SIGMAS_RAD))
        }
    }
}

/// Translation, then quaternion x, y, z, w.
fn pose_row(pose: &Pose) -> [f64; 7] {
    let (t, q) = (&pose.translation.vector, &pose.rotation.coords);
    [t.x, t.y, t.z, q.x, q.y, q.z, q.w]
}

/// nalgebra stores by columns.
fn row_major(block: &Matrix6<f64>) -> Vec<f64> {
    block.transpose().as_slice().to_vec()
}

fn block(values: &[f64], at: usize) -> Matrix6<f64> {
    Matrix6::from_row_slice(&values[36 * at..36 * (at + 1)])
}

fn pair_information(values: &[f64], at: usize) -> PairInformation {
    PairInformation {
        first: block(values, 3 * at),
        cross: block(values, 3 * at + 1),
        second: block(values, 3 * at + 2),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_read_as_they_were_written() {
        let mut next = 0.0;
        let mut block = || {
            next += 1.0;
            Matrix6::from_fn(|row, column| next + (row * 6 + column) as f64 * 1e-3)
        };
        let mut pair = || PairInformation { first: block(), cross: block(), second: block() };
        let mut path = |places: usize| {
            let mut link = |keyframe: u32| VirtualLink {
                keyframe: Node(keyframe),
                information: pair(),
                probability: 1.0 / f64::from(keyframe),
            };
            let mut links = vec![Vec::new(); places + 1];
            [(0, 3), (1, 4), (1, 5), (places, 6)]
                .into_iter()
                .for_each(|(at, keyframe)| links[at].push(link(keyframe)));
            let place = |(place, links)| {
                let steps = (place > 0).then(|| VirtualSteps { out: pair(), back: pair() });
                Arc::new(VirtualPlace { unary: pair().first, steps, links })
            };
            VirtualPath { robot: Node(7), places: links.into_iter().enumerate().map(place).collect() }
        };
        let written = [path(3), path(1), path(2)];
        let mut arrays = Arrays::default();
        put_paths(&mut arrays, &written);
        let read: Vec<VirtualPath> = paths(&arrays, Node(7)).expect("the arrays are there").collect();
        assert_eq!(format!("{read:?}"), format!("{written:?}"));
    }
}
