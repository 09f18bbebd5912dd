//! Random messages survive both formats.

use pdn_schemas::codec::{Format, decode, encode};
use pdn_schemas::config::{Loss, MissionConfig};
use pdn_schemas::event::{Appearance, Factor, FactorKind, Keyframe};
use pdn_schemas::shared::{Covariance6, Pose};
use proptest::array::{uniform3, uniform4};
use proptest::collection::vec;
use proptest::num::{f32, f64};
use proptest::prelude::*;

/// Every finite double, signed zeros and subnormals included.
fn number() -> impl Strategy<Value = f64> {
    f64::NORMAL | f64::SUBNORMAL | f64::ZERO
}

fn pose() -> impl Strategy<Value = Pose> {
    (uniform3(number()), uniform4(number()))
        .prop_map(|(translation, rotation)| Pose { translation, rotation })
}

fn appearance() -> impl Strategy<Value = Appearance> {
    let single = f32::NORMAL | f32::SUBNORMAL | f32::ZERO;
    prop_oneof![
        (number(), number()).prop_map(|(local, global)| Appearance::Saliency { local, global }),
        vec(any::<(u32, u32)>(), 0..20).prop_map(Appearance::Words),
        (any::<u32>(), vec(single, 0..40)).prop_map(|(dim, values)| Appearance::Descriptors { dim, values }),
        Just(Appearance::None),
    ]
}

fn factor() -> impl Strategy<Value = FactorKind> {
    let covariance = vec(number(), 36).prop_map(|values| Covariance6(values.try_into().unwrap()));
    prop_oneof![
        (any::<u64>(), any::<u64>(), pose(), covariance).prop_map(|(from, to, relative, covariance)| {
            FactorKind::Odometry { from, to, relative, covariance }
        }),
        (any::<u64>(), uniform4(number()), number(), proptest::option::of(number())).prop_map(
            |(keyframe, rotation, tilt_variance_rad2, heading_variance_rad2)| FactorKind::Attitude {
                keyframe,
                rotation,
                tilt_variance_rad2,
                heading_variance_rad2,
            }
        ),
        (any::<u64>(), number(), number()).prop_map(|(keyframe, depth_m, variance_m2)| FactorKind::Depth {
            keyframe,
            depth_m,
            variance_m2
        }),
    ]
}

/// Equality of bytes, which tells -0 from 0.
fn assert_survives<T: pdn_schemas::codec::Message>(message: &T) {
    let bincode = encode(message, Format::Bincode).unwrap();
    for format in [Format::Bincode, Format::Json] {
        let back: T = decode(&encode(message, format).unwrap(), format).unwrap();
        assert_eq!(encode(&back, Format::Bincode).unwrap(), bincode, "{format:?} of {message:?}");
    }
}

proptest! {
    #[test]
    fn keyframes_survive(
        mission in ".{0,64}",
        (seq, stamp_ns, id) in any::<(u64, u64, u64)>(),
        pose in proptest::option::of(pose()),
        camera in proptest::option::of(pose()),
        appearance in appearance(),
    ) {
        assert_survives(&Keyframe { mission, seq, stamp_ns, id, pose, camera, appearance });
    }

    #[test]
    fn factors_survive(mission in ".{0,64}", (seq, stamp_ns) in any::<(u64, u64)>(), factor in factor()) {
        assert_survives(&Factor { mission, seq, stamp_ns, factor });
    }

    #[test]
    fn bytes_at_random_are_no_harm(bytes in vec(any::<u8>(), 0..500)) {
        for format in [Format::Bincode, Format::Json] {
            let _ = decode::<Keyframe>(&bytes, format);
            let _ = decode::<Factor>(&bytes, format);
            let _ = decode::<MissionConfig>(&bytes, format);
            let _ = pdn_schemas::codec::decode_head(&bytes, format);
        }
    }
}

#[test]
fn a_configuration_may_leave_out_what_has_a_default() {
    let facet = r#"{"origin":[0,0,10],"u":[1,0,0],"v":[0,1,0],"length_u_m":40,"length_v_m":20}"#;
    let least = format!(r#"{{"mission":"m","target":{{"facets":[{facet}]}}}}"#);
    let config: MissionConfig = decode(least.as_bytes(), Format::Json).unwrap();
    let golden = include_bytes!("../generated/golden/MissionConfig-default.json");
    assert_eq!(decode::<MissionConfig>(golden, Format::Json).as_ref(), Ok(&config));
    let partly = format!(
        r#"{{"mission":"m","target":{{"facets":[{facet}]}},
            "allowable":{{"x_m":0.5}},"camera":{{"max_range_m":9}},
            "robust":{{"camera":"none"}},"planner":{{"max_links":2}},"first_keyframe_sigmas":null}}"#
    );
    let partly: MissionConfig = decode(partly.as_bytes(), Format::Json).unwrap();
    let mut expected = config;
    expected.allowable.x_m = 0.5;
    expected.camera.max_range_m = 9.0;
    expected.robust.camera = Loss::None;
    expected.planner.max_links = 2;
    expected.first_keyframe_sigmas = None;
    assert_eq!(partly, expected);
}

#[test]
fn a_configuration_can_be_toml() {
    let text = "mission = 'm'\nalpha = 0.5\n[[target.facets]]\norigin = [0, 0, 10]\n\
                u = [1, 0, 0]\nv = [0, 1, 0]\n\
                length_u_m = 40\nlength_v_m = 20\n[robust]\ncamera = { huber = 1.345 }\nposition = 'none'\n";
    let config: MissionConfig = toml::from_str(text).unwrap();
    assert_eq!(config.alpha, 0.5);
    assert_eq!(config.robust.camera, Loss::Huber(1.345));
    assert!(toml::from_str::<MissionConfig>(&format!("colour = 'red'\n{text}")).is_err());
}
