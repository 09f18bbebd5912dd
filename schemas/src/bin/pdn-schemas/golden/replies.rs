//! What the service answers and publishes.

use super::configs::{default, full};
use super::{Vectors, edges, ordinary};
use pdn_schemas::config::Allowable;
use pdn_schemas::problem::{Code, Problem};
use pdn_schemas::reply::{
    Ack, Action, Candidate, CoverageReply, Decision, EvaluateReply, Exploration, FacetCoverage,
    GraphKeyframe, GraphReply, Health, IngestStatus, LinkBin, LinkModelReply, MissionState, Phase, Policy,
    Robot, Timing, Waypoint, WaypointsReply,
};
use pdn_schemas::shared::{Covariance6, Pose};

const POSE: Pose = Pose { translation: [1.0, 2.0, 3.0], rotation: [0.0, 0.6, 0.0, 0.8] };

pub fn add(vectors: &mut Vectors) {
    add_progress(vectors);
    add_decisions(vectors);
    add_pictures(vectors);
}

fn robot() -> Robot {
    Robot { keyframe: 41, pose: POSE, covariance: Covariance6(ordinary(1e-5)) }
}

fn add_progress(vectors: &mut Vectors) {
    let phases = [
        ("configured", Phase::Configured),
        ("running", Phase::Running),
        ("paused", Phase::Paused),
        ("held", Phase::Held),
        ("completed", Phase::Completed),
        ("aborted", Phase::Aborted),
    ];
    for (case, phase) in phases {
        let begun = phase != Phase::Configured;
        vectors.add(
            case,
            &MissionState {
                mission: "m".into(),
                phase,
                robot: begun.then(robot),
                reason: if begun { "the operator said so".into() } else { String::new() },
                since_ns: 1_700_000_000_000_000_000,
                config: if begun { full() } else { default() },
                next_seq: if begun { u64::MAX } else { 0 },
                keyframes: 42,
                factors: 99,
                covered_m2: 12.34,
                target_m2: 1200.0,
                uncertainty: begun.then_some(0.875),
                decisions: 10,
                revisits: 3,
                estimated_remaining_m: begun.then_some(-0.0),
                health: Health {
                    ok: begun,
                    findings: if begun { vec![] } else { vec!["no keyframe yet".into()] },
                },
            },
        );
    }
    let missing = [("contiguous", vec![]), ("gaps", vec![(3, 3), (7, u64::MAX - 1)])];
    for (case, missing) in missing {
        let (mission, buffered, rejected) = ("m".to_owned(), missing.len() as u64 * 5, 2);
        vectors
            .add(case, &IngestStatus { mission, next_seq: 3, durable_seq: 1, buffered, missing, rejected });
    }
    vectors.add("begin", &Ack { mission: "m".into(), next_seq: 0, durable_seq: 0 });
    vectors.add("end", &Ack { mission: "m".into(), next_seq: u64::MAX, durable_seq: u64::MAX - 1 });
    for &code in Code::ALL {
        let seq = (code != Code::Deadline).then_some(u64::from(u32::MAX) + 1);
        vectors.add(code.name(), &Problem::new(code, code.meaning(), seq));
    }
}

fn exploration() -> Exploration {
    Exploration {
        covariance: Covariance6(ordinary(1e-7)),
        uncertainty: 0.0,
        uncertainty_ratio: 0.9,
        area: 0.7,
        penalty: 0.0,
        reward: -0.0,
    }
}

fn candidate(detail: bool) -> Candidate {
    Candidate {
        candidate: u32::MAX,
        keyframe: detail.then_some(17),
        path: if detail { vec![41, 30, 17] } else { vec![] },
        one_way_m: 12.5,
        nodes: 50,
        covariance: Covariance6(edges()),
        uncertainty: 0.8,
        uncertainty_all_links: 0.7,
        uncertainty_no_links: 1.1,
        peak_uncertainty: 1.05,
        redundant_m2: 40.0,
        area: 0.9,
        penalty: 0.85,
        reward: -0.85,
        break_even_alpha: detail.then_some(0.3),
        expected_links: 3.25,
        poses: detail.then(|| vec![POSE, Pose::IDENTITY]),
        links: detail.then(|| vec![(1, 17, 0.85), (u32::MAX, u64::MAX, 5e-324)]),
    }
}

fn link_model() -> LinkModelReply {
    let bin = LinkBin {
        prior_registered: 170.0,
        prior_failed: 30.0,
        proposed: 40,
        registered: 33,
        probability: 203.0 / 240.0,
    };
    LinkModelReply { mission: "m".into(), graph_seq: 7, bins: 2, cells: vec![bin; 4] }
}

fn add_decisions(vectors: &mut Vectors) {
    let timing = Timing { wait_ms: 0.0, queue_ms: 0.125, evaluate_ms: 3.5, total_ms: 4.0 };
    let explore = Decision {
        mission: "m".into(),
        decision: None,
        graph_seq: 0,
        phase: Phase::Running,
        robot: robot(),
        alpha: 1.0,
        allowable: Allowable::default(),
        policy: Policy::Pdn,
        action: Action::Explore {},
        exploration: exploration(),
        candidates: vec![],
        not_evaluated: vec![],
        target_m2: 1200.0,
        covered_m2: 0.0,
        complete: true,
        link_model: None,
        timing: Timing::default(),
        reason: String::new(),
    };
    vectors.add("explore", &explore);
    let revisit = Decision {
        decision: Some(u64::MAX),
        graph_seq: u64::MAX,
        policy: Policy::Operator,
        action: Action::Revisit { candidate: 2, keyframe: u64::MAX },
        candidates: vec![candidate(false), candidate(true)],
        not_evaluated: vec![3, 99],
        complete: false,
        link_model: Some(link_model()),
        timing,
        reason: "the uncertainty exceeds the allowance".into(),
        ..explore
    };
    vectors.add("revisit", &revisit);
    let (mission, graph_seq) = ("m".to_owned(), 12);
    let none = EvaluateReply { mission, graph_seq, exploration: exploration(), candidates: vec![], timing };
    vectors.add("empty", &none);
    vectors.add("paths", &EvaluateReply { candidates: vec![candidate(true), candidate(false)], ..none });
}

fn add_pictures(vectors: &mut Vectors) {
    let (mission, graph_seq) = ("m".to_owned(), 12);
    let empty =
        GraphReply { mission: mission.clone(), graph_seq, keyframes: vec![], factors: [].into(), chi2: 0.0 };
    vectors.add("empty", &empty);
    let keyframe = |id, covariance| GraphKeyframe {
        id,
        pose: POSE,
        linearization: Pose { translation: edges(), ..POSE },
        local_saliency: 0.98,
        global_saliency: 0.1,
        covariance,
    };
    let keyframes = vec![keyframe(0, None), keyframe(u64::MAX, Some(Covariance6(edges())))];
    let factors =
        [("camera".to_owned(), 3), ("odometry".to_owned(), u64::MAX), ("attitude".to_owned(), 0)].into();
    vectors.add("graph", &GraphReply { keyframes, factors, chi2: 123.456, ..empty });

    let none = WaypointsReply { mission: mission.clone(), graph_seq, waypoints: vec![] };
    vectors.add("empty", &none);
    let reachable = Waypoint {
        keyframe: 17,
        pose: POSE,
        marginal_uncertainty: 1.5e-4,
        score: 0.9,
        members: (10..40).collect(),
        one_way_m: Some(12.5),
        candidate: true,
    };
    let stray = Waypoint { members: vec![], one_way_m: None, candidate: false, ..reachable.clone() };
    vectors.add("waypoints", &WaypointsReply { waypoints: vec![reachable, stray], ..none });

    let bare =
        CoverageReply { mission, graph_seq, covered_m2: 0.0, target_m2: 1200.0, cell_m: 0.1, facets: vec![] };
    vectors.add("empty", &bare);
    let runs = vec![0, 3, 1, 79_996];
    let covered = FacetCoverage { cells_u: 400, cells_v: 200, covered_cells: 79_999, runs };
    let uncovered = FacetCoverage { cells_u: 1, cells_v: u32::MAX, covered_cells: 0, runs: vec![u32::MAX] };
    vectors.add("facets", &CoverageReply { covered_m2: 799.99, facets: vec![covered, uncovered], ..bare });

    vectors.add("table", &link_model());
    vectors.add("empty", &LinkModelReply { bins: 0, cells: vec![], ..link_model() });
}
