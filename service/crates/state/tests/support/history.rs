//! A mission that is kept in a journal: its records in the groups in which a daemon would write them.

use super::{SENT_BYTES, bits, config, mission, pool, script};
use pdn_schemas::reply::{Decision, Timing};
use pdn_state::{DecisionRequest, Event, Limits, Operation, Record, Vehicle};

/// What a daemon would have written, group by group, and what it would have answered.
pub struct JournaledMission {
    pub groups: Vec<Vec<Record>>,
    pub decisions: Vec<Decision>,
    pub vehicle: Vehicle,
}

impl JournaledMission {
    pub fn records(&self) -> Vec<Record> {
        self.groups.iter().flatten().cloned().collect()
    }
}

/// A vehicle `v` whose mission `m` is configured, and the first records.
pub fn begun() -> (Vehicle, Vec<Record>) {
    let mut vehicle = Vehicle::kept("v", Limits::default());
    vehicle.configure(config("m"), 1).expect("a valid configuration");
    let records = unwritten(&mut vehicle);
    (vehicle, records)
}

/// Takes what is to be written of the only mission.
pub fn unwritten(vehicle: &mut Vehicle) -> Vec<Record> {
    vehicle.take_unwritten().into_iter().flat_map(|unwritten| unwritten.records).collect()
}

/// The small mission with decisions every `ask_every` events, refusals, a pause, and in groups of at most
/// `group` records. It is not ended.
pub fn journaled(ask_every: usize, group: usize) -> JournaledMission {
    let (mut vehicle, first) = begun();
    let mut journaled = JournaledMission {
        groups: vec![first],
        decisions: Vec::new(),
        vehicle: Vehicle::new(Limits::default()),
    };
    command(&mut journaled, &mut vehicle, Operation::Start);
    let pool = pool(1);
    let mut open = Vec::new();
    for (index, event) in script("m").events.into_iter().enumerate() {
        vehicle.offer(event.clone(), SENT_BYTES);
        if index % 40 == 7 {
            vehicle.offer(spoilt(&event), SENT_BYTES); // turned away: the same number with other content
        }
        open.extend(unwritten(&mut vehicle));
        if open.len() >= group {
            journaled.groups.push(std::mem::take(&mut open));
        }
        if index % ask_every == ask_every - 1 {
            let job = mission(&mut vehicle)
                .begin_decision(DecisionRequest { full: index % 2 == 0, ..Default::default() });
            let outcome = job.expect("the mission runs").run(&pool, &|| false).expect("a decision");
            let timing = Timing { total_ms: index as f64, ..Timing::default() };
            let decision = mission(&mut vehicle).record(outcome, timing).expect("small enough");
            journaled.decisions.push(decision);
            open.extend(unwritten(&mut vehicle));
            journaled.groups.push(std::mem::take(&mut open));
        }
        if index == 50 {
            journaled.groups.push(std::mem::take(&mut open));
            command(&mut journaled, &mut vehicle, Operation::Pause);
            command(&mut journaled, &mut vehicle, Operation::Resume);
        }
    }
    journaled.groups.push(open);
    journaled.groups.retain(|group| !group.is_empty());
    journaled.vehicle = vehicle;
    journaled
}

fn command(journaled: &mut JournaledMission, vehicle: &mut Vehicle, operation: Operation) {
    vehicle.command(None, operation, "a test", 2).expect("a legal path");
    journaled.groups.push(unwritten(vehicle));
}

/// Another event of the same number.
fn spoilt(event: &Event) -> Event {
    let mut spoilt = event.clone();
    match &mut spoilt {
        Event::Keyframe(keyframe) => keyframe.stamp_ns += 1,
        Event::Factor(factor) => factor.stamp_ns += 1,
        Event::Link(link) => link.stamp_ns += 1,
        Event::Undecodable(_) => {}
    }
    spoilt
}

/// Everything that a mission tells of its state, as bits; it is made to run for that.
pub fn running_bits(vehicle: &mut Vehicle) -> Vec<u8> {
    let _ = vehicle.command(None, Operation::Resume, "to look", 9);
    bits(mission(vehicle), &pool(1))
}
