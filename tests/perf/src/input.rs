//! The input of one run as arrays: the information matrix, the candidates, and the stream of factors.

use std::io::Result;

use nalgebra::{Matrix6, Vector6};

use crate::arrays::Arrays;
use crate::kernel::{BlockSystem, Node, PairInformation, Pose, VirtualLink, VirtualPath};
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
    arrays.put_u32("path_nodes", &[], paths.iter().map(|path| path.unary.len() as u32));
    arrays.put_u32("path_links", &[], paths.iter().map(|path| path.links.len() as u32));
    arrays.put_f64("unary", &[6, 6], paths.iter().flat_map(|path| &path.unary).flat_map(row_major));
    arrays.put_f64("steps", &[3, 6, 6], paths.iter().flat_map(|path| &path.steps).flat_map(pair));
    let links = || paths.iter().flat_map(|path| &path.links);
    arrays.put_u32("link_ends", &[2], links().flat_map(|link| [link.node, link.keyframe.0]));
    arrays.put_f64("link_probability", &[], links().map(|link| link.probability));
    arrays.put_f64("links", &[3, 6, 6], links().flat_map(|link| pair(&link.information)));
}

/// The candidates, made one at a time.
pub fn paths(arrays: &Arrays, robot: Node) -> Result<impl Iterator<Item = VirtualPath> + use<>> {
    let (nodes, links) = (arrays.u32("path_nodes")?, arrays.u32("path_links")?);
    let (unary, steps) = (arrays.f64("unary")?, arrays.f64("steps")?);
    let (ends, probability) = (arrays.u32("link_ends")?, arrays.f64("link_probability")?);
    let information = arrays.f64("links")?;
    let (mut node, mut link) = (0, 0);
    Ok(nodes.into_iter().zip(links).map(move |(node_count, link_count)| {
        let (nodes, links) = (node..node + node_count as usize, link..link + link_count as usize);
        (node, link) = (nodes.end, links.end);
        VirtualPath {
            robot,
            unary: nodes.clone().map(|at| block(&unary, at)).collect(),
            steps: nodes.map(|at| pair_information(&steps, at)).collect(),
            links: links
                .map(|at| VirtualLink {
                    node: ends[2 * at],
                    keyframe: Node(ends[2 * at + 1]),
                    information: pair_information(&information, at),
                    probability: probability[at],
                })
                .collect(),
        }
    }))
}

/// The measurements in their order, and the first estimate of each keyframe.
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
    arrays.put_f64("body_from_camera", &[7], pose_row(&survey::body_from_camera()));
}

/// Where the information is linearised.
pub fn put_poses(arrays: &mut Arrays, poses: &[Pose]) {
    arrays.put_f64("poses", &[7], poses.iter().flat_map(pose_row));
}

/// Kind (0 prior, 1 odometry, 2 attitude, 3 depth, 4 camera), the other keyframe, the measurement as a pose, its deviations.
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
