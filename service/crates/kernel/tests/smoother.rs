//! The incremental smoother against everything computed at once.

mod support;

use nalgebra::{DMatrix, DVector, Matrix5, Matrix6, UnitQuaternion, Vector3, Vector6};
use pdn_kernel::smoother::{Smoother, SmootherSettings, SmootherState};
use pdn_kernel::{Factor, KernelError, Loss, Node, Pose, se3};
use support::*;

const KEYFRAMES: usize = 60;

/// A vehicle that wanders, with every kind of factor, and links back to random keyframes.
struct Stream {
    truth: Vec<Pose>,
    random: Random,
    links: bool,
}

impl Stream {
    fn new(seed: u64, links: bool) -> Stream {
        let mut random = Random::new(seed);
        let mut truth = vec![random.pose(1.0, 0.5)];
        for _ in 1..KEYFRAMES {
            let step = se3::exp(&Vector6::new(0.5, 0.0, 0.0, 0.0, 0.0, 0.12)) * random.pose(0.1, 0.05);
            truth.push(truth[truth.len() - 1] * step);
        }
        Stream { truth, random, links }
    }

    fn noise(&mut self, sigma_m: f64, sigma_rad: f64) -> Pose {
        let random = &mut self.random;
        se3::exp(&Vector6::from_fn(|axis, _| random.normal() * if axis < 3 { sigma_m } else { sigma_rad }))
    }

    fn covariance(sigma_m: f64, sigma_rad: f64) -> Matrix6<f64> {
        Matrix6::from_fn(|row, column| {
            let sigma = if row < 3 { sigma_m } else { sigma_rad };
            if row == column { sigma * sigma } else { 0.0 }
        })
    }

    /// The factors that come with a keyframe.
    fn factors(&mut self, index: usize) -> Vec<Factor> {
        let node = Node(index as u32);
        let pose = self.truth[index];
        let made = |factor: Result<Factor, KernelError>| factor.expect("a valid measurement");
        let mut factors = Vec::new();
        if index == 0 {
            factors.push(made(Factor::prior(node, pose, &Self::covariance(1e-3, 1e-3))));
        } else {
            let relative = self.truth[index - 1].inverse() * pose * self.noise(0.02, 0.01);
            factors.push(made(Factor::odometry(
                Node(index as u32 - 1),
                node,
                relative,
                &Self::covariance(0.02, 0.01),
            )));
        }
        let turn = Vector3::from_fn(|_, _| 0.01 * self.random.normal());
        let attitude = UnitQuaternion::from_scaled_axis(turn) * pose.rotation;
        factors.push(made(Factor::attitude(node, attitude, 1e-4, (index % 2 == 0).then_some(4e-4))));
        factors.push(made(Factor::depth(node, pose.translation.z + 0.02 * self.random.normal(), 4e-4)));
        if index % 20 == 19 {
            let position = pose.translation.vector + Vector3::from_fn(|_, _| 0.3 * self.random.normal());
            factors.push(made(Factor::position(node, position, &(nalgebra::Matrix3::identity() * 0.09))));
        }
        if self.links && index > 2 && index % 3 == 0 {
            let other = Node(self.random.below(index - 1) as u32);
            let relative = self.truth[other.index()].inverse() * pose;
            if index % 2 == 0 {
                let noisy = relative * self.noise(0.05, 0.02);
                factors.push(made(Factor::relative(other, node, noisy, &Self::covariance(0.05, 0.02))));
            } else {
                let direction =
                    (relative.translation.vector.normalize() + 0.02 * self.random.vector().xyz()).normalize();
                let rotation = relative.rotation * self.noise(0.0, 0.01).rotation;
                let mount = Pose::identity();
                let covariance = Matrix5::identity() * 4e-4;
                let camera =
                    Factor::camera(other, node, mount, mount, direction, rotation, &covariance, 0.05);
                factors.push(made(camera).with_loss(Loss::Cauchy(2.385)));
            }
        }
        factors
    }

    fn add(&mut self, smoother: &mut Smoother, index: usize) {
        let factors = self.factors(index);
        let before = index.checked_sub(1).map(|before| Node(before as u32));
        let known = before.map_or(Pose::identity(), |before| smoother.estimate(before));
        let initial = factors[0].pose_of_other(before.unwrap_or(Node(0)), &known).expect("it ties fully");
        smoother.add_keyframe(initial);
        for factor in factors {
            smoother.add_factor(factor).expect("its nodes exist");
        }
    }
}

/// J^T W J and -J^T W r of all factors at these poses, dense.
fn dense_at<'a>(factors: impl Iterator<Item = &'a Factor>, poses: &[Pose]) -> (DMatrix<f64>, DVector<f64>) {
    let size = 6 * poses.len();
    let (mut matrix, mut right) = (DMatrix::zeros(size, size), DVector::zeros(size));
    for factor in factors {
        let (first, second) = factor.nodes();
        let at = |node: Node| &poses[node.index()];
        let linearized = factor.linearize(at(first), second.map(at)).expect("finite poses");
        let nodes: Vec<Node> = std::iter::once(first).chain(second).collect();
        for (one, of_one) in nodes.iter().zip(&linearized.jacobians) {
            let mut view = right.rows_mut(6 * one.index(), 6);
            view -= of_one.tr_mul(&linearized.residual);
            for (other, of_other) in nodes.iter().zip(&linearized.jacobians) {
                let mut view = matrix.view_mut((6 * one.index(), 6 * other.index()), (6, 6));
                view += of_one.tr_mul(of_other);
            }
        }
    }
    (matrix, right)
}

#[test]
fn each_step_of_a_stream_equals_the_batch_at_its_linearisation_points() {
    for (seed, links, tolerance) in [(1, false, 1e-3), (2, true, 1e-3), (3, true, 1e-2), (4, true, 1e-7)] {
        let mut stream = Stream::new(seed, links);
        let mut smoother =
            Smoother::new(SmootherSettings { relinearize_above: tolerance, ..SmootherSettings::default() });
        for index in 0..KEYFRAMES {
            stream.add(&mut smoother, index);
            while !smoother.advance().expect("the stream is anchored").converged {}
            let (matrix, right) = dense_at(smoother.factors(), smoother.linearizations());

            // The same blocks: sums of the same terms, perhaps in another order.
            let (lambda, own_right) = dense(smoother.elimination().system());
            assert!((&lambda - &matrix).amax() <= 1e-12 * matrix.amax(), "seed {seed}, keyframe {index}");
            assert!(
                (own_right - &right).amax() <= 1e-9 * matrix.amax().sqrt(),
                "seed {seed}, keyframe {index}"
            );

            let covariance = inverse(matrix);
            let marginals = smoother.elimination().marginals();
            for (node, found) in marginals.iter().enumerate() {
                let difference = scaled_difference(found, &block(&covariance, node, node));
                assert!(difference < 1e-9, "seed {seed}, keyframe {index}, node {node}: {difference:e}");
            }

            // The estimate: steps are exact but for what back-substitution leaves out, a hundredth of the
            // tolerance times the lever arms of this small graph.
            let steps = covariance * right;
            for node in 0..=index {
                let step = Vector6::from_column_slice(steps.rows(6 * node, 6).into_owned().as_slice());
                assert!(
                    step.amax() <= 1.1 * tolerance,
                    "seed {seed}, keyframe {index}, node {node}: {:e}",
                    step.amax()
                );
                let expected = smoother.linearizations()[node] * se3::exp(&step);
                let apart = se3::log(&(expected.inverse() * smoother.estimate(Node(node as u32)))).amax();
                assert!(
                    apart < 0.1 * tolerance + 1e-11,
                    "seed {seed}, keyframe {index}, node {node}: {apart:e}"
                );
            }
        }
    }
}

#[test]
fn a_stream_ends_at_the_optimum_of_all_its_factors() {
    for seed in 10..14 {
        let mut stream = Stream::new(seed, true);
        let mut streamed = Smoother::new(SmootherSettings::default());
        let mut batch = Smoother::new(SmootherSettings { relinearize_above: 1e-10, max_iterations: 50 });
        for index in 0..KEYFRAMES {
            stream.add(&mut streamed, index);
            streamed.advance().expect("the stream is anchored");
        }
        // From the truth, all at once.
        for pose in &stream.truth {
            batch.add_keyframe(*pose);
        }
        for factor in streamed.factors() {
            batch.add_factor(factor.clone()).expect("its nodes exist");
        }
        assert!(batch.advance().expect("anchored").converged);
        let (chi2, optimum) = (streamed.chi2().expect("finite"), batch.chi2().expect("finite"));
        assert!((chi2 - optimum).abs() < 1e-4 * optimum, "seed {seed}: {chi2} against {optimum}");
        let tolerance = streamed.settings().relinearize_above;
        for node in (0..KEYFRAMES as u32).map(Node) {
            let apart = se3::log(&(batch.estimate(node).inverse() * streamed.estimate(node))).amax();
            assert!(apart < tolerance, "seed {seed}, node {node}: {apart:e}");
        }
        while !streamed.relinearize(1e-9).expect("anchored").converged {}
        let chi2 = streamed.chi2().expect("finite");
        assert!((chi2 - optimum).abs() < 1e-9 * optimum, "seed {seed}: {chi2} against {optimum}");
    }
}

#[test]
fn every_linearisation_point_that_moves_is_told() {
    let settings = SmootherSettings { relinearize_above: 5e-3, max_iterations: 10 };
    let (mut stream, mut smoother) = (Stream::new(6, true), Smoother::new(settings));
    let mut told = 0;
    for index in 0..KEYFRAMES {
        let before = smoother.linearizations().to_vec();
        stream.add(&mut smoother, index);
        smoother.advance().expect("every keyframe is tied");
        if index % 10 == 9 {
            smoother.relinearize(1e-7).expect("every keyframe is tied");
        }
        let moved = smoother.take_moved();
        for (node, pose) in (0..).map(Node).zip(&before) {
            assert_eq!(moved.contains(&node), smoother.linearization(node) != pose, "{node:?} at {index}");
        }
        told += moved.len();
    }
    assert!(told > KEYFRAMES && smoother.take_moved().is_empty(), "{told}");
}

#[test]
fn a_copy_goes_its_own_way_and_the_same_way_gives_the_same_bits() {
    let mut stream = Stream::new(20, true);
    let mut smoother = Smoother::new(SmootherSettings::default());
    for index in 0..40 {
        stream.add(&mut smoother, index);
        smoother.advance().expect("anchored");
    }
    let copy = smoother.clone();
    let before = (copy.elimination().marginals(), copy.linearizations().to_vec());
    let mut other = copy.clone();
    let mut other_stream = Stream { truth: stream.truth.clone(), random: Random::new(99), links: true };
    for index in 40..KEYFRAMES {
        stream.add(&mut smoother, index);
        smoother.advance().expect("anchored");
        other_stream.add(&mut other, index);
        other.advance().expect("anchored");
    }
    assert_eq!(before, (copy.elimination().marginals(), copy.linearizations().to_vec()));
    assert_ne!(smoother.linearizations(), other.linearizations());

    // From the copy, the way of `other` once more.
    let mut again = copy.clone();
    let mut again_stream = Stream { truth: stream.truth.clone(), random: Random::new(99), links: true };
    for index in 40..KEYFRAMES {
        again_stream.add(&mut again, index);
        again.advance().expect("anchored");
    }
    assert_eq!(again.linearizations(), other.linearizations());
    assert_eq!(again.elimination().marginals(), other.elimination().marginals());
    assert!((0..KEYFRAMES as u32).all(|node| again.estimate(Node(node)) == other.estimate(Node(node))));
}

#[test]
fn a_restored_smoother_goes_on_bit_for_bit() {
    for (seed, relinearize_above) in (40..46).zip([1e-7, 1e-4, 5e-3, 2e-2, 2e-2, 1e-1]) {
        let settings = SmootherSettings { relinearize_above, max_iterations: 2 };
        let mut stream = Stream::new(seed, true);
        let mut restored: Option<Smoother> = None;
        let mut smoother = Smoother::new(settings);
        for index in 0..KEYFRAMES {
            let known = smoother.factors().count();
            stream.add(&mut smoother, index);
            assert_eq!(smoother.state(), None, "factors wait");
            let new: Vec<Factor> = smoother.factors().skip(known).cloned().collect();
            if let Some(restored) = &mut restored {
                restored.add_keyframe(*smoother.linearization(Node(index as u32)));
                new.into_iter().for_each(|factor| restored.add_factor(factor).expect("its nodes exist"));
                assert_eq!(restored.advance().expect("anchored"), smoother.advance().expect("anchored"));
            } else {
                smoother.advance().expect("anchored");
            }
            if index % 7 == 6 {
                smoother.relinearize(1e-6).expect("anchored");
                if let Some(restored) = &mut restored {
                    restored.relinearize(1e-6).expect("anchored");
                }
            }
            if let Some(restored) = &restored {
                assert_eq!(restored.state(), smoother.state(), "seed {seed}, keyframe {index}");
                assert_eq!(restored.elimination().marginals(), smoother.elimination().marginals());
            }
            if index % 11 == 10 {
                let state = smoother.state().expect("nothing waits");
                let factors = smoother.factors().cloned();
                restored = Some(Smoother::restore(settings, state, factors).expect("its own state"));
            }
        }
    }
}

#[test]
fn the_state_of_other_factors_is_refused() {
    let mut stream = Stream::new(50, true);
    let mut smoother = Smoother::new(SmootherSettings::default());
    (0..30).for_each(|index| stream.add(&mut smoother, index));
    smoother.advance().expect("anchored");
    let state = smoother.state().expect("nothing waits");
    let fewer = smoother.factors().skip(1).cloned();
    let refused = Smoother::restore(smoother.settings(), state.clone(), fewer).map(|smoother| smoother.len());
    assert!(matches!(refused, Err(KernelError::OtherGraph { .. })), "{refused:?}");
    let shorter = SmootherState { steps: Vec::new(), ..state };
    let refused = Smoother::restore(smoother.settings(), shorter, smoother.factors().cloned())
        .map(|smoother| smoother.len());
    assert!(matches!(refused, Err(KernelError::OtherGraph { .. })), "{refused:?}");
}

#[test]
fn a_keyframe_that_nothing_ties_is_named() {
    let mut stream = Stream::new(30, true);
    let mut smoother = Smoother::new(SmootherSettings::default());
    for index in 0..20 {
        stream.add(&mut smoother, index);
        smoother.advance().expect("anchored");
    }
    let copy = smoother.clone();
    let lonely = smoother.add_keyframe(Pose::identity());
    match smoother.advance().expect_err("the keyframe has no factor") {
        KernelError::NotPositiveDefinite { node, .. } => assert_eq!(node, lonely),
        other => panic!("{other}"),
    }
    let mut smoother = copy.clone();
    let lonely = smoother.add_keyframe(Pose::identity());
    smoother.add_factor(Factor::depth(lonely, 1.0, 1e-4).expect("valid")).expect("it exists");
    match smoother.advance().expect_err("depth alone leaves five degrees of freedom") {
        KernelError::NotPositiveDefinite { node, .. } => assert_eq!(node, lonely),
        other => panic!("{other}"),
    }
    // The copy made before goes on.
    let mut smoother = copy;
    stream.add(&mut smoother, 20);
    assert!(smoother.advance().expect("anchored").converged);
}

#[test]
fn factors_of_unknown_keyframes_are_refused() {
    let mut smoother = Smoother::new(SmootherSettings::default());
    let factor = Factor::depth(Node(0), 1.0, 1e-4).expect("valid");
    assert_eq!(smoother.add_factor(factor), Err(KernelError::UnknownNode { node: Node(0), nodes: 0 }));
}

#[test]
fn a_bound_on_iterations_is_reported_and_the_next_advance_goes_on() {
    let mut stream = Stream::new(40, true);
    let mut smoother = Smoother::new(SmootherSettings { relinearize_above: 1e-9, max_iterations: 1 });
    for index in 0..KEYFRAMES {
        stream.add(&mut smoother, index);
        smoother.advance().expect("anchored");
    }
    let mut advances = 0;
    while !smoother.advance().expect("anchored").converged {
        advances += 1;
        assert!(advances < 60, "it must converge");
    }
    assert!(advances > 0);
    let report = smoother.advance().expect("anchored");
    assert!(report.converged && report.iterations == 0, "{report:?}");
}

/// New keyframes come in above those before, so the tree of a long way grows by a front now and then; a
/// candidate goes all of it.
#[test]
fn the_tree_of_a_long_way_is_ordered_anew_before_it_is_high() {
    const WAY: u32 = 8000;
    let covariance = Stream::covariance(0.01, 0.001);
    let step = Pose::translation(0.5, 0.0, 0.0);
    let mut smoother = Smoother::new(SmootherSettings::default());
    let (mut greatest, mut place) = (0, Pose::identity());
    for index in 0..WAY {
        let node = smoother.add_keyframe(place);
        let tie = match index.checked_sub(1) {
            None => Factor::prior(node, place, &covariance),
            Some(before) => Factor::odometry(Node(before), node, step, &covariance),
        };
        smoother.add_factor(tie.expect("a valid measurement")).expect("its nodes exist");
        smoother.advance().expect("each keyframe is tied");
        greatest = greatest.max(smoother.elimination().statistics().height);
        place *= step;
    }
    // Twice as high as when it was ordered and 128 fronts more. A way is ordered up to 104 fronts high: parts
    // of 200 keyframes go from one end to the other.
    assert!(greatest <= 2 * 104 + 128, "{greatest}");
}
