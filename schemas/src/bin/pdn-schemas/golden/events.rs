//! What a vehicle sends.

use super::{Vectors, edges, ordinary, spellings};
use pdn_schemas::event::{Appearance, Factor, FactorKind, Keyframe, LinkOutcome};
use pdn_schemas::shared::{Covariance6, Pose};

pub fn add(vectors: &mut Vectors) {
    let bare = Keyframe {
        mission: "m".into(),
        seq: 0,
        stamp_ns: 0,
        id: 0,
        pose: None,
        camera: None,
        appearance: Appearance::None,
    };
    vectors.add("none", &bare);
    let id = "a-very_long-mission-id-of-sixty-four-characters-0123456789abcdef";
    let full = Keyframe {
        mission: id.into(),
        seq: u64::MAX,
        stamp_ns: 1_700_000_000_123_456_789,
        id: u64::MAX - 1,
        pose: Some(Pose { translation: [1.5, -2.25, 5.0], rotation: [0.5, -0.5, 0.5, 0.5] }),
        camera: Some(Pose { translation: edges(), rotation: edges() }),
        appearance: Appearance::Saliency { local: 0.1, global: 1.0 },
    };
    vectors.add("saliency", &full);
    let with = |appearance| Keyframe { appearance, pose: Some(Pose::IDENTITY), ..bare.clone() };
    vectors.add("words-empty", &with(Appearance::Words(Vec::new())));
    let words = (0..200).map(|word| (word * 7, u32::MAX - word)).collect();
    vectors.add("words", &with(Appearance::Words(words)));
    vectors.add("descriptors-empty", &with(Appearance::Descriptors { dim: 0, values: Vec::new() }));
    let mut values: Vec<f32> = (0..128u8).map(|index| f32::from(index) / 128.0).collect();
    values.extend([0.1, -0.0, f32::MAX, f32::MIN_POSITIVE, f32::from_bits(1), 1.0 / 3.0]);
    vectors.add("descriptors", &with(Appearance::Descriptors { dim: 67, values }));
    let values: Vec<f32> = spellings().iter().map(|&value| value as f32).collect();
    let dim = values.len() as u32;
    vectors.add("descriptors-spellings", &with(Appearance::Descriptors { dim, values }));

    let pose = Pose { translation: [0.5, 0.0, -0.125], rotation: [0.0, 0.0, 0.6, 0.8] };
    let covariance = Covariance6(ordinary(1e-4));
    let position_covariance = [0.25, 0.01, 0.0, 0.01, 0.5, 0.0, 0.0, 0.0, 0.0];
    let kinds = [
        ("prior", FactorKind::Prior { keyframe: 0, pose, covariance }),
        ("odometry", FactorKind::Odometry { from: 0, to: 1, relative: pose, covariance }),
        ("relative", FactorKind::Relative { from: 7, to: 3, relative: pose, covariance }),
        (
            "camera",
            FactorKind::Camera {
                from: u64::MAX,
                to: 0,
                direction: [0.6, 0.0, 0.8],
                rotation: [0.0, 0.0, 0.0, 1.0],
                covariance: ordinary(1e-6),
            },
        ),
        (
            "attitude",
            FactorKind::Attitude {
                keyframe: 4,
                rotation: [0.0, 1.0, 0.0, 0.0],
                tilt_variance_rad2: 1.9e-5,
                heading_variance_rad2: Some(2e-5),
            },
        ),
        (
            "attitude-tilt",
            FactorKind::Attitude {
                keyframe: 4,
                rotation: [0.0, 0.0, 0.0, -1.0],
                tilt_variance_rad2: 1e-300,
                heading_variance_rad2: None,
            },
        ),
        ("depth", FactorKind::Depth { keyframe: 2, depth_m: 12.75, variance_m2: 4e-4 }),
        (
            "position",
            FactorKind::Position { keyframe: 9, position: [1e6, -1e6, 0.0], covariance: position_covariance },
        ),
        (
            "edges",
            FactorKind::Relative {
                from: u64::MAX,
                to: u64::MAX,
                relative: Pose { translation: edges(), rotation: edges() },
                covariance: Covariance6(edges()),
            },
        ),
        (
            "spellings",
            FactorKind::Prior {
                keyframe: 0,
                pose,
                covariance: Covariance6(std::array::from_fn(|i| spellings()[i])),
            },
        ),
    ];
    for (seq, (case, factor)) in (1..).zip(kinds) {
        vectors
            .add(case, &Factor { mission: "hull_40-1".into(), seq, stamp_ns: 1_000_000_007 * seq, factor });
    }

    for (case, registered) in [("registered", true), ("failed", false)] {
        let (from, to) = (12, u64::MAX);
        vectors.add(case, &LinkOutcome { mission: "m".into(), seq: 5, stamp_ns: 9, from, to, registered });
    }
}
