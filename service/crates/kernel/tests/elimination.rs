//! The elimination against dense linear algebra on random graphs.

mod support;

use std::sync::Arc;

use nalgebra::Matrix6;
use pdn_kernel::elimination::{
    BlockSystem, Elimination, PathEvaluator, VirtualLink, VirtualPath, VirtualPlace, Workspace,
};
use pdn_kernel::{KernelError, Node};
use support::*;

/// Both answers lose about condition number times 1e-16; these systems have conditions up to 1e5.
const TOLERANCE: f64 = 1e-9;

/// By what the information of a link is scaled.
type Weight<'a> = &'a dyn Fn(&VirtualLink) -> f64;

const SIZES: [usize; 8] = [2, 3, 7, 20, 49, 60, 130, 200];

fn each_system(most: usize, mut check: impl FnMut(BlockSystem, &mut Random, String)) {
    for kind in 0..5 {
        for (index, &nodes) in SIZES.iter().enumerate().filter(|&(_, &nodes)| nodes <= most) {
            let mut random = Random::new((100 * kind + index) as u64);
            let system = random_system(kind, nodes, &mut random);
            check(system, &mut random, format!("shape {kind}, {nodes} nodes"));
        }
    }
}

#[test]
fn solution_and_marginals_equal_the_dense_inverse() {
    each_system(200, |system, _, what| {
        let (matrix, right) = dense(&system);
        let covariance = inverse(matrix);
        let expected = &covariance * right;
        let elimination = Elimination::of(system).expect(&what);
        for (node, found) in elimination.solve().iter().enumerate() {
            let wanted = expected.fixed_rows::<6>(6 * node).into_owned();
            let greatest = expected.amax();
            assert!((found - wanted).amax() <= TOLERANCE * greatest, "{what}, node {node}");
        }
        for (node, found) in elimination.marginals().iter().enumerate() {
            let wanted = block(&covariance, node, node);
            let difference = scaled_difference(found, &wanted);
            assert!(difference <= TOLERANCE, "{what}, node {node}: {difference:e}");
            let alone = elimination.marginal(Node(node as u32)).expect(&what);
            let difference = scaled_difference(&alone, &wanted);
            assert!(difference <= TOLERANCE, "{what}, node {node} alone: {difference:e}");
        }
    });
}

#[test]
fn joint_covariances_equal_the_dense_inverse() {
    each_system(200, |system, random, what| {
        let (matrix, _) = dense(&system);
        let covariance = inverse(matrix);
        let elimination = Elimination::of(system).expect(&what);
        let nodes = elimination.len();
        for count in [1, 2, 3] {
            // Also nodes that come twice, and two of one front.
            let some: Vec<Node> = (0..count).map(|_| Node((random.unit() * nodes as f64) as u32)).collect();
            let found = elimination.joint(&some).expect(&what);
            for (row, one) in some.iter().enumerate() {
                for (column, other) in some.iter().enumerate() {
                    let wanted = block(&covariance, one.index(), other.index());
                    let sigma = |node: &Node, axis| {
                        covariance[(6 * node.index() + axis, 6 * node.index() + axis)].sqrt()
                    };
                    let scaled = Matrix6::from_fn(|i, j| {
                        (found[(6 * row + i, 6 * column + j)] - wanted[(i, j)])
                            / (sigma(one, i) * sigma(other, j))
                    });
                    assert!(scaled.amax() <= TOLERANCE, "{what}, {some:?}: {:e}", scaled.amax());
                }
            }
        }
        assert!(elimination.joint(&[Node(nodes as u32)]).is_err());
    });
}

#[test]
fn expected_covariances_equal_the_dense_inverse() {
    let mut workspace = Workspace::default();
    each_system(60, |system, random, what| {
        let elimination = Elimination::of(system).expect(&what);
        for (places, links) in [(1, 0), (1, 2), (2, 1), (5, 0), (5, 3), (5, 20), (15, 6)] {
            let path = random_path(elimination.len(), places, links, random);
            let count = path.nodes() as usize;
            let robot = elimination.marginal(path.robot).expect(&what);
            let what = format!("{what}, {places} places, {links} links");
            let mut evaluator = PathEvaluator::new(&elimination, &mut workspace);
            let found = evaluator.covariances(&path, &robot).expect(&what);
            let terminal = PathEvaluator::new(&elimination, &mut workspace).terminal(&path).expect(&what);
            assert_eq!(terminal, found.terminal, "{what}");
            let expected = |weight: Weight| inverse(dense_with_path(elimination.system(), &path, weight));
            let last = elimination.len() + count - 1;
            let weights: [(&str, Weight, &Matrix6<f64>); 3] = [
                ("by probability", &|link| link.probability, &found.terminal),
                ("all", &|_| 1.0, &found.terminal_all_links),
                ("none", &|_| 0.0, &found.terminal_no_links),
            ];
            for (name, weight, terminal) in weights {
                let difference = scaled_difference(terminal, &block(&expected(weight), last, last));
                assert!(difference <= TOLERANCE, "{what}, {name}: {difference:e}");
            }
            let covariance = expected(&|link| link.probability);
            assert_eq!(found.along.len(), count);
            for (index, found) in found.along.iter().enumerate() {
                let at = elimination.len() + index;
                let difference = scaled_difference(found, &block(&covariance, at, at));
                assert!(difference <= TOLERANCE, "{what}, virtual node {}: {difference:e}", index + 1);
            }
        }
    });
}

/// A path that begins like another one, with the same places or with equal ones, and goes on elsewhere.
fn branch(path: &VirtualPath, shared: u32, elsewhere: VirtualPath, is_same: bool) -> VirtualPath {
    let begin = path.places[..=shared as usize].iter();
    let begin =
        begin.map(|place| if is_same { Arc::clone(place) } else { Arc::new(VirtualPlace::clone(place)) });
    let end = &elsewhere.places[shared as usize + 1..];
    VirtualPath { robot: path.robot, places: begin.chain(end.iter().cloned()).collect() }
}

#[test]
fn common_beginnings_are_eliminated_once_and_change_no_bit() {
    let mut random = Random::new(11);
    let (mut in_turn, mut alone) = (Workspace::default(), Workspace::default());
    for kind in 0..5 {
        let elimination = Elimination::of(random_system(kind, 150, &mut random)).expect("anchored");
        let path = random_path(150, 12, 30, &mut random);
        let robot = elimination.marginal(path.robot).expect("anchored");
        let mut paths = vec![path];
        for (shared, is_same) in [(11, true), (12, false), (3, true), (0, false), (7, false), (12, true)] {
            let last = paths.last().expect("not empty");
            let elsewhere = random_path(150, 12 + random.below(4), 20, &mut random);
            paths.push(branch(last, shared.min(last.last_place()), elsewhere, is_same));
        }
        paths.push(paths.last().expect("not empty").clone());
        let mut evaluator = PathEvaluator::new(&elimination, &mut in_turn);
        for (index, path) in paths.iter().enumerate() {
            let mut fresh = PathEvaluator::new(&elimination, &mut alone);
            let expected = fresh.covariances(path, &robot).expect("anchored");
            let found = evaluator.covariances(path, &robot).expect("anchored");
            assert_eq!(found, expected, "shape {kind}, path {index}");
            assert_eq!(evaluator.terminal(path).expect("anchored"), expected.terminal);
        }
    }
    // Three eliminations a path against two: 1.5 if nothing were shared.
    assert!(in_turn.flops() < 1.4 * alone.flops(), "{:e} {:e}", in_turn.flops(), alone.flops());
}

#[test]
fn an_elimination_is_the_same_after_a_candidate() {
    let mut random = Random::new(1);
    let elimination = Elimination::of(random_system(2, 100, &mut random)).expect("anchored");
    let before = elimination.marginals();
    let path = random_path(100, 20, 10, &mut random);
    let robot = elimination.marginal(path.robot).expect("anchored");
    let mut workspace = Workspace::default();
    PathEvaluator::new(&elimination, &mut workspace)
        .terminal(&random_path(100, 9, 20, &mut random))
        .expect("anchored");
    let first = PathEvaluator::new(&elimination, &mut workspace).covariances(&path, &robot);
    assert_eq!(elimination.marginals(), before);
    // A used workspace gives the same bits as a new one.
    let again = PathEvaluator::new(&elimination, &mut Workspace::default()).covariances(&path, &robot);
    assert_eq!(first, again);
}

#[test]
fn a_part_without_anchor_is_named() {
    for kind in 0..4 {
        let mut random = Random::new(7);
        let mut system = random_system(kind, 40, &mut random);
        for _ in 40..60 {
            system.add_node();
        }
        for node in 41..60 {
            add_pair(&mut system, node - 1, node, &mut random);
        }
        // 19 pairs of 6 rows cannot determine 20 nodes.
        match Elimination::of(system).expect_err("nodes 40 to 59 are free") {
            KernelError::NotPositiveDefinite { node, pivot } => {
                assert!((40..60).contains(&node.0), "{node}");
                assert!(pivot.abs() < 1e-10, "{pivot:e}");
            }
            other => panic!("{other}"),
        }
    }
}

#[test]
fn a_node_without_information_is_named() {
    let mut random = Random::new(3);
    let mut system = random_system(0, 10, &mut random);
    let lonely = system.add_node();
    let error = Elimination::of(system).expect_err("one node has no information");
    assert_eq!(error, KernelError::NotPositiveDefinite { node: lonely, pivot: 0.0 });
}

#[test]
fn negative_information_of_a_path_is_an_error_with_its_node() {
    let mut random = Random::new(4);
    let elimination = Elimination::of(random_system(2, 30, &mut random)).expect("anchored");
    for links in [0, 30] {
        let mut path = random_path(30, 6, links, &mut random);
        Arc::make_mut(&mut path.places[2]).unary = -1e3 * random.positive();
        let found = PathEvaluator::new(&elimination, &mut Workspace::default()).terminal(&path);
        match found.expect_err("its information is negative") {
            KernelError::VirtualNotPositiveDefinite { pivot, .. } => assert!(pivot < 0.0, "{pivot:e}"),
            other => panic!("{other}"),
        }
    }
}

#[test]
fn bad_paths_are_refused() {
    let mut random = Random::new(5);
    let elimination = Elimination::of(random_system(0, 5, &mut random)).expect("anchored");
    let path = random_path(5, 3, 2, &mut random);
    let mut workspace = Workspace::default();
    let mut refused =
        |path: VirtualPath| PathEvaluator::new(&elimination, &mut workspace).terminal(&path).is_err();
    assert!(!refused(path.clone()));
    let mut short = path.clone();
    short.places.truncate(1);
    assert!(refused(short));
    let mut empty = path.clone();
    empty.places.clear();
    assert!(refused(empty));
    let mut without_step = path.clone();
    Arc::make_mut(&mut without_step.places[2]).steps = None;
    assert!(refused(without_step));
    let mut unknown = path.clone();
    let linked =
        unknown.places.iter_mut().find(|place| !place.links.is_empty()).expect("there are two links");
    Arc::make_mut(linked).links[0].keyframe = Node(5);
    assert!(refused(unknown));
    let mut nowhere = path;
    nowhere.robot = Node(5);
    assert!(refused(nowhere));
    assert!(elimination.marginal(Node(5)).is_err());
}

#[test]
fn a_chain_of_a_hundred_thousand_nodes_needs_no_stack() {
    let run = || {
        let mut random = Random::new(6);
        let nodes = 100_000;
        let elimination = Elimination::of(random_system(0, nodes, &mut random)).expect("anchored");
        let marginals = elimination.marginals();
        let last = elimination.marginal(Node(nodes as u32 - 1)).expect("anchored");
        assert!(scaled_difference(&marginals[nodes - 1], &last) < TOLERANCE);
        assert_eq!(elimination.solve().len(), nodes);
        let path = random_path(nodes, 20, 10, &mut random);
        let robot = elimination.marginal(path.robot).expect("anchored");
        let found = PathEvaluator::new(&elimination, &mut Workspace::default()).covariances(&path, &robot);
        assert_eq!(found.expect("anchored").along.len(), 40);
        // Nested dissection keeps a chain's tree flat: about log2(100,000 / leaf) separators, and the leaves'
        // own paths.
        assert!(elimination.statistics().height < 150, "{:?}", elimination.statistics());
    };
    std::thread::Builder::new()
        .stack_size(256 * 1024)
        .spawn(run)
        .expect("a thread starts")
        .join()
        .expect("no overflow");
}
