//! Shapes that several messages share.

use schemars::JsonSchema;
use serde::de::{Error, SeqAccess, Visitor};
use serde::ser::SerializeTuple;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::borrow::Cow;
use std::fmt;

/// A rigid transform; as a keyframe's pose it is `world_from_body`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Pose {
    /// `[x, y, z]` in metres.
    pub translation: [f64; 3],
    /// Unit quaternion `[x, y, z, w]`; its norm must be 1 within 1e-6.
    pub rotation: [f64; 4],
}

impl Pose {
    /// The transform that moves nothing.
    pub const IDENTITY: Pose = Pose { translation: [0.0; 3], rotation: [0.0, 0.0, 0.0, 1.0] };
}

/// A 6x6 covariance over `[rho (m); phi (rad)]`, row-major: in JSON one list of 36 numbers, in bincode 36
/// consecutive doubles without a length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Covariance6(pub [f64; 36]);

impl Serialize for Covariance6 {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(36)?;
        for value in &self.0 {
            tuple.serialize_element(value)?;
        }
        tuple.end()
    }
}

impl<'de> Deserialize<'de> for Covariance6 {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Flat;
        impl<'de> Visitor<'de> for Flat {
            type Value = Covariance6;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("36 numbers, a 6x6 covariance row by row")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Covariance6, A::Error> {
                let mut values = [0.0; 36];
                for (index, value) in values.iter_mut().enumerate() {
                    *value = seq.next_element()?.ok_or_else(|| A::Error::invalid_length(index, &self))?;
                }
                Ok(Covariance6(values))
            }
        }
        deserializer.deserialize_tuple(36, Flat)
    }
}

impl JsonSchema for Covariance6 {
    fn schema_name() -> Cow<'static, str> {
        "Covariance6".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "description": "A 6x6 covariance over [rho (m); phi (rad)], row-major.",
            "type": "array",
            "items": { "type": "number" },
            "minItems": 36,
            "maxItems": 36
        })
    }
}
