//! What happened to a mission, entry by entry: what its journal keeps, and what it is a fold of.

use crate::event::{Event, Undecodable};
use pdn_schemas::codec::{CodecError, Format, Message, decode, encode};
use pdn_schemas::problem::{Code, Problem};
use pdn_schemas::record::{CommandTaken, Configured, DecisionTaken, Kind, Reopened, UnreadEvent};

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
            Entry::Event(event) => event_kind(event),
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
        match self {
            Entry::Event(event) => event_record(event),
            Entry::Configured(message) => of(self.kind(), message.as_ref()),
            Entry::Refused(message) | Entry::TurnedAway(message) => of(self.kind(), message),
            Entry::Command(message) => of(self.kind(), message),
            Entry::Decided(message) => of(self.kind(), message.as_ref()),
            Entry::Reopened(message) => of(self.kind(), message),
        }
    }

    /// What it says, in either format of the contract.
    ///
    /// # Errors
    /// As [`Entry::record`].
    pub fn content(&self, format: Format) -> Result<Vec<u8>, CodecError> {
        match self {
            Entry::Event(Event::Keyframe(message)) => encode(message, format),
            Entry::Event(Event::Factor(message)) => encode(message, format),
            Entry::Event(Event::Link(message)) => encode(message, format),
            Entry::Event(Event::Undecodable(event)) => encode(&unread(event), format),
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
            Kind::Keyframe => Entry::Event(Event::Keyframe(read(bytes)?)),
            Kind::Factor => Entry::Event(Event::Factor(read(bytes)?)),
            Kind::Link => Entry::Event(Event::Link(read(bytes)?)),
            Kind::Unread => Entry::Event(Event::Undecodable(undecodable(read(bytes)?)?)),
            Kind::Refused => Entry::Refused(read(bytes)?),
            Kind::TurnedAway => Entry::TurnedAway(read(bytes)?),
            Kind::Command => Entry::Command(read(bytes)?),
            Kind::Decided => Entry::Decided(Box::new(read(bytes)?)),
            Kind::Reopened => Entry::Reopened(read(bytes)?),
        })
    }
}

/// An event as bytes, without taking it.
pub(crate) fn event_record(event: &Event) -> Result<Record, CodecError> {
    let kind = event_kind(event);
    match event {
        Event::Keyframe(message) => of(kind, message),
        Event::Factor(message) => of(kind, message),
        Event::Link(message) => of(kind, message),
        Event::Undecodable(event) => of(kind, &unread(event)),
    }
}

fn unread(event: &Undecodable) -> UnreadEvent {
    UnreadEvent {
        mission: event.mission.clone(),
        seq: event.seq,
        code: event.code.name().to_owned(),
        message: event.message.clone(),
    }
}

fn event_kind(event: &Event) -> Kind {
    match event {
        Event::Keyframe(_) => Kind::Keyframe,
        Event::Factor(_) => Kind::Factor,
        Event::Link(_) => Kind::Link,
        Event::Undecodable(_) => Kind::Unread,
    }
}

fn undecodable(message: UnreadEvent) -> Result<Undecodable, CodecError> {
    let UnreadEvent { mission, seq, code, message } = message;
    let reason = format!("no code is named {code:?}");
    let code = Code::from_name(&code).ok_or(CodecError::Bincode { message: UnreadEvent::NAME, reason })?;
    Ok(Undecodable { mission, seq, code, message })
}

fn of<T: Message>(kind: Kind, message: &T) -> Result<Record, CodecError> {
    Ok(Record { kind, payload: encode(message, Format::Bincode)? })
}

fn read<T: Message>(bytes: &[u8]) -> Result<T, CodecError> {
    decode(bytes, Format::Bincode)
}
