//! A small mission over a flat sea floor, made of messages only: three lines of keyframes, photographed
//! straight down.

#![allow(dead_code)] // each test file uses its part

pub mod history;
pub mod storage;

use pdn_schemas::codec::{self, Format};
use pdn_schemas::config::{Facet, MissionConfig, Target};
use pdn_schemas::event::{Appearance, Factor, FactorKind, Keyframe, LinkOutcome};
use pdn_schemas::shared::{Covariance6, Pose};
use pdn_state::{DecisionRequest, Event, Limits, Mission, Operation, Vehicle};

/// Bytes as sent of an event; only the bound of what waits looks at them.
pub const SENT_BYTES: usize = 100;

pub const LINES: u64 = 3;
pub const PER_LINE: u64 = 8;

/// One facet of 6 m by 4 m at 10 m depth, seen from above; every other field has its default but the
/// revisit's length.
pub fn config(mission: &str) -> MissionConfig {
    let facet = Facet {
        origin: [-1.0, -1.0, 10.0],
        u: [0.0, 1.0, 0.0],
        v: [1.0, 0.0, 0.0],
        length_u_m: 4.0,
        length_v_m: 6.0,
    };
    let target = Target { facets: vec![facet], area_m2: None };
    let mut config: MissionConfig = serde_json::from_value(serde_json::json!({
        "mission": mission,
        "target": serde_json::to_value(&target).expect("a plain target"),
    }))
    .expect("everything else has a default");
    config.planner.min_revisit_m = 1.0;
    config.survey = Some((0..LINES).flat_map(line_ends).collect());
    config
}

fn line_ends(line: u64) -> [[f64; 3]; 2] {
    [place(line * PER_LINE), place((line + 1) * PER_LINE - 1)]
}

/// Where keyframe `id` is in truth: lines 0.6 m apart, keyframes 0.5 m apart, there and back.
pub fn place(id: u64) -> [f64; 3] {
    let (line, step) = (id / PER_LINE, id % PER_LINE);
    let along = if line % 2 == 0 { step } else { PER_LINE - 1 - step };
    [0.5 * along as f64, 0.6 * line as f64, 8.5]
}

/// Uniform in [-1, 1], the same in every run.
pub fn noise(seed: u64) -> f64 {
    let mixed = (seed + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ (mixed >> 31)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    ((mixed >> 11) as f64 / (1_u64 << 52) as f64) - 1.0
}

pub fn diagonal(variances: [f64; 6]) -> Covariance6 {
    let mut values = [0.0; 36];
    for (index, variance) in variances.into_iter().enumerate() {
        values[7 * index] = variance;
    }
    Covariance6(values)
}

pub fn odometry_covariance() -> Covariance6 {
    diagonal([7e-5, 7e-5, 7e-5, 4e-7, 4e-7, 4e-7])
}

pub fn level(translation: [f64; 3]) -> Pose {
    Pose { translation, rotation: [0.0, 0.0, 0.0, 1.0] }
}

/// Numbers events as they are pushed.
pub struct Script {
    pub mission: String,
    pub events: Vec<Event>,
}

impl Script {
    pub fn new(mission: &str) -> Script {
        Script { mission: mission.to_string(), events: Vec::new() }
    }

    pub fn seq(&self) -> u64 {
        self.events.len() as u64
    }

    pub fn keyframe(&mut self, id: u64, pose: Option<Pose>) {
        let salient = id % PER_LINE < 4;
        let (local, global) = if salient { (0.95, 0.7) } else { (0.2, 0.1) };
        self.events.push(Event::Keyframe(Keyframe {
            mission: self.mission.clone(),
            seq: self.seq(),
            stamp_ns: self.seq(),
            id,
            pose,
            camera: None,
            appearance: Appearance::Saliency { local, global },
        }));
    }

    pub fn factor(&mut self, factor: FactorKind) {
        let event = Factor { mission: self.mission.clone(), seq: self.seq(), stamp_ns: 7, factor };
        self.events.push(Event::Factor(event));
    }

    pub fn link(&mut self, from: u64, to: u64, registered: bool) {
        let event =
            LinkOutcome { mission: self.mission.clone(), seq: self.seq(), stamp_ns: 9, from, to, registered };
        self.events.push(Event::Link(event));
    }

    pub fn odometry(&mut self, from: u64, to: u64) {
        let (before, after) = (place(from), place(to));
        let relative =
            [0, 1, 2].map(|axis| after[axis] - before[axis] + 0.006 * noise(10 * to + axis as u64));
        let factor =
            FactorKind::Odometry { from, to, relative: level(relative), covariance: odometry_covariance() };
        self.factor(factor);
    }

    pub fn depth(&mut self, keyframe: u64) {
        let depth_m = 8.5 + 0.02 * noise(1000 + keyframe);
        self.factor(FactorKind::Depth { keyframe, depth_m, variance_m2: 4e-4 });
    }

    pub fn attitude(&mut self, keyframe: u64) {
        let half = [0, 1, 2].map(|axis| 0.002 * noise(2000 + 10 * keyframe + axis));
        let w = (1.0 - half.iter().map(|value| value * value).sum::<f64>()).sqrt();
        let rotation = [half[0], half[1], half[2], w];
        let factor = FactorKind::Attitude {
            keyframe,
            rotation,
            tilt_variance_rad2: 2e-5,
            heading_variance_rad2: Some(2e-5),
        };
        self.factor(factor);
    }

    /// A registration: the camera looks down with the image's top forward, so its x is east and its y is
    /// south.
    pub fn camera(&mut self, from: u64, to: u64) {
        let (before, after) = (place(from), place(to));
        let north = after[0] - before[0] + 0.004 * noise(3000 + to);
        let east = after[1] - before[1] + 0.004 * noise(4000 + to);
        let length = north.hypot(east);
        let mut covariance = [0.0; 25];
        for (index, sigma_deg) in [1.0_f64, 1.0, 0.1, 0.1, 0.1].into_iter().enumerate() {
            covariance[6 * index] = sigma_deg.to_radians().powi(2);
        }
        let direction = [east / length, -north / length, 0.0];
        self.factor(FactorKind::Camera { from, to, direction, rotation: [0.0, 0.0, 0.0, 1.0], covariance });
    }

    pub fn offer_all(&self, vehicle: &mut Vehicle) {
        for event in &self.events {
            let outcome = vehicle.offer(event.clone(), SENT_BYTES);
            assert_eq!(outcome.refused, vec![], "event {}", event.seq());
        }
    }
}

/// The whole mission: 24 keyframes with odometry, depth, attitude, and registrations across the lines.
pub fn script(mission: &str) -> Script {
    let mut script = Script::new(mission);
    for id in 0..LINES * PER_LINE {
        script.keyframe(id, (id == 0).then(|| level(place(0))));
        if id > 0 {
            script.odometry(id - 1, id);
        }
        script.depth(id);
        script.attitude(id);
        if id >= PER_LINE {
            let line = id / PER_LINE;
            let across = 2 * line * PER_LINE - 1 - id;
            let registered = (id % PER_LINE < 4) == (across % PER_LINE < 4) && id % 3 != 0;
            script.link(across, id, registered);
            if registered {
                script.camera(across, id);
            }
        }
    }
    script
}

/// A vehicle whose mission `m` is running.
pub fn running() -> Vehicle {
    let mut vehicle = Vehicle::new(Limits::default());
    vehicle.configure(config("m"), 1).expect("a valid configuration");
    vehicle.command(None, Operation::Start, "", 2).expect("configured missions can start");
    vehicle
}

pub fn mission(vehicle: &mut Vehicle) -> &mut Mission {
    vehicle.mission(None).expect("the mission was configured")
}

pub fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads")
}

/// Everything that a mission tells of its state, as bits: state, graph with marginals, coverage, table of
/// links and a decision in full.
pub fn bits(mission: &mut Mission, pool: &rayon::ThreadPool) -> Vec<u8> {
    let mut bits = Vec::new();
    let mut push =
        |bytes: Result<Vec<u8>, codec::CodecError>| bits.extend(bytes.expect("answers can be encoded"));
    push(codec::encode(&mission.state(), Format::Bincode));
    let graph = mission.begin_graph(None, true).run().expect("the graph is regular");
    push(codec::encode(&graph, Format::Bincode));
    push(codec::encode(&mission.coverage(), Format::Bincode));
    push(codec::encode(&mission.link_model(), Format::Bincode));
    let job = mission.begin_decision(DecisionRequest { full: true, ..Default::default() });
    let outcome = job.expect("the mission runs").run(pool, &|| false).expect("a decision");
    push(codec::encode(outcome.decision(), Format::Bincode));
    bits
}
