//! Every key, formatted and parsed: `pdn/{vehicle}/v1/{topic}`. No other file spells one.
//!
//! ```
//! use pdn_schemas::ids::VehicleId;
//! use pdn_schemas::keys::{Key, key};
//! use pdn_schemas::topics::Topic;
//!
//! let vehicle = VehicleId::new("auv-1").unwrap();
//! assert_eq!(key(&vehicle, Topic::InFactor), "pdn/auv-1/v1/in/factor");
//! assert_eq!(Key::parse("pdn/auv-1/v1/in/factor").unwrap().topic, Topic::InFactor);
//! ```

use crate::ids::{ConsoleName, IdError, VehicleId};
use crate::topics::{Role, Topic};

/// First chunk of every key.
pub const ROOT: &str = "pdn";

/// Version of the contract: third chunk of every key and second part of every message's schema name.
pub const VERSION: &str = "v1";

/// The key of a topic of one vehicle; for `AliveConsole` a pattern that matches consoles of every name.
pub fn key(vehicle: &VehicleId, topic: Topic) -> String {
    format!("{ROOT}/{vehicle}/{VERSION}/{}", topic.suffix())
}

/// A pattern that matches the topic of every vehicle: what the service declares.
pub fn every_vehicle(topic: Topic) -> String {
    format!("{ROOT}/*/{VERSION}/{}", topic.suffix())
}

/// A pattern that matches every topic of a role, of every vehicle: `pdn/*/v1/in/*`, ...
pub fn every_vehicle_and_topic(role: Role) -> String {
    let rest = match role {
        Role::Event => "in/*",
        Role::Question => "rpc/*",
        Role::Command => "op/*",
        Role::Publication => "out/*",
        Role::Liveliness => "alive/**",
    };
    format!("{ROOT}/*/{VERSION}/{rest}")
}

/// A key without wildcards, taken apart.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Key {
    /// Whose.
    pub vehicle: VehicleId,
    /// What about.
    pub topic: Topic,
    /// Which console; none but for `AliveConsole`.
    pub console: Option<ConsoleName>,
}

/// Why a text is no key of the contract.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum KeyError {
    /// Not `pdn/{vehicle}/v1/...`.
    #[error("{key:?} is no key of this contract: it must begin with {ROOT}/<vehicle>/{VERSION}/")]
    Foreign {
        /// The text.
        key: String,
    },
    /// The vehicle or console has no proper id.
    #[error("{key:?}: {source}")]
    Id {
        /// The text.
        key: String,
        /// What is wrong with the id.
        source: IdError,
    },
    /// Nothing of that name is spoken about.
    #[error("{key:?}: nothing stands under {suffix:?}; schemas/keys.md lists what does")]
    Topic {
        /// The text.
        key: String,
        /// What follows the version.
        suffix: String,
    },
}

impl Key {
    /// Takes a key apart.
    pub fn parse(key: &str) -> Result<Key, KeyError> {
        let foreign = || KeyError::Foreign { key: key.to_owned() };
        let id = |source| KeyError::Id { key: key.to_owned(), source };
        let mut chunks = key.splitn(4, '/');
        let (root, vehicle, version, suffix) =
            match (chunks.next(), chunks.next(), chunks.next(), chunks.next()) {
                (Some(root), Some(vehicle), Some(version), Some(suffix)) => (root, vehicle, version, suffix),
                _ => return Err(foreign()),
            };
        if root != ROOT || version != VERSION {
            return Err(foreign());
        }
        let vehicle = VehicleId::new(vehicle).map_err(id)?;
        if let Some(console) = suffix.strip_prefix("alive/console/") {
            let console = Some(ConsoleName::new(console).map_err(id)?);
            return Ok(Key { vehicle, topic: Topic::AliveConsole, console });
        }
        let unknown = || KeyError::Topic { key: key.to_owned(), suffix: suffix.to_owned() };
        let topic = Topic::from_suffix(suffix).ok_or_else(unknown)?;
        Ok(Key { vehicle, topic, console: None })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_parses_to_what_it_was_made_of() {
        let vehicle = VehicleId::new("auv-1").unwrap();
        for &topic in Topic::ALL.iter().filter(|&&topic| topic != Topic::AliveConsole) {
            let parsed = Key::parse(&key(&vehicle, topic)).unwrap();
            assert_eq!(parsed, Key { vehicle: vehicle.clone(), topic, console: None });
        }
        let console = ConsoleName::new("bridge").unwrap();
        let parsed = Key::parse("pdn/auv-1/v1/alive/console/bridge").unwrap();
        assert_eq!(parsed, Key { vehicle, topic: Topic::AliveConsole, console: Some(console) });
    }

    #[test]
    fn a_topic_stands_under_the_prefix_of_its_role() {
        for &topic in Topic::ALL {
            let pattern = every_vehicle_and_topic(topic.role());
            let prefix = pattern.trim_end_matches('*');
            assert!(every_vehicle(topic).starts_with(prefix), "{topic:?} does not stand under {pattern}");
        }
    }

    #[test]
    fn what_is_no_key_is_refused_with_the_reason() {
        for foreign in
            ["", "pdn", "pdn/a/v1", "pdn/a/v2/in/factor", "x/a/v1/in/factor", "/pdn/a/v1/in/factor"]
        {
            assert!(matches!(Key::parse(foreign), Err(KeyError::Foreign { .. })), "{foreign:?}");
        }
        for bad_id in
            ["pdn/A/v1/in/factor", "pdn/*/v1/in/factor", "pdn//v1/in/factor", "pdn/a/v1/alive/console/"]
        {
            assert!(matches!(Key::parse(bad_id), Err(KeyError::Id { .. })), "{bad_id:?}");
        }
        for unknown in
            ["pdn/a/v1/in/", "pdn/a/v1/in/factors", "pdn/a/v1/in/factor/x", "pdn/a/v1/alive/console"]
        {
            assert!(matches!(Key::parse(unknown), Err(KeyError::Topic { .. })), "{unknown:?}");
        }
    }
}
