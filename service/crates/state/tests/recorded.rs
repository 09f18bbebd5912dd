//! A journal that an earlier build wrote is read, replayed and written as it was, bit for bit: see
//! `data/README.md`.

mod support;

use pdn_schemas::record::Kind;
use pdn_state::recovery::recover;
use pdn_state::replay::{Verdict, place, replay};
use pdn_state::{Entry, Journal, Limits, Record, WhatIf};
use std::collections::BTreeMap;
use support::pool;
use support::storage::Disk;

const JOURNAL: &[u8] = include_bytes!("data/mission.redb");

fn journal() -> Journal {
    Journal::open(Disk::steady(JOURNAL.to_vec())).expect("a journal of an earlier build")
}

fn records() -> Vec<Record> {
    journal().records().expect("whole").map(|read| read.expect("whole").1).collect()
}

#[test]
fn every_decision_comes_out_as_it_was_recorded() {
    let report = replay(&journal(), Limits::default(), &pool(2), WhatIf::default(), &mut |_| ());
    let report = report.expect("a journal of an earlier build");
    assert_eq!(report.refusal_differs, None);
    let verdicts: Vec<&Verdict> = report.decisions.iter().map(|replayed| &replayed.verdict).collect();
    assert_eq!(verdicts, [&Verdict::Same; 8]);
    let revisits = report.decisions.iter().filter(|replayed| place(&replayed.recorded).is_some()).count();
    assert_eq!(revisits, 7);
}

#[test]
fn the_mission_comes_back_as_it_was() {
    let mut recovered = recover(&journal(), Limits::default()).expect("a journal of an earlier build");
    assert_eq!((recovered.differs, recovered.passed_over), (None, None));
    let state = recovered.mission.state();
    assert_eq!((state.next_seq, state.keyframes, state.decisions, state.revisits), (451, 64, 8, 7));
    assert_eq!(recovered.mission.ingest_status().rejected, 5);
}

#[test]
fn what_is_written_has_the_bytes_of_then() {
    let mut kinds = BTreeMap::new();
    for (number, record) in records().iter().enumerate() {
        *kinds.entry(record.kind).or_insert(0) += 1;
        let entry = Entry::read(record).expect("a record of an earlier build");
        assert_eq!(entry.record().as_ref(), Ok(record), "record {number}");
    }
    let counts = Kind::ALL.iter().map(|kind| kinds.get(kind).copied().unwrap_or(0));
    // Each kind of record is there.
    assert_eq!(counts.collect::<Vec<i32>>(), [1, 64, 233, 153, 1, 5, 1, 5, 8, 1]);
}

/// The events of then, offered anew, leave the records of then.
#[test]
fn events_that_come_again_are_journaled_alike() {
    let mut vehicle = pdn_state::Vehicle::kept("recorded", Limits::default());
    let mut journaled = Vec::new();
    for record in records() {
        match Entry::read(&record).expect("a record of an earlier build") {
            Entry::Configured(configured) => {
                vehicle.configure(configured.config, configured.at_ns).expect("it was configured then");
            }
            Entry::Event(event) => drop(vehicle.offer(event, record.payload.len())),
            _ => {}
        }
        journaled.extend(vehicle.take_unwritten().into_iter().flat_map(|unwritten| unwritten.records));
    }
    let is_of_events = |record: &Record| {
        matches!(record.kind, Kind::Keyframe | Kind::Factor | Kind::Link | Kind::Unread | Kind::Refused)
    };
    let expected: Vec<Record> = records().into_iter().filter(is_of_events).collect();
    journaled.retain(is_of_events);
    // The words of a refusal are for people, and may have changed since.
    let what = |record: &Record| match Entry::read(record).expect("a record") {
        Entry::Refused(problem) => (record.kind, format!("{:?} {}", problem.seq, problem.code).into_bytes()),
        _ => (record.kind, record.payload.clone()),
    };
    assert!(journaled.iter().map(what).eq(expected.iter().map(what)));
}
