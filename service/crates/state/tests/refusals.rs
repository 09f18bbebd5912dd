//! For each message and field: what is refused, under which code, at which path, and that nothing else is
//! disturbed.

mod support;

use pdn_schemas::config::{Loss, MissionConfig};
use pdn_schemas::event::{Appearance, Factor, FactorKind, Keyframe, LinkOutcome};
use pdn_schemas::problem::Code;
use pdn_schemas::shared::{Covariance6, Pose};
use pdn_state::{DecisionRequest, Event, Limits, OfferOutcome, StateError, Vehicle, WhatIf};
use support::{
    SENT_BYTES, bits, config, diagonal, level, mission, odometry_covariance, pool, running, script,
};

const NAN: f64 = f64::NAN;
const INFINITE: f64 = f64::INFINITY;

fn pose(rotation: [f64; 4]) -> Pose {
    Pose { translation: [0.0; 3], rotation }
}

fn with(index: usize, value: f64) -> Covariance6 {
    let mut covariance = diagonal([1e-4; 6]);
    covariance.0[index] = value;
    covariance
}

fn appearance(appearance: Appearance) -> Event {
    keyframe(99, None, None, appearance)
}

fn keyframe(id: u64, pose: Option<Pose>, camera: Option<Pose>, appearance: Appearance) -> Event {
    let mission = "m".to_string();
    Event::Keyframe(Keyframe { mission, seq: 0, stamp_ns: 0, id, pose, camera, appearance })
}

fn factor(factor: FactorKind) -> Event {
    Event::Factor(Factor { mission: "m".to_string(), seq: 0, stamp_ns: 0, factor })
}

fn odometry(from: u64, to: u64, relative: Pose, covariance: Covariance6) -> Event {
    factor(FactorKind::Odometry { from, to, relative, covariance })
}

fn camera(from: u64, to: u64, direction: [f64; 3], rotation: [f64; 4], changed: (usize, f64)) -> Event {
    let mut covariance = [0.0; 25];
    (0..5).for_each(|index| covariance[6 * index] = 1e-4);
    covariance[changed.0] = changed.1;
    factor(FactorKind::Camera { from, to, direction, rotation, covariance })
}

fn attitude(rotation: [f64; 4], tilt_variance_rad2: f64, heading_variance_rad2: Option<f64>) -> Event {
    factor(FactorKind::Attitude { keyframe: 0, rotation, tilt_variance_rad2, heading_variance_rad2 })
}

fn depth(keyframe: u64, depth_m: f64, variance_m2: f64) -> Event {
    factor(FactorKind::Depth { keyframe, depth_m, variance_m2 })
}

fn position(position: [f64; 3], changed: &[(usize, f64)]) -> Event {
    let mut covariance = [0.0; 9];
    (0..3).for_each(|index| covariance[4 * index] = 1.0);
    changed.iter().for_each(|(index, value)| covariance[*index] = *value);
    factor(FactorKind::Position { keyframe: 0, position, covariance })
}

fn link(from: u64, to: u64) -> Event {
    Event::Link(LinkOutcome { mission: "m".to_string(), seq: 0, stamp_ns: 0, from, to, registered: true })
}

/// Event, code, and what its text must say of the place.
fn bad_events() -> Vec<(Event, Code, &'static str)> {
    const UNIT: [f64; 4] = [0.0, 0.0, 0.0, 1.0];
    const LONG: [f64; 4] = [0.0, 0.0, 0.0, 1.00001];
    let good = odometry_covariance;
    let scores = |local, global| appearance(Appearance::Saliency { local, global });
    let fine = (0, 1e-4);
    vec![
        (keyframe(99, Some(pose(LONG)), None, Appearance::None), Code::NotUnit, "pose.rotation"),
        (keyframe(99, Some(pose([NAN; 4])), None, Appearance::None), Code::NotFinite, "pose.rotation[0]"),
        (
            keyframe(99, Some(level([0.0, INFINITE, 0.0])), None, Appearance::None),
            Code::NotFinite,
            "pose.translation[1]",
        ),
        (
            keyframe(99, Some(level([0.0, 0.0, 1e9])), None, Appearance::None),
            Code::OutOfRange,
            "pose.translation[2]",
        ),
        (keyframe(99, None, Some(pose([0.0; 4])), Appearance::None), Code::NotUnit, "camera.rotation"),
        (keyframe(3, None, None, Appearance::None), Code::RepeatedId, "keyframe 3"),
        (scores(1.01, 0.5), Code::OutOfRange, "appearance.saliency.local"),
        (scores(0.5, -0.1), Code::OutOfRange, "appearance.saliency.global"),
        (scores(NAN, 0.5), Code::NotFinite, "appearance.saliency.local"),
        (appearance(Appearance::Words(vec![(1, 2)])), Code::Unsupported, "appearance.words"),
        (
            appearance(Appearance::Descriptors { dim: 1, values: vec![1.0] }),
            Code::Unsupported,
            "appearance.descriptors",
        ),
        (odometry(0, 1, pose(LONG), good()), Code::NotUnit, "factor.odometry.relative.rotation"),
        (odometry(0, 1, pose(UNIT), with(7, NAN)), Code::NotFinite, "factor.odometry.covariance[7]"),
        (odometry(0, 1, pose(UNIT), with(7, 0.0)), Code::NotPositiveDefinite, "factor.odometry.covariance"),
        (odometry(0, 1, pose(UNIT), with(7, -1.0)), Code::NotPositiveDefinite, "factor.odometry.covariance"),
        (odometry(0, 1, pose(UNIT), with(1, 1e-5)), Code::NotPositiveDefinite, "factor.odometry.covariance"),
        (odometry(0, 98, pose(UNIT), good()), Code::UnknownKeyframe, "factor.odometry.to: keyframe 98"),
        (odometry(98, 0, pose(UNIT), good()), Code::UnknownKeyframe, "factor.odometry.from: keyframe 98"),
        (odometry(2, 2, pose(UNIT), good()), Code::Invalid, "factor.odometry.to"),
        (
            factor(FactorKind::Relative { from: 0, to: 1, relative: pose(UNIT), covariance: with(35, 0.0) }),
            Code::NotPositiveDefinite,
            "factor.relative.covariance",
        ),
        (
            factor(FactorKind::Prior { keyframe: 0, pose: pose(LONG), covariance: good() }),
            Code::NotUnit,
            "factor.prior.pose.rotation",
        ),
        (
            factor(FactorKind::Prior { keyframe: 98, pose: pose(UNIT), covariance: good() }),
            Code::UnknownKeyframe,
            "factor.prior.keyframe",
        ),
        (camera(0, 3, [0.0, 0.0, 1.1], UNIT, fine), Code::NotUnit, "factor.camera.direction"),
        (camera(0, 3, [0.0, NAN, 1.0], UNIT, fine), Code::NotFinite, "factor.camera.direction[1]"),
        (camera(0, 3, [0.0, 0.0, 1.0], LONG, fine), Code::NotUnit, "factor.camera.rotation"),
        (
            camera(0, 3, [0.0, 0.0, 1.0], UNIT, (6, 0.0)),
            Code::NotPositiveDefinite,
            "factor.camera.covariance",
        ),
        (camera(3, 3, [0.0, 0.0, 1.0], UNIT, fine), Code::Invalid, "factor.camera.to"),
        (attitude(LONG, 1e-4, None), Code::NotUnit, "factor.attitude.rotation"),
        (attitude(UNIT, 0.0, None), Code::OutOfRange, "factor.attitude.tilt_variance_rad2"),
        (attitude(UNIT, 1e-4, Some(-1.0)), Code::OutOfRange, "factor.attitude.heading_variance_rad2"),
        (attitude(UNIT, NAN, None), Code::NotFinite, "factor.attitude.tilt_variance_rad2"),
        (depth(0, INFINITE, 1.0), Code::NotFinite, "factor.depth.depth_m"),
        (depth(0, 1e8, 1.0), Code::OutOfRange, "factor.depth.depth_m"),
        (depth(0, 1.0, 0.0), Code::OutOfRange, "factor.depth.variance_m2"),
        (depth(98, 1.0, 1.0), Code::UnknownKeyframe, "factor.depth.keyframe"),
        (position([0.0, NAN, 0.0], &[]), Code::NotFinite, "factor.position.position[1]"),
        (position([0.0; 3], &[(0, 0.0)]), Code::NotPositiveDefinite, "factor.position.covariance"),
        (position([0.0; 3], &[(8, 0.0), (2, 0.1)]), Code::NotPositiveDefinite, "factor.position.covariance"),
        (position([0.0; 3], &[(8, 0.0), (0, 0.0)]), Code::NotPositiveDefinite, "factor.position.covariance"),
        (link(0, 98), Code::UnknownKeyframe, "link.to: keyframe 98"),
        (link(98, 0), Code::UnknownKeyframe, "link.from: keyframe 98"),
        (link(1, 1), Code::Invalid, "link.to"),
    ]
}

fn numbered(mut event: Event, number: u64) -> Event {
    match &mut event {
        Event::Keyframe(event) => event.seq = number,
        Event::Factor(event) => event.seq = number,
        Event::Link(event) => event.seq = number,
        Event::Undecodable(event) => event.seq = number,
    }
    event
}

#[test]
fn every_bad_event_is_refused_by_code_and_path_consumes_its_number_and_leaves_the_rest_alone() {
    let (mut good, mut disturbed) = (running(), running());
    let (events, bad) = (script("m").events, bad_events());
    let (count, mut number) = (bad.len() as u64, 0);
    let mut bad = bad.into_iter();
    for (index, event) in events.iter().enumerate() {
        good.offer(event.clone(), SENT_BYTES);
        // The first twenty events introduce what the bad ones refer to.
        for (event, code, place) in bad.by_ref().take(usize::from(index > 20)) {
            let text = format!("{event:?}");
            let OfferOutcome { refused, next_seq, applied, .. } =
                disturbed.offer(numbered(event, number), SENT_BYTES);
            assert_eq!((refused.len(), applied, next_seq), (1, 0, number + 1), "{text}");
            let problem = refused[0].problem();
            assert_eq!((problem.code.as_str(), problem.seq), (code.name(), Some(number)), "{text}");
            assert!(problem.message.contains(place), "\"{}\" does not name {place}", problem.message);
            number += 1;
        }
        assert_eq!(disturbed.offer(numbered(event.clone(), number), SENT_BYTES).refused, vec![]);
        number += 1;
    }
    assert_eq!(bad.next().map(|(event, ..)| event), None, "every bad event had its turn");
    assert_eq!(mission(&mut disturbed).ingest_status().rejected, count);
    let answers = |vehicle: &mut Vehicle| {
        let mut graph = mission(vehicle).begin_graph(None, true).run().expect("the graph is regular");
        graph.graph_seq = 0;
        let mut links = mission(vehicle).link_model();
        links.graph_seq = 0;
        (graph, links)
    };
    assert!(answers(&mut good) == answers(&mut disturbed));
}

#[test]
fn what_lies_within_the_tolerance_of_a_unit_quaternion_is_normalised() {
    let mut vehicle = running();
    let near = Pose { translation: [1.0, 2.0, 3.0], rotation: [0.0, 0.0, 0.0, 1.0 + 5e-7] };
    assert_eq!(vehicle.offer(keyframe(1, Some(near), None, Appearance::None), SENT_BYTES).refused, vec![]);
    let robot = mission(&mut vehicle).state().robot.expect("the first keyframe");
    assert!((robot.pose.rotation[3] - 1.0).abs() < 1e-15, "{:?}", robot.pose.rotation);
}

type Change = fn(&mut MissionConfig);

/// What to change of a good configuration, the code, and the path.
fn bad_configurations() -> Vec<(Change, Code, &'static str)> {
    vec![
        (|config| config.mission = "No Id".into(), Code::Invalid, "mission"),
        (|config| config.mission = String::new(), Code::Invalid, "mission"),
        (|config| config.target.facets.clear(), Code::Invalid, "target.facets"),
        (|config| config.target.facets[0].origin[2] = NAN, Code::NotFinite, "target.facets[0].origin[2]"),
        (|config| config.target.facets[0].u = [0.0, 0.9, 0.0], Code::NotUnit, "target.facets[0].u"),
        (|config| config.target.facets[0].v = [0.0, 0.6, 0.8], Code::Invalid, "target.facets[0].v"),
        (|config| config.target.facets[0].length_u_m = 0.0, Code::OutOfRange, "target.facets[0].length_u_m"),
        (|config| config.target.facets[0].length_v_m = -1.0, Code::OutOfRange, "target.facets[0].length_v_m"),
        (|config| config.target.facets[0].length_v_m = 1e9, Code::Limit, "max_cells"),
        (
            |config| config.target.facets = vec![config.target.facets[0].clone(); 2000],
            Code::TooLarge,
            "target.facets",
        ),
        (|config| config.target.area_m2 = Some(0.0), Code::OutOfRange, "target.area_m2"),
        (|config| config.target.area_m2 = Some(NAN), Code::NotFinite, "target.area_m2"),
        // The facet has 24 m^2.
        (
            |config| config.target.area_m2 = Some(23.9),
            Code::Invalid,
            "target.area_m2: 23.9 m^2 are less than the 24",
        ),
        (|config| config.target.area_m2 = Some(1e-300), Code::Invalid, "target.area_m2"),
        (
            |config| {
                config.target.facets.push(config.target.facets[0].clone()); // on the same spot: 48 m^2
                config.target.area_m2 = Some(24.0);
            },
            Code::Invalid,
            "where two overlap, each counts",
        ),
        (|config| config.cell_m = 8.1, Code::Invalid, "narrower than half a cell"),
        (|config| config.gate_sigmas = Some(0.0), Code::OutOfRange, "gate_sigmas"),
        (|config| config.gate_sigmas = Some(-20.0), Code::OutOfRange, "gate_sigmas"),
        (
            |config| config.gate_sigmas = Some(2.9),
            Code::OutOfRange,
            "gate_sigmas is 2.9; it must be 3 or above",
        ),
        (|config| config.gate_sigmas = Some(NAN), Code::NotFinite, "gate_sigmas"),
        (|config| config.gate_sigmas = Some(INFINITE), Code::NotFinite, "gate_sigmas"),
        (|config| config.allowable.depth_m = 0.0, Code::OutOfRange, "allowable.depth_m"),
        (|config| config.allowable.heading_deg = NAN, Code::NotFinite, "allowable.heading_deg"),
        (|config| config.alpha = 1.5, Code::OutOfRange, "alpha"),
        (|config| config.alpha = NAN, Code::NotFinite, "alpha"),
        (
            |config| config.camera.body_from_camera.rotation = [0.0; 4],
            Code::NotUnit,
            "camera.body_from_camera.rotation",
        ),
        (|config| config.camera.horizontal_fov_deg = 180.0, Code::OutOfRange, "camera.horizontal_fov_deg"),
        (|config| config.camera.vertical_fov_deg = 0.0, Code::OutOfRange, "camera.vertical_fov_deg"),
        (|config| config.camera.max_range_m = -1.0, Code::OutOfRange, "camera.max_range_m"),
        (|config| config.camera.direction_sigma_deg = 0.0, Code::OutOfRange, "camera.direction_sigma_deg"),
        (|config| config.camera.rotation_sigma_deg = INFINITE, Code::NotFinite, "camera.rotation_sigma_deg"),
        (
            |config| config.odometry.translation_sigma_m_per_sqrt_m[2] = 0.0,
            Code::OutOfRange,
            "odometry.translation_sigma_m_per_sqrt_m[2]",
        ),
        (
            |config| config.odometry.rotation_sigma_deg_per_sqrt_m[0] = NAN,
            Code::NotFinite,
            "odometry.rotation_sigma_deg_per_sqrt_m[0]",
        ),
        (|config| config.attitude.tilt_sigma_deg = Some(0.0), Code::OutOfRange, "attitude.tilt_sigma_deg"),
        (
            |config| config.attitude.heading_sigma_deg = Some(-1.0),
            Code::OutOfRange,
            "attitude.heading_sigma_deg",
        ),
        (|config| config.depth.sigma_m = Some(0.0), Code::OutOfRange, "depth.sigma_m"),
        (
            |config| config.planner.waypoint_local_saliency = 2.0,
            Code::OutOfRange,
            "planner.waypoint_local_saliency",
        ),
        (|config| config.planner.eps_m = 0.0, Code::OutOfRange, "planner.eps_m"),
        (|config| config.planner.min_points = 0, Code::OutOfRange, "planner.min_points"),
        (|config| config.planner.edge_radius_m = Some(0.0), Code::OutOfRange, "planner.edge_radius_m"),
        (|config| config.planner.sample_spacing_m = Some(NAN), Code::NotFinite, "planner.sample_spacing_m"),
        (|config| config.planner.min_revisit_m = -1.0, Code::OutOfRange, "planner.min_revisit_m"),
        (|config| config.planner.min_baseline_m = 0.0, Code::OutOfRange, "planner.min_baseline_m"),
        (|config| config.planner.max_baseline_m = 0.3, Code::Invalid, "planner.max_baseline_m"),
        (|config| config.planner.max_view_angle_deg = 181.0, Code::OutOfRange, "planner.max_view_angle_deg"),
        (|config| config.planner.max_links = 100_000, Code::OutOfRange, "planner.max_links"),
        (|config| config.planner.swath_m = -0.1, Code::OutOfRange, "planner.swath_m"),
        (|config| config.link_model.bins = 0, Code::OutOfRange, "link_model.bins"),
        (|config| config.link_model.bins = 4, Code::Invalid, "link_model.prior"),
        (|config| config.link_model.prior[1] = [1.0, 2.0], Code::Invalid, "link_model.prior"),
        (|config| config.link_model.prior[0] = [0.0, 0.0], Code::Invalid, "link_model.prior"),
        (|config| config.link_model.prior[0] = [-1.0, 2.0], Code::Invalid, "link_model.prior"),
        (|config| config.robust.camera = Loss::Cauchy(0.0), Code::OutOfRange, "robust.camera.cauchy"),
        (|config| config.robust.depth = Loss::Huber(NAN), Code::NotFinite, "robust.depth.huber"),
        (|config| config.cell_m = 0.0, Code::OutOfRange, "cell_m"),
        (|config| config.survey = Some(vec![]), Code::Invalid, "survey"),
        (|config| config.survey = Some(vec![[0.0; 3]]), Code::Invalid, "survey"),
        (|config| config.survey = Some(vec![[0.0; 3], [0.0, NAN, 0.0]]), Code::NotFinite, "survey[1][1]"),
        (|config| config.survey = Some(vec![[0.0; 3]; 20_000]), Code::TooLarge, "survey"),
        (
            |config| config.first_keyframe_sigmas.as_mut().expect("the default").translation_m[0] = 0.0,
            Code::OutOfRange,
            "first_keyframe_sigmas.translation_m[0]",
        ),
    ]
}

#[test]
fn every_bad_configuration_is_refused_by_code_and_path_and_changes_nothing() {
    let mut vehicle = Vehicle::new(Limits::default());
    for (index, (change, code, path)) in bad_configurations().into_iter().enumerate() {
        let mut bad = config("good");
        change(&mut bad);
        let error =
            vehicle.configure(bad, 1).map(drop).err().unwrap_or_else(|| panic!("row {index}, {path}"));
        assert_eq!(error.code(), code, "row {index}: {error}");
        assert!(error.to_string().contains(path), "row {index}: \"{error}\" does not name {path}");
    }
    assert!(matches!(vehicle.mission(None), Err(StateError::NoMission)));
    vehicle.configure(config("good"), 1).expect("the id is still free");
}

/// What is no more than rounding, or more than the facets, is taken; never is more than all covered.
#[test]
fn an_area_that_holds_the_facets_is_taken() {
    for (area_m2, target_m2) in
        [(None, 24.0), (Some(24.0), 24.0), (Some(24.0 - 1e-9), 24.0), (Some(1e300), 1e300)]
    {
        let mut vehicle = Vehicle::new(Limits::default());
        let mut configuration = config("m");
        configuration.target.area_m2 = area_m2;
        vehicle.configure(configuration, 1).expect("it holds the facets");
        assert_eq!(mission(&mut vehicle).state().target_m2, target_m2, "{area_m2:?}");
    }
}

#[test]
fn questions_with_a_bad_assumption_or_path_are_refused() {
    let mut vehicle = running();
    script("m").offer_all(&mut vehicle);
    let before = bits(mission(&mut vehicle), &pool(1));
    let what_ifs = [
        (WhatIf { alpha: Some(1.5), ..WhatIf::default() }, Code::OutOfRange, "alpha"),
        (WhatIf { sigma_xy_m: Some(0.0), ..WhatIf::default() }, Code::OutOfRange, "sigma_xy_m"),
        (WhatIf { sigma_depth_m: Some(NAN), ..WhatIf::default() }, Code::NotFinite, "sigma_depth_m"),
        (WhatIf { sigma_tilt_deg: Some(-1.0), ..WhatIf::default() }, Code::OutOfRange, "sigma_tilt_deg"),
        (
            WhatIf { sigma_heading_deg: Some(INFINITE), ..WhatIf::default() },
            Code::NotFinite,
            "sigma_heading_deg",
        ),
    ];
    for (what_if, code, place) in what_ifs {
        let error = mission(&mut vehicle).begin_decision(DecisionRequest {
            what_if,
            full: false,
            ..Default::default()
        });
        let error = error.err().unwrap_or_else(|| panic!("{what_if:?}"));
        assert!(error.code() == code && error.to_string().contains(place), "{error}");
    }
    let paths = [
        (vec![], Code::Invalid, "paths"),
        (vec![vec![]], Code::Invalid, "paths[0]"),
        (vec![vec![[0.0; 3], [NAN, 0.0, 0.0]]], Code::NotFinite, "paths[0][1][0]"),
        (vec![vec![[0.0; 3]]; 300], Code::TooLarge, "paths"),
        (vec![vec![[0.0; 3]; 20_000]], Code::TooLarge, "paths[0]"),
    ];
    for (paths, code, place) in paths {
        let error = mission(&mut vehicle).begin_evaluate(paths, DecisionRequest::default());
        let error = error.err().unwrap_or_else(|| panic!("{place}"));
        assert!(error.code() == code && error.to_string().contains(place), "{error}");
    }
    assert!(bits(mission(&mut vehicle), &pool(1)) == before);
}
