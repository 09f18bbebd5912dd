//! How long the kernel takes on a synthetic survey: a boustrophedon with odometry, attitude and depth at each keyframe,
//! a camera link to the keyframe before, links across tracks in salient patches, and now and then a revisit.
//!
//! `cargo run --release -p pdn-kernel --example survey [keyframes] [relinearize_above]`
//!
//! Times are CPU times of this thread where the system tells them, so that other work on the machine does not count.

mod measure;

use measure::{now_ms, summary};
use nalgebra::{Matrix5, Matrix6, Translation3, UnitQuaternion, Vector3, Vector5, Vector6};
use pdn_kernel::elimination::{
    Elimination, LinkWeight, VirtualLink, VirtualPath, VirtualPlace, VirtualSteps, Workspace,
};
use pdn_kernel::information;
use pdn_kernel::smoother::{Smoother, SmootherSettings};
use pdn_kernel::{Factor, KernelError, Loss, Node, Pose, se3};
use std::sync::Arc;

const SPACING_M: f64 = 0.5;
const TRACK_SPACING_M: f64 = 0.7;
const KEYFRAMES_PER_TRACK: usize = 80;
const CANDIDATES: usize = 30;

fn main() -> Result<(), KernelError> {
    let mut arguments = std::env::args().skip(1);
    let sizes =
        arguments.next().and_then(|word| word.parse().ok()).map_or(vec![2_000, 10_000], |size| vec![size]);
    let default = SmootherSettings::default();
    let relinearize_above =
        arguments.next().and_then(|word| word.parse().ok()).unwrap_or(default.relinearize_above);
    for keyframes in sizes {
        survey(keyframes, SmootherSettings { relinearize_above, ..default })?;
    }
    Ok(())
}

fn survey(keyframes: usize, settings: SmootherSettings) -> Result<(), KernelError> {
    let truth: Vec<Pose> = (0..keyframes).map(true_pose).collect();
    let mut random = Random(1);
    let mut smoother = Smoother::new(settings);
    let (mut plain, mut closing) = (Vec::new(), Vec::new());
    let mut relinearized = 0;
    let mut unfinished = 0;
    for index in 0..keyframes {
        let closes = add_keyframe(&mut smoother, &truth, index, &mut random)?;
        let start = now_ms();
        let report = smoother.advance()?;
        let milliseconds = now_ms() - start;
        if closes { &mut closing } else { &mut plain }.push(milliseconds);
        relinearized += report.relinearized;
        unfinished += usize::from(!report.converged);
    }
    println!("{keyframes} keyframes, relinearize above {:e}", settings.relinearize_above);
    println!("  advance, no link across tracks: {}", summary(&mut plain));
    println!("  advance, with such links:       {}", summary(&mut closing));
    println!("  relinearised {relinearized}, advances that hit the bound {unfinished}");
    println!("  streamed {:?}", smoother.elimination().statistics());
    let start = now_ms();
    let report = smoother.relinearize(1e-7)?;
    println!("  settled to 1e-7 in {:.2} ms: {report:?}", now_ms() - start);

    let start = now_ms();
    let batch = Elimination::of(smoother.elimination().system().clone())?;
    let first = now_ms() - start;
    println!("  batch, ordering included {first:.2} ms: {:?}", batch.statistics());
    let mut batch = batch;
    let numeric = timed(5, || batch.eliminate_again())?;
    println!("  batch, numbers only: {numeric:.2} ms");
    let copy = timed(5, || Ok(smoother.clone().len()))?;
    println!("  clone of the smoother: {copy:.3} ms");
    let marginals = timed(3, || Ok(batch.marginals()))?;
    println!("  marginals of all keyframes: {marginals:.2} ms");

    let paths: Vec<VirtualPath> = (0..CANDIDATES)
        .map(|candidate| path_to(&smoother, (candidate * keyframes) / CANDIDATES))
        .collect::<Result<_, _>>()?;
    let mut workspace = Workspace::default();
    for (name, elimination) in [("streamed", smoother.elimination()), ("batch", &batch)] {
        for (weight, along) in
            [(LinkWeight::Expected, false), (LinkWeight::Expected, true), (LinkWeight::None, false)]
        {
            let mut times = Vec::new();
            for path in &paths {
                elimination.expected_covariance(path, weight, along, &mut workspace)?;
                let start = now_ms();
                elimination.expected_covariance(path, weight, along, &mut workspace)?;
                times.push(now_ms() - start);
            }
            println!("  candidate on the {name} tree, {weight:?}, along {along}: {}", summary(&mut times));
        }
    }
    let nodes: usize = paths.iter().map(|path| path.nodes() as usize).sum();
    let links: usize = paths.iter().map(|path| path.links().count()).sum();
    println!("  per candidate {} virtual nodes, {} links", nodes / CANDIDATES, links / CANDIDATES);
    Ok(())
}

fn true_pose(index: usize) -> Pose {
    let (track, along) = (index / KEYFRAMES_PER_TRACK, index % KEYFRAMES_PER_TRACK);
    let forward = track % 2 == 0;
    let x = if forward { along } else { KEYFRAMES_PER_TRACK - 1 - along } as f64 * SPACING_M;
    let heading = if forward { 0.0 } else { std::f64::consts::PI };
    let translation = Translation3::new(x, track as f64 * TRACK_SPACING_M, 2.0);
    Pose::from_parts(translation, UnitQuaternion::from_euler_angles(0.0, 0.0, heading))
}

fn is_salient(pose: &Pose) -> bool {
    let (x, y) = (pose.translation.x, pose.translation.y);
    (x / 9.0).sin() * (y / 7.0).sin() > 0.55
}

/// Adds a keyframe with its factors. True if a link goes further back than the keyframe before.
fn add_keyframe(
    smoother: &mut Smoother,
    truth: &[Pose],
    index: usize,
    random: &mut Random,
) -> Result<bool, KernelError> {
    let true_pose = truth[index];
    let node = if index == 0 {
        let node = smoother.add_keyframe(true_pose);
        smoother.add_factor(Factor::prior(
            node,
            true_pose,
            &Matrix6::from_diagonal(&Vector6::repeat(1e-6)),
        )?)?;
        node
    } else {
        let before = Node(index as u32 - 1);
        let step = truth[index - 1].inverse() * true_pose;
        let covariance = odometry_covariance(step.translation.vector.norm());
        let measured = step * se3::exp(&random.gaussian(&covariance));
        let node = smoother.add_keyframe(smoother.estimate(before) * measured);
        smoother.add_factor(Factor::odometry(before, node, measured, &covariance)?)?;
        smoother.add_factor(camera(before, node, truth, random)?)?;
        node
    };
    let tilt = (0.25_f64).to_radians();
    let turn = Vector3::from_fn(|_, _| tilt * random.normal());
    let attitude = UnitQuaternion::from_scaled_axis(turn) * true_pose.rotation;
    smoother.add_factor(Factor::attitude(node, attitude, tilt * tilt, Some(tilt * tilt))?)?;
    smoother.add_factor(Factor::depth(
        node,
        true_pose.translation.z + 0.02 * random.normal(),
        0.02 * 0.02,
    )?)?;
    let mut closes = false;
    if is_salient(&true_pose) {
        for other in (0..index.saturating_sub(2)).rev() {
            let distance = (truth[other].translation.vector - true_pose.translation.vector).norm();
            if (0.3..0.9).contains(&distance) && random.unit() < 0.5 {
                smoother.add_factor(camera(Node(other as u32), node, truth, random)?)?;
                closes = true;
            }
            if index - other > 2 * KEYFRAMES_PER_TRACK {
                break;
            }
        }
    }
    if index % 700 == 699 {
        let other = index / 3;
        let covariance = Matrix6::from_diagonal(
            &Vector6::new(0.02, 0.02, 0.02, 0.01, 0.01, 0.01).map(|sigma| sigma * sigma),
        );
        let measured = truth[other].inverse() * true_pose * se3::exp(&random.gaussian(&covariance));
        smoother.add_factor(Factor::relative(Node(other as u32), node, measured, &covariance)?)?;
        closes = true;
    }
    Ok(closes)
}

fn odometry_covariance(distance_m: f64) -> Matrix6<f64> {
    let turn = 0.05_f64.to_radians();
    Matrix6::from_diagonal(
        &Vector6::new(0.012, 0.012, 0.012, turn, turn, turn).map(|sigma| sigma * sigma * distance_m.max(0.1)),
    )
}

fn body_from_camera() -> Pose {
    Pose::from_parts(Translation3::identity(), UnitQuaternion::identity())
}

fn camera_sigmas() -> Vector5<f64> {
    Vector5::new(1.0, 1.0, 0.1, 0.1, 0.1).map(f64::to_radians)
}

fn camera(from: Node, to: Node, truth: &[Pose], random: &mut Random) -> Result<Factor, KernelError> {
    let relative = truth[from.index()].inverse() * truth[to.index()];
    let sigmas = camera_sigmas();
    let noise = Vector3::from_fn(|_, _| sigmas[0] * random.normal());
    let direction = (relative.translation.vector.normalize() + noise).normalize();
    let turn = Vector3::from_fn(|_, _| sigmas[2] * random.normal());
    let rotation = relative.rotation * UnitQuaternion::from_scaled_axis(turn);
    let covariance = Matrix5::from_diagonal(&sigmas.map(|sigma| sigma * sigma));
    let factor = Factor::camera(
        from,
        to,
        body_from_camera(),
        body_from_camera(),
        direction,
        rotation,
        &covariance,
        0.1,
    )?;
    Ok(factor.with_loss(Loss::Cauchy(2.385)))
}

/// Straight to a keyframe and back, with up to four links at each place.
fn path_to(smoother: &Smoother, goal: usize) -> Result<VirtualPath, KernelError> {
    let poses = smoother.linearizations();
    let robot = Node(poses.len() as u32 - 1);
    let (start, end) = (poses[robot.index()], poses[goal]);
    let length = (end.translation.vector - start.translation.vector).norm();
    let pieces = (length / SPACING_M).ceil().max(1.0) as usize;
    let at = |place: usize| {
        let position = start.translation.vector.lerp(&end.translation.vector, place as f64 / pieces as f64);
        Pose::from_parts(position.into(), start.rotation)
    };
    let odometry = |from: &Pose, to: &Pose| {
        let distance = (to.translation.vector - from.translation.vector).norm();
        let sigmas = odometry_covariance(distance).diagonal().map(|variance| variance.sqrt().recip());
        information::odometry(from, to, &Matrix6::from_diagonal(&sigmas))
    };
    let camera_weights = Matrix5::from_diagonal(&camera_sigmas().map(|sigma| 1.0 / sigma));
    let tilt = 0.25_f64.to_radians();
    let mut places = Vec::new();
    for place in 0..=pieces {
        let pose = at(place);
        let steps = place
            .checked_sub(1)
            .map(at)
            .map(|before| VirtualSteps { out: odometry(&before, &pose), back: odometry(&pose, &before) });
        let mut links = Vec::new();
        let mut near: Vec<(f64, usize)> = poses
            .iter()
            .enumerate()
            .map(|(keyframe, other)| ((other.translation.vector - pose.translation.vector).norm(), keyframe))
            .filter(|(distance, keyframe)| (0.3..0.9).contains(distance) && is_salient(&poses[*keyframe]))
            .collect();
        near.sort_by(|one, other| one.partial_cmp(other).expect("distances are finite"));
        for &(_, keyframe) in near.iter().take(4) {
            let mount = body_from_camera();
            links.push(VirtualLink {
                keyframe: Node(keyframe as u32),
                information: information::camera(&poses[keyframe], &mount, &pose, &mount, &camera_weights)?,
                probability: 0.6,
            });
        }
        let unary = information::attitude(&pose, tilt, Some(tilt)) + information::depth(&pose, 0.02);
        places.push(Arc::new(VirtualPlace { unary, steps, links }));
    }
    Ok(VirtualPath { robot, places })
}

fn timed<T>(times: usize, mut work: impl FnMut() -> Result<T, KernelError>) -> Result<f64, KernelError> {
    let mut best = f64::INFINITY;
    for _ in 0..times {
        let start = now_ms();
        work()?;
        best = best.min(now_ms() - start);
    }
    Ok(best)
}

/// SplitMix64: the same survey each time.
struct Random(u64);

impl Random {
    fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.unit()).sum::<f64>() - 6.0
    }

    fn gaussian(&mut self, diagonal_covariance: &Matrix6<f64>) -> Vector6<f64> {
        Vector6::from_fn(|axis, _| diagonal_covariance[(axis, axis)].sqrt() * self.normal())
    }
}
