//! The last events of a mission, and which of them were refused.

use crate::event::Event;
use pdn_schemas::event::FactorKind;
use pdn_schemas::problem::Code;
use std::collections::BTreeMap;

/// So many are looked at: those of some minutes.
pub(super) const EVENTS: u64 = 256;

pub(super) const KEYFRAME: &str = "keyframe";

/// The last events, by their numbers.
#[derive(Clone, Debug, Default)]
pub(crate) struct RecentEvents(BTreeMap<u64, RecentEvent>);

/// What is kept of an event.
#[derive(Clone, Debug)]
pub(super) struct RecentEvent {
    pub(super) seq: u64,
    /// Its kind, that of a factor by its own.
    pub(super) kind: &'static str,
    /// None of one that could not be read.
    pub(super) stamp_ns: Option<u64>,
    pub(super) attitude: Option<AttitudeReading>,
    pub(super) refused: Option<Code>,
}

/// An attitude as it was sent.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AttitudeReading {
    pub(crate) keyframe: u64,
    /// `[x, y, z, w]`, valid.
    pub(crate) rotation: [f64; 4],
    pub(crate) has_heading: bool,
}

impl RecentEvents {
    /// The next event; [`RecentEvents::refuse`] tells if it is refused. Cost: O(log 256).
    pub(crate) fn push(&mut self, event: &Event) {
        let (kind, stamp_ns) = match event {
            Event::Keyframe(keyframe) => (KEYFRAME, Some(keyframe.stamp_ns)),
            Event::Factor(factor) => (kind(&factor.factor), Some(factor.stamp_ns)),
            Event::Link(link) => ("link", Some(link.stamp_ns)),
            Event::Undecodable(_) => ("unreadable", None),
        };
        let seq = event.seq();
        self.0.insert(seq, RecentEvent { seq, kind, stamp_ns, attitude: attitude(event), refused: None });
        while self.0.len() as u64 > EVENTS {
            self.0.pop_first();
        }
    }

    /// An event was refused, perhaps after others had come.
    pub(crate) fn refuse(&mut self, seq: u64, code: Code) {
        self.0.entry(seq).and_modify(|event| event.refused = Some(code));
    }

    /// Attitudes that were well-formed, the newest first.
    pub(super) fn attitudes(&self) -> impl Iterator<Item = AttitudeReading> {
        let is_one = |event: &&RecentEvent| event.refused.is_none_or(|code| code == Code::Contradiction);
        self.0.values().rev().filter(is_one).filter_map(|event| event.attitude)
    }

    pub(super) fn iter(&self) -> impl DoubleEndedIterator<Item = &RecentEvent> {
        self.0.values()
    }
}

fn kind(factor: &FactorKind) -> &'static str {
    match factor {
        FactorKind::Prior { .. } => "prior",
        FactorKind::Odometry { .. } => "odometry",
        FactorKind::Relative { .. } => "relative",
        FactorKind::Camera { .. } => "camera",
        FactorKind::Attitude { .. } => "attitude",
        FactorKind::Depth { .. } => "depth",
        FactorKind::Position { .. } => "position",
    }
}

fn attitude(event: &Event) -> Option<AttitudeReading> {
    let Event::Factor(event) = event else { return None };
    let FactorKind::Attitude { keyframe, rotation, heading_variance_rad2, .. } = event.factor else {
        return None;
    };
    Some(AttitudeReading { keyframe, rotation, has_heading: heading_variance_rad2.is_some() })
}
