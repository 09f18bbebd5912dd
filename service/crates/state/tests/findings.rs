//! What a mission's health tells where its events do not fit together, when it begins to, when it ends, and
//! that a mission that comes back from its journal or a checkpoint tells the same.

mod support;

use pdn_schemas::config::MissionConfig;
use pdn_schemas::event::FactorKind;
use pdn_schemas::problem::Code;
use pdn_schemas::shared::Pose;
use pdn_state::journal::Header;
use pdn_state::recovery::{recover, recover_from};
use pdn_state::{Event, Journal, Limits, Operation, Vehicle};
use support::history::unwritten;
use support::storage::Disk;
use support::{SENT_BYTES, Script, config, level, mission, place, script};

/// A vehicle with a journal whose mission runs.
fn running(config: MissionConfig) -> Vehicle {
    let mut vehicle = Vehicle::kept("v", Limits::default());
    vehicle.configure(config, 1).expect("a valid configuration");
    vehicle.command(None, Operation::Start, "", 2).expect("configured missions can start");
    vehicle
}

fn offer(vehicle: &mut Vehicle, script: &Script, from: usize) {
    script.events[from..].iter().for_each(|event| drop(vehicle.offer(event.clone(), SENT_BYTES)));
}

fn findings(vehicle: &mut Vehicle) -> Vec<String> {
    mission(vehicle).state().health.findings
}

/// The findings after a script, which must be those of the mission as its journal and its checkpoint give it.
fn told(config: MissionConfig, script: &Script) -> Vec<String> {
    let mut vehicle = running(config);
    offer(&mut vehicle, script, 0);
    let records = unwritten(&mut vehicle);
    let header = Header::new(7, "v", "m");
    let journal = Journal::create(Disk::steady(Vec::new()), header, &records).expect("room");
    let told = findings(&mut vehicle);
    let mut again = recover(&journal, Limits::default()).expect("whole").mission;
    assert_eq!(again.state().health.findings, told);
    if let Some(checkpoint) = mission(&mut vehicle).checkpoint() {
        let bytes = checkpoint.to_bytes(&journal).expect("readable");
        let mut forwarded = recover_from(&journal, Some(&bytes), Limits::default()).expect("whole");
        assert_eq!(forwarded.passed_over, None);
        assert_eq!(forwarded.mission.state().health.findings, told);
    }
    told
}

/// The only finding.
fn only(findings: Vec<String>) -> String {
    assert_eq!(findings.len(), 1, "{findings:?}");
    findings.into_iter().next().unwrap_or_default()
}

#[test]
fn nothing_is_told_of_a_mission_that_fits_at_any_of_its_events() {
    let mut vehicle = running(config("m"));
    for event in script("m").events {
        vehicle.offer(event.clone(), SENT_BYTES);
        let tied = !matches!(event, Event::Keyframe(_));
        let told = findings(&mut vehicle);
        assert!(told.is_empty() || !tied, "event {}: {told:?}", event.seq());
    }
}

/// What to change of a good configuration.
type Change = fn(&mut MissionConfig);

fn exchange_u_and_v(config: &mut MissionConfig) {
    let facet = &mut config.target.facets[0];
    (facet.u, facet.v) = (facet.v, facet.u);
    (facet.length_u_m, facet.length_v_m) = (facet.length_v_m, facet.length_u_m);
}

/// A way of 24 keyframes with this target, camera and depth, and nothing that contradicts.
fn seen(change: Change, z_m: f64) -> String {
    let mut config = config("m");
    config.survey = None;
    change(&mut config);
    let mut script = Script::new("m");
    for id in 0..24 {
        let [x, y, _] = place(id);
        script.keyframe(id, (id == 0).then(|| level([x, y, z_m])));
        if id > 0 {
            script.odometry(id - 1, id);
        }
    }
    only(told(config, &script))
}

#[test]
fn why_nothing_is_covered_is_told_from_what_the_cameras_look_at() {
    let cases: [(&str, Change, f64); 6] = [
        ("from behind", exchange_u_and_v, 8.5),
        ("z of their poses", |_| (), -8.5),
        ("z of the facets", |config| config.target.facets[0].origin[2] = -10.0, 8.5),
        ("look away", |config| config.camera.body_from_camera.rotation = [1.0, 0.0, 0.0, 0.0], 8.5),
        ("6.5 m away along the optical axis, beyond camera.max_range_m = 3", |_| (), 3.5),
        ("no facet lies in the field of view", |config| config.target.facets[0].origin[0] = 500.0, 8.5),
    ];
    for (why, change, z_m) in cases {
        let told = seen(change, z_m);
        assert!(told.contains("none of the 24 keyframes") && told.contains(why), "{why}: {told}");
    }
}

#[test]
fn a_facet_from_behind_is_told_from_the_twentieth_keyframe_on_and_no_longer_once_one_is_covered() {
    let mut config = config("m");
    config.camera.max_range_m = 1.0; // the floor is 1.5 m below
    let mut vehicle = running(config);
    let mut script = Script::new("m");
    for id in 0..24 {
        let from = script.events.len();
        script.keyframe(id, (id == 0).then(|| level(place(0))));
        if id > 0 {
            script.odometry(id - 1, id);
        }
        offer(&mut vehicle, &script, from);
        assert_eq!(findings(&mut vehicle).len(), usize::from(id >= 19), "{id}");
    }
    let from = script.events.len();
    script.keyframe(24, None);
    let [x, y, z] = place(23);
    let pose = level([x, y, z + 1.0]);
    let covariance = support::diagonal([1e-4, 1e-4, 1e-4, 1e-6, 1e-6, 1e-6]);
    script.factor(FactorKind::Prior { keyframe: 24, pose, covariance });
    offer(&mut vehicle, &script, from);
    assert_eq!(findings(&mut vehicle), [""; 0]);
}

#[test]
fn registrations_that_never_succeed_are_told_until_one_does() {
    let mut vehicle = running(config("m"));
    let mut script = script("m");
    script.events.retain(|event| !matches!(event, Event::Link(_)));
    renumber(&mut script);
    offer(&mut vehicle, &script, 0);
    // Salient keyframes: P_L expects 85 %, so that 11.76 proposals make ten.
    for tried in 1..=12_u64 {
        let from = script.events.len();
        script.link(0, 1, false);
        offer(&mut vehicle, &script, from);
        assert_eq!(findings(&mut vehicle).len(), usize::from(tried >= 12), "{tried}");
    }
    let finding = only(findings(&mut vehicle));
    assert!(finding.contains("none of the 12 registrations") && finding.contains("expects 10"), "{finding}");
    let from = script.events.len();
    script.link(0, 1, true);
    offer(&mut vehicle, &script, from);
    assert_eq!(findings(&mut vehicle), [""; 0]);
}

#[test]
fn failures_that_were_to_be_expected_are_not_told() {
    let mut script = script("m");
    (0..200).for_each(|_| script.link(5, 6, false)); // P_L of two bare images is 0.005
    assert_eq!(told(config("m"), &script), [""; 0]);
}

#[test]
fn registrations_without_measurements_are_told() {
    let mut script = script("m");
    script.events.retain(|event| match event {
        Event::Factor(factor) => !matches!(factor.factor, FactorKind::Camera { .. }),
        _ => true,
    });
    renumber(&mut script);
    (0..16).for_each(|_| script.link(0, 1, true));
    let finding = only(told(config("m"), &script));
    assert!(finding.contains("send a camera factor with each"), "{finding}");
}

/// How a vehicle that lies at this attitude tells it in its own way.
type Told = fn([f64; 4]) -> [f64; 4];

/// Attitudes by another convention are refused, and the convention is named.
#[test]
fn attitudes_by_another_convention_are_told_with_it() {
    let cases: [(&str, Told); 5] = [
        ("with w first", |[x, y, z, w]| [w, x, y, z]),
        ("of a body with z up", |[x, y, z, w]| [w, z, -y, -x]),
        ("in a world with z up", |[x, y, z, w]| [w, -z, y, -x]),
        ("as body_from_world", |[x, y, z, w]| [-x, -y, -z, w]),
        ("no usual convention", |[x, y, z, w]| {
            // Mounted a third of a turn about x and then y.
            let (a, b) = (30.0_f64.to_radians().sin(), 30.0_f64.to_radians().cos());
            product(product([x, y, z, w], [a, 0.0, 0.0, b]), [0.0, a, 0.0, b])
        }),
    ];
    for (what, told_as) in cases {
        let heading_rad = 2.0_f64; // far from where several conventions say the same
        let rotation = [0.0, 0.0, (0.5 * heading_rad).sin(), (0.5 * heading_rad).cos()];
        let mut script = Script::new("m");
        for id in 0..12 {
            script.keyframe(id, (id == 0).then(|| Pose { translation: place(0), rotation }));
            if id > 0 {
                script.odometry(id - 1, id);
            }
            let factor = FactorKind::Attitude {
                keyframe: id,
                rotation: told_as(rotation),
                tilt_variance_rad2: 2e-5,
                heading_variance_rad2: Some(2e-5),
            };
            script.factor(factor);
        }
        let finding = only(told(config("m"), &script));
        assert!(finding.contains("the last 12 attitudes") && finding.contains(what), "{what}: {finding}");
        let others = cases.iter().map(|(other, _)| *other).filter(|other| *other != what);
        for other in others {
            assert!(!finding.contains(other), "{what}, not {other}: {finding}");
        }
    }
}

fn product([x, y, z, w]: [f64; 4], [a, b, c, d]: [f64; 4]) -> [f64; 4] {
    [
        w * a + x * d + y * c - z * b,
        w * b - x * c + y * d + z * a,
        w * c + x * b - y * a + z * d,
        w * d - x * a - y * b - z * c,
    ]
}

/// Eight in a row, no fewer, and one that fits ends it.
#[test]
fn attitudes_are_told_once_eight_are_off_and_until_one_fits() {
    let mut vehicle = running(config("m"));
    let mut script = Script::new("m");
    let attitude = |script: &mut Script, keyframe, rotation| {
        script.factor(FactorKind::Attitude {
            keyframe,
            rotation,
            tilt_variance_rad2: 2e-5,
            heading_variance_rad2: None,
        });
    };
    for id in 0..10 {
        let from = script.events.len();
        script.keyframe(id, (id == 0).then(|| level(place(0))));
        if id > 0 {
            script.odometry(id - 1, id);
        }
        attitude(&mut script, id, [1.0, 0.0, 0.0, 0.0]);
        offer(&mut vehicle, &script, from);
        let told = findings(&mut vehicle);
        assert_eq!(told.len(), usize::from(id >= 7), "{id}: {told:?}");
    }
    let from = script.events.len();
    attitude(&mut script, 9, [0.0, 0.0, 0.0, 1.0]);
    offer(&mut vehicle, &script, from);
    assert_eq!(findings(&mut vehicle), [""; 0]);
}

#[test]
fn a_kind_of_which_nothing_is_taken_is_told_with_its_code() {
    let base = script("m");
    for (kind, code) in [("camera", Code::DegenerateBaseline), ("link", Code::UnknownKeyframe)] {
        let mut script = Script::new("m");
        script.events = base.events.clone();
        script.events.retain(|event| match event {
            Event::Factor(factor) => !matches!(factor.factor, FactorKind::Camera { .. }),
            Event::Link(_) => false,
            _ => true,
        });
        renumber(&mut script);
        script.keyframe(77, Some(level(place(23))));
        let covariance = support::odometry_covariance();
        script.factor(FactorKind::Odometry {
            from: 23,
            to: 77,
            relative: level([0.01, 0.0, 0.0]),
            covariance,
        });
        for tried in 0..16 {
            match kind {
                "camera" => script.factor(FactorKind::Camera {
                    from: 23,
                    to: 77,
                    direction: [1.0, 0.0, 0.0],
                    rotation: [0.0, 0.0, 0.0, 1.0],
                    covariance: std::array::from_fn(|index| if index % 6 == 0 { 1e-4 } else { 0.0 }),
                }),
                _ => script.link(1000 + tried, 3, false),
            }
            let told = told(config("m"), &script);
            assert_eq!(told.len(), usize::from(tried == 15), "{kind} {tried}: {told:?}");
        }
        let finding = only(told(config("m"), &script));
        let expected =
            format!("all 16 {kind} events among the last 256 were refused, the last as {}", code.name());
        assert!(finding.contains(&expected), "{finding}");
    }
}

#[test]
fn stamps_that_go_back_are_told_until_the_keyframes_before_are_forgotten() {
    let mut script = script("m");
    for event in &mut script.events {
        if let Event::Keyframe(keyframe) = event {
            keyframe.stamp_ns = 5_000_000_000 + 1_000_000_000 * keyframe.id;
            if keyframe.id >= 20 {
                keyframe.stamp_ns -= 3_000_000_000; // the clock was set
            }
        }
    }
    let finding = only(told(config("m"), &script));
    assert!(finding.contains("goes back by 2.000 s"), "{finding}");
    (0..256).for_each(|_| script.depth(23));
    assert_eq!(told(config("m"), &script), [""; 0]);
}

#[test]
fn two_clocks_are_told() {
    let mut script = script("m");
    for event in &mut script.events {
        match event {
            Event::Keyframe(keyframe) => keyframe.stamp_ns += 1_600_000_000_000_000_000,
            Event::Factor(factor) => factor.stamp_ns = 1_700_000_000_000_000_000,
            Event::Link(link) => link.stamp_ns = 1_700_000_000_000_000_000,
            Event::Undecodable(_) => {}
        }
    }
    let finding = only(told(config("m"), &script));
    assert!(finding.contains("1157 days") && finding.contains("two clocks"), "{finding}");
}

fn renumber(script: &mut Script) {
    for (seq, event) in (0_u64..).zip(&mut script.events) {
        match event {
            Event::Keyframe(keyframe) => (keyframe.seq, keyframe.stamp_ns) = (seq, seq),
            Event::Factor(factor) => factor.seq = seq,
            Event::Link(link) => link.seq = seq,
            Event::Undecodable(event) => event.seq = seq,
        }
    }
}
