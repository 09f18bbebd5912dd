//! Small missions: a boustrophedon survey over a floor with salient places, its factors, and its information
//! matrix a second time, dense.

use crate::draw::Draw;
use nalgebra::{DMatrix, Matrix3, Matrix5, Matrix6, UnitQuaternion, Vector3, Vector6};
use pdn_kernel::elimination::{BlockSystem, Elimination};
use pdn_kernel::se3::Pose;
use pdn_kernel::{Factor, Node, so3};
use pdn_planning::*;

/// The figures of the paper's hull.
pub fn settings() -> Settings {
    let tenth = 0.1_f64.to_radians();
    let [moved, turned] = [0.012, 0.05_f64.to_radians()];
    Settings {
        alpha: 1.0,
        allowable: Allowable {
            x_m: 0.25,
            y_m: 0.25,
            depth_m: 0.01,
            roll_rad: tenth,
            pitch_rad: tenth,
            heading_rad: tenth,
        },
        waypoint_local_saliency: 0.5,
        eps_m: 1.5,
        min_points: 4,
        max_cluster_radius_m: None,
        edge_radius_m: None,
        sample_spacing_m: None,
        min_revisit_m: 3.0,
        min_baseline_m: 0.3,
        max_baseline_m: 0.9,
        max_view_angle_rad: 30.0_f64.to_radians(),
        max_links: 4,
        swath_m: 1.6,
        expect_absolute: true,
        odometry_sigmas_per_sqrt_m: Vector6::new(moved, moved, moved, turned, turned, turned),
        tilt_sigma_rad: Some(0.25_f64.to_radians()),
        heading_sigma_rad: Some(0.25_f64.to_radians()),
        depth_sigma_m: Some(0.02),
        direction_sigma_rad: 1.0_f64.to_radians(),
        rotation_sigma_rad: tenth,
    }
}

/// Registration rates of the paper's hull, with the weight of 200 earlier proposals a bin.
pub fn link_model() -> LinkModel {
    let salient = |bin: usize| (bin as f64 + 0.5) / 5.0 >= 0.5;
    let rate = |bin: usize| match (salient(bin / 5), salient(bin % 5)) {
        (true, true) => 0.85,
        (false, false) => 0.005,
        _ => 0.05,
    };
    let prior: Vec<[f64; 2]> = (0..25).map(|bin| [200.0 * rate(bin), 200.0 * (1.0 - rate(bin))]).collect();
    LinkModel::new(5, &prior).expect("the prior is symmetric and positive")
}

/// A snapshot of keyframes that no factor ties: enough for what asks for no covariance.
pub fn untied(keyframes: Vec<SnapshotKeyframe>, went: Vec<(Node, Node)>) -> Snapshot {
    snapshot(keyframes, went, Elimination::default())
}

fn snapshot(keyframes: Vec<SnapshotKeyframe>, went: Vec<(Node, Node)>, elimination: Elimination) -> Snapshot {
    Snapshot {
        newest: (keyframes.len() as u32).checked_sub(1).map(Node),
        keyframes,
        went,
        elimination,
        last_odometry: None,
        covered_m2: 300.0,
        target_m2: 1200.0,
        link_model: link_model(),
        settings: settings(),
        derived: Derived::default(),
    }
}

/// A camera that looks straight down, image top forward.
pub fn looking_down() -> Pose {
    Pose::from_parts(
        Vector3::new(0.1, 0.0, 0.05).into(),
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 1.0),
    )
}

/// A survey with its information matrix twice: eliminated in the snapshot, and dense from the same factors.
pub struct Mission {
    pub snapshot: Snapshot,
    pub factors: Vec<Factor>,
}

impl Mission {
    /// `lines` tracklines of `along` keyframes, 0.5 m apart along a line and 1.2 m between lines, disturbed
    /// by `seed`; ids are not in the order of nodes.
    pub fn survey(lines: usize, along: usize, seed: u64) -> Mission {
        let bands = |x: f64, _: usize| (x / 4.0).fract() < 0.45;
        Mission::survey_over(lines, along, seed, bands)
    }

    /// As [`Mission::survey`], salient where `is_salient` says so of the place along a line and the line.
    pub fn survey_over(
        lines: usize,
        along: usize,
        seed: u64,
        is_salient: impl Fn(f64, usize) -> bool,
    ) -> Mission {
        let mut draw = Draw(seed);
        let mut keyframes = Vec::new();
        for index in 0..lines * along {
            let (line, step) = (index / along, index % along);
            let x = 0.5 * if line % 2 == 0 { step as f64 } else { (along - 1 - step) as f64 };
            let place = Vector3::new(x, 1.2 * line as f64, 4.0) + draw.vector(0.05);
            let heading = if line % 2 == 0 { 0.0 } else { std::f64::consts::PI };
            let turn = so3::exp(&(Vector3::new(0.0, 0.0, heading) + draw.vector(0.08)));
            let camera =
                looking_down() * Pose::from_parts(draw.vector(0.02).into(), so3::exp(&draw.vector(0.1)));
            let saliency = if is_salient(x, line) { draw.between(0.6, 1.0) } else { draw.between(0.0, 0.4) };
            keyframes.push(SnapshotKeyframe {
                id: ((index as u64 * 7919) % 10007) + 3,
                world_from_body: Pose::from_parts(place.into(), turn),
                body_from_camera: camera,
                saliency: Saliency::ready(saliency, draw.share()).expect("drawn in [0, 1]"),
            });
        }
        let factors = factors(&keyframes, &mut draw);
        let mut system = BlockSystem::new();
        for _ in &keyframes {
            system.add_node();
        }
        for (factor, [first, cross, second]) in
            factors.iter().map(|factor| (factor, normal(factor, &keyframes)))
        {
            let (node, other) = factor.nodes();
            system.add_diagonal(node, &first, &Vector6::zeros());
            if let Some(other) = other {
                system.add_diagonal(other, &second, &Vector6::zeros());
                system.add_cross(node, other, &cross);
            }
        }
        let elimination = Elimination::of(system).expect("each keyframe is tied by odometry");
        let went = (1..keyframes.len() as u32).map(|node| (Node(node - 1), Node(node))).collect();
        let mut snapshot = snapshot(keyframes, went, elimination);
        let sigmas = snapshot.settings.odometry_sigmas_per_sqrt_m * 0.5_f64.sqrt();
        snapshot.last_odometry = Some(OdometryStep {
            earlier_from_later: Pose::new(Vector3::new(0.5, 0.01, 0.0), Vector3::new(0.0, 0.0, 0.02)),
            covariance: Matrix6::from_diagonal(&sigmas.component_mul(&sigmas)),
        });
        Mission { snapshot, factors }
    }

    /// Lambda_0, dense, with room for `more` nodes.
    pub fn dense_information(&self, more: usize) -> DMatrix<f64> {
        let size = 6 * (self.snapshot.keyframes.len() + more);
        let mut information = DMatrix::zeros(size, size);
        for factor in &self.factors {
            let [first, cross, second] = normal(factor, &self.snapshot.keyframes);
            let (node, other) = factor.nodes();
            add(&mut information, node.index(), node.index(), &first);
            if let Some(other) = other {
                add(&mut information, other.index(), other.index(), &second);
                add(&mut information, node.index(), other.index(), &cross);
                add(&mut information, other.index(), node.index(), &cross.transpose());
            }
        }
        information
    }
}

/// Adds a block to a dense matrix.
pub fn add(information: &mut DMatrix<f64>, row: usize, column: usize, block: &Matrix6<f64>) {
    let mut place = information.fixed_view_mut::<6, 6>(6 * row, 6 * column);
    place += block;
}

fn normal(factor: &Factor, keyframes: &[SnapshotKeyframe]) -> [Matrix6<f64>; 3] {
    let (first, second) = factor.nodes();
    let pose = |node: Node| &keyframes[node.index()].world_from_body;
    let linearized = factor.linearize(pose(first), second.map(pose)).expect("the factor is sound");
    let [first, second] = linearized.jacobians;
    [first.transpose() * first, first.transpose() * second, second.transpose() * second]
}

fn factors(keyframes: &[SnapshotKeyframe], draw: &mut Draw) -> Vec<Factor> {
    let poses: Vec<Pose> = keyframes.iter().map(|keyframe| keyframe.world_from_body).collect();
    let cameras: Vec<Pose> = keyframes.iter().map(SnapshotKeyframe::world_from_camera).collect();
    let sigma = |value: f64| Matrix6::from_diagonal_element(value * value);
    let mut factors = vec![Factor::prior(Node(0), poses[0], &sigma(0.02)).expect("a prior")];
    for (index, pose) in poses.iter().enumerate() {
        let node = Node(index as u32);
        factors.push(Factor::depth(node, pose.translation.z, 4e-4).expect("a depth"));
        factors.push(Factor::attitude(node, pose.rotation, 2e-5, Some(3e-5)).expect("an attitude"));
        if index % 17 == 5 {
            let covariance = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 0.0));
            factors.push(Factor::position(node, pose.translation.vector, &covariance).expect("a position"));
        }
        if index == 0 {
            continue;
        }
        let noise = Pose::new(draw.vector(0.01), draw.vector(0.001));
        let step = poses[index - 1].inverse() * pose * noise;
        let sigmas = Matrix6::from_diagonal(&Vector6::new(7e-5, 7e-5, 7e-5, 4e-7, 4e-7, 4e-7));
        factors
            .push(Factor::odometry(Node(index as u32 - 1), node, step, &sigmas).expect("an odometry step"));
        let rate = |other: usize| {
            let is_salient = |at: usize| keyframes[at].saliency.local >= 0.5;
            if is_salient(index) && is_salient(other) { 0.85 } else { 0.05 }
        };
        let near = |&other: &usize| {
            let baseline_m = (cameras[other].translation.vector - cameras[index].translation.vector).norm();
            (0.3..0.9).contains(&baseline_m)
        };
        for other in (0..index).filter(near).collect::<Vec<_>>() {
            if draw.share() > rate(other) {
                continue;
            }
            let relative = cameras[other].inverse() * cameras[index];
            let covariance = Matrix5::from_diagonal(&[3e-4, 3e-4, 3e-6, 3e-6, 3e-6].into());
            let direction = relative.translation.vector.normalize();
            let [from, to] = [other, index].map(|at| keyframes[at].body_from_camera);
            let other = Node(other as u32);
            let camera =
                Factor::camera(other, node, from, to, direction, relative.rotation, &covariance, 0.1);
            factors.push(camera.expect("a camera link"));
        }
    }
    factors
}
