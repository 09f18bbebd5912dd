//! What happened to a mission, entry by entry: what its journal keeps, and what it is a fold of.

use crate::event::Event;
use pdn_schemas::codec::{CodecError, Format, Message, decode, encode};
use pdn_schemas::problem::Problem;
use pdn_schemas::record::{CommandTaken, Configured, DecisionTaken, Kind, Reopened};

/// Version of the software, which is written beside what depends on it.
pub const SOFTWARE: &str = concat!("pdnd ", env!("CARGO_PKG_VERSION"));

/// Something that happened to a mission.
#[derive(Clone, Debug, PartialEq)]
#[allow(clippy::large_enum_variant)] // nearly all entries are events
pub enum Entry {
    /// It was configured.
    Configured(Box<Configured>),
    /// An event consumed its number.
    Event(Event),
    /// What the entry before made the mission refuse; it follows from the entries before.
    Refused(Problem),
    /// An event was refused without consuming a number. Nothing follows from it.
    TurnedAway(Problem),
    /// A command was carried out.
    Command(CommandTaken),
    /// A decision was taken.
    Decided(Box<DecisionTaken>),
    /// The daemon was started anew.
    Reopened(Reopened),
}

/// An entry as bytes: its kind and its payload in the contract's bincode.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Record {
    /// What it is.
    pub kind: Kind,
    /// The message.
    pub payload: Vec<u8>,
}

impl Entry {
    /// What it is.
    pub fn kind(&self) -> Kind {
        match self {
            Entry::Configured(_) => Kind::Configured,
            Entry::Event(event) => event.kind(),
            Entry::Refused(_) => Kind::Refused,
            Entry::TurnedAway(_) => Kind::TurnedAway,
            Entry::Command(_) => Kind::Command,
            Entry::Decided(_) => Kind::Decided,
            Entry::Reopened(_) => Kind::Reopened,
        }
    }

    /// The entry as bytes.
    ///
    /// # Errors
    /// [`CodecError::TooLarge`] for what no reader would take.
    pub fn record(&self) -> Result<Record, CodecError> {
        Ok(Record { kind: self.kind(), payload: self.content(Format::Bincode)? })
    }

    /// What it says, in either format of the contract.
    ///
    /// # Errors
    /// As [`Entry::record`]; [`CodecError::NotFinite`] for what JSON cannot say.
    pub fn content(&self, format: Format) -> Result<Vec<u8>, CodecError> {
        match self {
            Entry::Event(event) => event.encode(format),
            Entry::Configured(message) => encode(message.as_ref(), format),
            Entry::Refused(message) | Entry::TurnedAway(message) => encode(message, format),
            Entry::Command(message) => encode(message, format),
            Entry::Decided(message) => encode(message.as_ref(), format),
            Entry::Reopened(message) => encode(message, format),
        }
    }

    /// The entry of these bytes.
    ///
    /// # Errors
    /// What does not belong to a payload of that kind.
    pub fn read(record: &Record) -> Result<Entry, CodecError> {
        let bytes = &record.payload;
        Ok(match record.kind {
            Kind::Configured => Entry::Configured(Box::new(read(bytes)?)),
            kind @ (Kind::Keyframe | Kind::Factor | Kind::Link | Kind::Unread) => {
                Entry::Event(Event::decode(kind, bytes)?)
            }
            Kind::Refused => Entry::Refused(read(bytes)?),
            Kind::TurnedAway => Entry::TurnedAway(read(bytes)?),
            Kind::Command => Entry::Command(read(bytes)?),
            Kind::Decided => Entry::Decided(Box::new(read(bytes)?)),
            Kind::Reopened => Entry::Reopened(read(bytes)?),
        })
    }
}

fn read<T: Message>(bytes: &[u8]) -> Result<T, CodecError> {
    decode(bytes, Format::Bincode)
}
