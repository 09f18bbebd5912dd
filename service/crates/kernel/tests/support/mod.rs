//! What the tests of the elimination share: numbers that look random, random systems, dense answers.
#![allow(dead_code, reason = "each test file uses its own part")]

use std::sync::Arc;

use nalgebra::{DMatrix, DVector, Matrix6, Vector6};
use pdn_kernel::elimination::{BlockSystem, VirtualLink, VirtualPath, VirtualPlace, VirtualSteps};
use pdn_kernel::information::PairInformation;
use pdn_kernel::{Node, Pose};

/// SplitMix64: the same numbers from the same seed.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Random {
        Random(seed)
    }

    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in [-1, 1).
    pub fn signed(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    pub fn below(&mut self, bound: usize) -> usize {
        (self.bits() % bound as u64) as usize
    }

    /// Standard normal, near enough: the sum of twelve uniforms.
    pub fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }

    pub fn vector(&mut self) -> Vector6<f64> {
        Vector6::from_fn(|_, _| self.signed())
    }

    pub fn matrix(&mut self) -> Matrix6<f64> {
        Matrix6::from_fn(|_, _| self.signed())
    }

    /// A well-conditioned Jacobian.
    pub fn jacobian(&mut self) -> Matrix6<f64> {
        Matrix6::identity() + 0.3 * self.matrix()
    }

    pub fn positive(&mut self) -> Matrix6<f64> {
        let jacobian = self.jacobian();
        jacobian.tr_mul(&jacobian)
    }

    /// Information on the difference of two nodes up to a turn of the axes: errors add up along a chain, as
    /// those of odometry do, and do not grow exponentially, as they would with any Jacobians.
    pub fn pair(&mut self) -> PairInformation {
        let second = self.jacobian();
        let turn = self.matrix().qr().q();
        PairInformation::from_jacobians(&-(second * turn), &second)
    }

    pub fn pose(&mut self, metres: f64, radians: f64) -> Pose {
        let mut xi = self.vector();
        for axis in 0..3 {
            xi[axis] *= metres;
            xi[axis + 3] *= radians;
        }
        pdn_kernel::se3::exp(&xi)
    }
}

/// Edges of graphs of several shapes, the first node of each component listed in the second part.
pub fn shape(kind: usize, nodes: usize, random: &mut Random) -> (Vec<(u32, u32)>, Vec<u32>) {
    let mut edges: Vec<(u32, u32)> = (1..nodes as u32).map(|node| (node - 1, node)).collect();
    let mut anchors = vec![0];
    match kind {
        0 => {}
        1 => edges.push((0, nodes as u32 - 1)),
        2 => {
            let columns = (nodes as f64).sqrt().ceil() as u32;
            edges.extend((columns..nodes as u32).map(|node| (node - columns, node)));
        }
        3 => {
            for _ in 0..nodes / 2 {
                edges.push((random.below(nodes) as u32, random.below(nodes) as u32));
            }
        }
        _ => {
            let cut = nodes as u32 / 2;
            edges.retain(|&(_, to)| to != cut);
            if cut > 0 {
                anchors.push(cut);
            }
            for _ in 0..nodes / 3 {
                let (one, other) = (random.below(nodes) as u32, random.below(nodes) as u32);
                if (one < cut) == (other < cut) {
                    edges.push((one, other));
                }
            }
        }
    }
    edges.retain(|(one, other)| one != other);
    (edges, anchors)
}

pub fn add_pair(system: &mut BlockSystem, one: u32, other: u32, random: &mut Random) {
    let pair = random.pair();
    system.add_diagonal(Node(one), &pair.first, &random.vector());
    system.add_diagonal(Node(other), &pair.second, &random.vector());
    system.add_cross(Node(one), Node(other), &pair.cross);
}

pub fn random_system(kind: usize, nodes: usize, random: &mut Random) -> BlockSystem {
    let mut system = BlockSystem::new();
    for _ in 0..nodes {
        system.add_node();
    }
    let (edges, anchors) = shape(kind, nodes, random);
    for (one, other) in edges {
        add_pair(&mut system, one, other, random);
    }
    for anchor in anchors {
        system.add_diagonal(Node(anchor), &random.positive(), &random.vector());
    }
    system
}

/// The system as a dense matrix and right-hand side.
pub fn dense(system: &BlockSystem) -> (DMatrix<f64>, DVector<f64>) {
    let size = 6 * system.len();
    let (mut matrix, mut right) = (DMatrix::zeros(size, size), DVector::zeros(size));
    for (one, other, block) in system.blocks() {
        let (row, column) = (6 * one.index(), 6 * other.index());
        matrix.view_mut((row, column), (6, 6)).copy_from(&block);
        if one != other {
            matrix.view_mut((column, row), (6, 6)).copy_from(&block.transpose());
        }
    }
    for node in 0..system.len() {
        right.rows_mut(6 * node, 6).copy_from(system.right_hand_side(Node(node as u32)));
    }
    (matrix, right)
}

/// The dense inverse, by a library's Cholesky factorisation of the whole matrix.
pub fn inverse(matrix: DMatrix<f64>) -> DMatrix<f64> {
    use faer::linalg::solvers::DenseSolveCore;
    let size = matrix.nrows();
    let view = faer::MatRef::from_column_major_slice(matrix.as_slice(), size, size);
    let inverse = view.llt(faer::Side::Lower).expect("the test's matrix is positive definite").inverse();
    DMatrix::from_fn(size, size, |row, column| inverse[(row, column)])
}

pub fn block(matrix: &DMatrix<f64>, row: usize, column: usize) -> Matrix6<f64> {
    matrix.fixed_view::<6, 6>(6 * row, 6 * column).into_owned()
}

/// The greatest |a_ij - b_ij| / (sigma_i sigma_j), sigma from `expected`.
pub fn scaled_difference(found: &Matrix6<f64>, expected: &Matrix6<f64>) -> f64 {
    let mut greatest = 0.0_f64;
    for row in 0..6 {
        for column in 0..6 {
            let scale = (expected[(row, row)] * expected[(column, column)]).sqrt();
            let difference = (found[(row, column)] - expected[(row, column)]).abs() / scale;
            greatest = if difference.is_nan() { f64::INFINITY } else { greatest.max(difference) };
        }
    }
    greatest
}

/// A round trip over so many places with links to random keyframes.
pub fn random_path(keyframes: usize, places: usize, links: usize, random: &mut Random) -> VirtualPath {
    let mut made: Vec<VirtualPlace> = (0..=places)
        .map(|place| VirtualPlace {
            unary: if random.below(2) == 0 { Matrix6::zeros() } else { 0.1 * random.positive() },
            steps: (place > 0).then(|| VirtualSteps { out: random.pair(), back: random.pair() }),
            links: Vec::new(),
        })
        .collect();
    for _ in 0..links {
        made[random.below(places + 1)].links.push(VirtualLink {
            keyframe: Node(random.below(keyframes) as u32),
            information: random.pair(),
            probability: if random.below(5) == 0 { 0.0 } else { random.unit() },
        });
    }
    let robot = Node(random.below(keyframes) as u32);
    VirtualPath { robot, places: made.into_iter().map(Arc::new).collect() }
}

/// Lambda_0 plus the path's information, dense, virtual nodes at the end.
pub fn dense_with_path(
    system: &BlockSystem,
    path: &VirtualPath,
    weight: impl Fn(&VirtualLink) -> f64,
) -> DMatrix<f64> {
    let (lambda, _) = dense(system);
    let (keyframes, count) = (system.len(), path.nodes() as usize);
    let mut matrix = DMatrix::zeros(6 * (keyframes + count), 6 * (keyframes + count));
    matrix.view_mut((0, 0), (6 * keyframes, 6 * keyframes)).copy_from(&lambda);
    let mut add = |one: usize, other: usize, pair: &PairInformation, scale: f64| {
        for (row, column, block) in [
            (one, one, pair.first),
            (one, other, pair.cross),
            (other, one, pair.cross.transpose()),
            (other, other, pair.second),
        ] {
            let mut view = matrix.view_mut((6 * row, 6 * column), (6, 6));
            view += block * scale;
        }
    };
    let row = |node: usize| if node == 0 { path.robot.index() } else { keyframes + node - 1 };
    for node in 0..count {
        add(row(node), row(node + 1), path.step(node as u32), 1.0);
    }
    for (node, link) in path.node_links() {
        add(link.keyframe.index(), row(node as usize), &link.information, weight(link));
    }
    for node in 1..=count {
        let at = 6 * row(node);
        let mut view = matrix.view_mut((at, at), (6, 6));
        view += path.unary(node as u32);
    }
    matrix
}
