//! Ids of vehicles, missions and consoles: `[a-z0-9_-]{1,64}`, so that they can stand in a key.

use crate::limits::MAX_ID_CHARS;
use std::fmt;
use std::str::FromStr;

/// Why a text is no id.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum IdError {
    /// It has no characters, or too many.
    #[error("an id has 1 to {MAX_ID_CHARS} characters, this one has {chars}")]
    Length {
        /// How many it has.
        chars: usize,
    },
    /// A character other than `a` to `z`, `0` to `9`, `_` and `-`.
    #[error("an id is made of a-z, 0-9, _ and -, but {id:?} has {character:?} at position {position}")]
    Character {
        /// The text.
        id: String,
        /// The first character that does not belong.
        character: char,
        /// Where it stands, from 0.
        position: usize,
    },
}

fn check(id: &str) -> Result<(), IdError> {
    let chars = id.chars().take(MAX_ID_CHARS + 1).count();
    if chars == 0 || chars > MAX_ID_CHARS {
        return Err(IdError::Length { chars: id.chars().count() });
    }
    let stray = |c: &char| !matches!(c, 'a'..='z' | '0'..='9' | '_' | '-');
    match id.chars().enumerate().find(|(_, c)| stray(c)) {
        Some((position, character)) => Err(IdError::Character { id: id.to_owned(), character, position }),
        None => Ok(()),
    }
}

macro_rules! id {
    ($(#[$doc:meta] $name:ident)+) => {
        $(
            #[$doc]
            #[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
            pub struct $name(String);

            impl $name {
                /// The id, if the text is one.
                pub fn new(id: impl Into<String>) -> Result<Self, IdError> {
                    let id = id.into();
                    check(&id)?;
                    Ok($name(id))
                }

                /// Its text.
                pub fn as_str(&self) -> &str {
                    &self.0
                }
            }

            impl FromStr for $name {
                type Err = IdError;

                fn from_str(id: &str) -> Result<Self, IdError> {
                    $name::new(id)
                }
            }

            impl AsRef<str> for $name {
                fn as_ref(&self) -> &str {
                    &self.0
                }
            }

            impl fmt::Display for $name {
                fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
                    f.write_str(&self.0)
                }
            }
        )+
    };
}

id! {
    /// A vehicle: the second chunk of every key.
    VehicleId
    /// A mission of a vehicle.
    MissionId
    /// An operator's console.
    ConsoleName
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_can_stand_in_a_key_is_an_id() {
        for good in ["a", "auv-1", "hull_40", &"x".repeat(64)] {
            assert_eq!(VehicleId::new(good).unwrap().as_str(), good);
        }
        assert_eq!(MissionId::new(""), Err(IdError::Length { chars: 0 }));
        assert_eq!(MissionId::new("x".repeat(65)), Err(IdError::Length { chars: 65 }));
        for bad in ["A", "a/b", "*", "**", "a b", "ä", "a$*", "#", "?", "\0"] {
            assert!(matches!(VehicleId::new(bad), Err(IdError::Character { .. })), "{bad:?}");
        }
    }
}
