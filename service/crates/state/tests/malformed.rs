//! Records of a journal and events of a mission that are nearly right: nothing fails, and the mission stays
//! sane.
//!
//! `PDN_FUZZ_INPUTS` is how many are tried; the same number tries the same ones.

mod support;

use pdn_state::{Entry, Event, Limits, Operation, Record, Undecodable, Vehicle};
use support::history::journaled;
use support::{SENT_BYTES, Script, config};

struct Chance(u64);

impl Chance {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) % bound.max(1) as u64) as usize
    }
}

fn inputs(share: usize) -> usize {
    let all: usize =
        std::env::var("PDN_FUZZ_INPUTS").map_or(200_000, |inputs| inputs.parse().expect("a number"));
    all / share
}

fn spoilt(record: &Record, chance: &mut Chance) -> Record {
    let mut spoilt = record.clone();
    for _ in 0..1 + chance.below(3) {
        let at = chance.below(spoilt.payload.len());
        match chance.below(4) {
            0 => spoilt.payload.truncate(at),
            1 => spoilt.payload.insert(at, chance.below(256) as u8),
            // Within a double these make large, tiny, negative numbers and none at all.
            _ if at < spoilt.payload.len() => spoilt.payload[at] ^= 1 << chance.below(8),
            _ => {}
        }
    }
    spoilt
}

#[test]
fn no_record_that_is_nearly_one_makes_the_reader_fail() {
    let records = journaled(10, 7).records();
    let (mut chance, mut read) = (Chance(1), 0_usize);
    let tried = inputs(2);
    for index in 0..tried {
        let record = spoilt(&records[index % records.len()], &mut chance);
        read += usize::from(Entry::read(&record).is_ok());
    }
    println!("{tried} malformed records to the journal's reader: no panic; {read} were records after all");
    assert!(read > 0 && read < tried);
}

/// Events as a mission has them, some changed in a bit, some twice, some out of turn, some left out.
#[test]
fn a_mission_stays_sane_whatever_events_come() {
    let seeds: Vec<Record> =
        events().iter().map(|event| Entry::Event(event.clone()).record().expect("an event")).collect();
    let (mut chance, mut offered_events, mut refused_events) = (Chance(2), 0_usize, 0_usize);
    while offered_events < inputs(20) {
        let mut vehicle = Vehicle::new(Limits::default());
        vehicle.configure(config("m"), 1).expect("a valid configuration");
        vehicle.command(None, Operation::Start, "", 2).expect("configured missions can start");
        let mut next_seq = 0;
        for record in &seeds {
            let times = [1, 1, 1, 1, 1, 2, 0][chance.below(7)];
            for _ in 0..times {
                let record = if chance.below(4) == 0 { spoilt(record, &mut chance) } else { record.clone() };
                let Ok(Entry::Event(event)) = Entry::read(&record) else { continue };
                let in_turn = event.mission() == "m" && event.seq() == next_seq;
                let outcome = vehicle.offer(event, SENT_BYTES);
                assert!(
                    !in_turn || outcome.next_seq > next_seq,
                    "{next_seq}: applied or refused, it is consumed"
                );
                offered_events += 1;
                refused_events += outcome.refused.len();
                if outcome.mission == "m" {
                    assert!(outcome.next_seq >= next_seq, "{} after {next_seq}", outcome.next_seq);
                    next_seq = outcome.next_seq;
                }
            }
            // The number of what was left out is consumed by an event that cannot be read.
            let seq = next_seq;
            if chance.below(3) > 0 && seq <= record_seq(record) {
                let code = pdn_schemas::problem::Code::Invalid;
                let (mission, message) = ("m".to_owned(), "torn".to_owned());
                let torn = Event::Undecodable(Undecodable { mission, seq, code, message });
                next_seq = vehicle.offer(torn, SENT_BYTES).next_seq.max(next_seq);
            }
        }
        let mission = vehicle.mission(Some("m")).expect("it is there");
        let state = mission.state();
        assert!(state.covered_m2.is_finite() && state.covered_m2 >= 0.0, "{}", state.covered_m2);
        assert!(state.uncertainty.is_none_or(|uncertainty| uncertainty.is_finite() && uncertainty > 0.0));
        if let Some(robot) = state.robot {
            assert!(robot.pose.translation.iter().all(|coordinate| coordinate.is_finite()));
            assert!((0..6).all(|axis| robot.covariance.0[7 * axis] > 0.0), "{:?}", robot.covariance);
        }
        let status = mission.ingest_status();
        assert_eq!(status.next_seq, state.next_seq);
        assert!(status.rejected <= status.next_seq);
    }
    println!(
        "{offered_events} events to missions, {refused_events} of them refused: every mission stayed sane"
    );
    assert!(refused_events > 0 && refused_events < offered_events);
}

fn record_seq(record: &Record) -> u64 {
    match Entry::read(record) {
        Ok(Entry::Event(event)) => event.seq(),
        _ => 0,
    }
}

fn events() -> Vec<Event> {
    let script: Script = support::script("m");
    script.events
}
