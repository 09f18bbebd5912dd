//! A mission comes back from its journal as it was, bit for bit, and its decisions come out again as they
//! were.

mod support;

use pdn_schemas::problem::Code;
use pdn_schemas::record::Kind;
use pdn_schemas::reply::Phase;
use pdn_state::journal::Header;
use pdn_state::recovery::recover;
use pdn_state::replay::{Verdict, place, replay};
use pdn_state::{Absence, Entry, Journal, JournalError, Limits, Operation, Record, Vehicle, WhatIf};
use support::history::{begun, journaled, running_bits, unwritten};
use support::storage::Disk;
use support::{SENT_BYTES, bits, config, mission, pool, script};

fn journal(groups: &[Vec<Record>]) -> (Journal, Disk) {
    let disk = Disk::steady(Vec::new());
    let mut journal = Journal::create(disk.clone(), Header::new(7, "v", "m"), &groups[0]).expect("room");
    groups[1..].iter().for_each(|group| journal.append(group).expect("room"));
    (journal, disk)
}

/// A vehicle that has taken the mission up as a daemon would after a restart.
fn restarted(journal: &Journal) -> Vehicle {
    let recovered = recover(journal, Limits::default()).expect("a whole journal");
    assert_eq!((recovered.vehicle.as_str(), recovered.differs), ("v", None));
    let mut vehicle = Vehicle::kept("v", Limits::default());
    vehicle.set_absent("m", 0, Absence::Reading);
    assert_eq!(vehicle.mission(None).map(drop).expect_err("it is being read").code(), Code::NotReady);
    vehicle.take_up(recovered.mission, 77).expect("it can be noted");
    vehicle
}

#[test]
fn a_mission_comes_back_bit_for_bit() {
    let mut lived = journaled(10, 7);
    let (journal, _) = journal(&lived.groups);
    let mut vehicle = restarted(&journal);
    let state = mission(&mut vehicle).state();
    assert_eq!((state.phase, state.since_ns), (Phase::Held, 77));
    assert!(state.reason.contains("started anew") && state.reason.contains("running"), "{}", state.reason);
    let status = mission(&mut vehicle).ingest_status();
    assert_eq!((status.next_seq, status.durable_seq), (script("m").seq(), script("m").seq()));
    let before = mission(&mut lived.vehicle);
    assert_eq!((before.ingest_status().durable_seq, before.state().decisions), (0, state.decisions));
    lived.vehicle.command(None, Operation::Hold, "to look", 9).expect("it runs");
    assert!(running_bits(&mut vehicle) == running_bits(&mut lived.vehicle));
}

#[test]
fn it_goes_on_as_if_nothing_had_been_wherever_it_stops() {
    let events = script("m").events;
    let mut straight = journaled(usize::MAX, 7);
    let expected = {
        straight.vehicle.command(None, Operation::Hold, "to look", 9).expect("it runs");
        running_bits(&mut straight.vehicle)
    };
    for stop in (0..events.len()).step_by(9) {
        let (mut vehicle, mut records) = begun();
        vehicle.command(None, Operation::Start, "", 2).expect("configured");
        events[..stop].iter().for_each(|event| drop(vehicle.offer(event.clone(), SENT_BYTES)));
        records.extend(unwritten(&mut vehicle));
        let (journal, _) = journal(&[records]);
        let mut vehicle = restarted(&journal);
        for event in &events[stop.saturating_sub(5)..] {
            let outcome = vehicle.offer(event.clone(), SENT_BYTES);
            assert_eq!((outcome.repeat, outcome.refused), (event.seq() < stop as u64, vec![]));
        }
        assert!(running_bits(&mut vehicle) == expected, "stopped before event {stop}");
    }
}

#[test]
fn ended_missions_stay_ended_and_configured_ones_configured() {
    for (operations, phase) in [
        (vec![], Phase::Held),
        (vec![Operation::Start], Phase::Held),
        (vec![Operation::Start, Operation::Pause], Phase::Held),
        (vec![Operation::Start, Operation::Hold], Phase::Held),
        (vec![Operation::Start, Operation::Complete], Phase::Completed),
        (vec![Operation::Abort], Phase::Aborted),
    ] {
        let phase = if operations.is_empty() { Phase::Configured } else { phase };
        let (mut vehicle, mut records) = begun();
        for operation in operations {
            vehicle.command(None, operation, "", 2).expect("a legal path");
        }
        records.extend(unwritten(&mut vehicle));
        let (journal, _) = journal(&[records]);
        let mut vehicle = restarted(&journal);
        assert_eq!(mission(&mut vehicle).phase(), phase);
        let written = unwritten(&mut vehicle).len();
        assert_eq!(written, usize::from(!matches!(phase, Phase::Completed | Phase::Aborted)));
        let again = vehicle.configure(config("m"), 3).map(drop);
        // Only what was never begun can be configured anew under its id.
        assert_eq!(again.is_ok(), phase == Phase::Configured, "{phase:?}");
    }
}

#[test]
fn a_mission_configured_anew_before_its_first_event_is_the_last_one() {
    let (mut vehicle, mut records) = begun();
    let mut other = config("m");
    other.alpha = 0.25;
    vehicle.configure(other, 2).expect("nothing has come yet");
    records.extend(unwritten(&mut vehicle));
    let (journal, _) = journal(&[records]);
    let state = mission(&mut restarted(&journal)).state();
    assert_eq!((state.config.alpha, journal.len()), (0.25, 2));
}

#[test]
fn a_successor_aborts_what_never_ended_and_the_oldest_is_forgotten_first() {
    let limits = Limits { max_missions: 2, ..Limits::default() };
    let mut first = Vehicle::kept("v", limits);
    let mut journals = Vec::new();
    for id in ["b", "a", "c"] {
        first.configure(config(id), 1).expect("a new id");
        journals.push(unwritten(&mut first));
    }
    let mut vehicle = Vehicle::kept("v", limits);
    for (ordinal, id) in ["b", "a", "c"].into_iter().enumerate() {
        vehicle.set_absent(id, ordinal as u64, Absence::Reading);
    }
    for (id, records) in ["b", "a", "c"].into_iter().zip(&mut journals).rev() {
        // Without the record that the successor added, as after a crash between the two files.
        records.retain(|record| record.kind == Kind::Configured);
        let last = records.pop().expect("one record");
        let (journal, _) = journal(&[vec![last]]);
        let recovered = recover(&journal, limits).expect("a whole journal").mission;
        let mission = vehicle.take_up(recovered, 5).expect("it can be noted");
        assert_eq!(mission.id(), id);
        assert_eq!(mission.phase(), if id == "c" { Phase::Configured } else { Phase::Aborted });
    }
    vehicle.configure(config("d"), 6).expect("a new id");
    assert_eq!(vehicle.mission_ids().collect::<Vec<_>>(), ["c", "d"]);
    assert_eq!(vehicle.configure(config("b"), 6).expect_err("it was used").code(), Code::RepeatedId);
}

#[test]
fn a_journal_that_cannot_be_read_is_told_and_stands_in_nobodys_way() {
    let mut vehicle = Vehicle::kept("v", Limits::default());
    let error = JournalError::Damaged { record: Some(4), what: "for the test".to_owned() };
    vehicle.set_absent("m", 3, Absence::Unreadable { file: "/state/v/m.redb".to_owned(), error });
    let refusal = vehicle.mission(None).map(drop).expect_err("it is not served");
    assert_eq!(refusal.code(), Code::JournalDamaged);
    for words in ["\"m\"", "/state/v/m.redb", "record 4", "for the test", "pdnd recover"] {
        assert!(refusal.to_string().contains(words), "{refusal}");
    }
    let again = vehicle.configure(config("m"), 1).expect_err("the id is spent");
    assert_eq!(again.to_string(), refusal.to_string());
    assert_eq!(vehicle.configure(config("n"), 1).expect("another id").ordinal(), 4);
}

#[test]
fn every_decision_comes_out_again_and_another_allowance_turns_some() {
    let lived = journaled(7, 20);
    let (journal, _) = journal(&lived.groups);
    for threads in [1, 3] {
        let mut heard = 0;
        let report =
            replay(&journal, Limits::default(), &pool(threads), WhatIf::default(), &mut |done| heard = done);
        let report = report.expect("a whole journal");
        assert_eq!((report.decisions.len(), heard), (lived.decisions.len(), journal.len()));
        assert_eq!(
            (report.differing().count(), report.turned().count(), report.refusal_differs),
            (0, 0, None)
        );
        for (replayed, told) in report.decisions.iter().zip(&lived.decisions) {
            assert_eq!(replayed.verdict, Verdict::Same);
            assert_eq!((replayed.recorded.timing, replayed.recorded.decision), (told.timing, told.decision));
            assert!(replayed.recorded.link_model.is_some());
        }
    }
    let strict = WhatIf { sigma_xy_m: Some(1e-3), sigma_depth_m: Some(1e-3), ..WhatIf::default() };
    let report = replay(&journal, Limits::default(), &pool(1), strict, &mut |_| {}).expect("a whole journal");
    assert!(report.turned().count() > 0, "a strict allowance makes some decision turn back");
    for (replayed, assumed) in report.turned() {
        assert_eq!((place(&replayed.recorded), assumed.allowable.x_m), (None, 1e-3));
        assert!(place(assumed).is_some() && assumed.exploration.uncertainty > 1.0);
    }
}

#[test]
fn a_decision_that_was_not_taken_so_is_found_with_its_first_difference() {
    let lived = journaled(30, 20);
    let mut groups = lived.groups.clone();
    let mut changed = 0;
    for record in groups.iter_mut().flatten().filter(|record| record.kind == Kind::Decided) {
        let Ok(Entry::Decided(mut taken)) = Entry::read(record) else { panic!("it is a decision") };
        let covariance = &mut taken.decision.exploration.covariance.0[7];
        *covariance = f64::from_bits(covariance.to_bits() ^ 1); // the last bit of one number
        *record = Entry::Decided(taken).record().expect("it was one before");
        changed += 1;
    }
    let (journal, _) = journal(&groups);
    let report =
        replay(&journal, Limits::default(), &pool(1), WhatIf::default(), &mut |_| {}).expect("whole");
    assert_eq!(report.differing().count(), changed);
    for replayed in report.differing() {
        let Verdict::Differs(difference) = &replayed.verdict else { panic!("{:?}", replayed.verdict) };
        assert_eq!(difference.field, "exploration.covariance[7]");
        assert_ne!(difference.recorded, difference.computed);
    }
}

#[test]
fn a_history_that_cannot_have_been_is_damage_at_its_record() {
    let lived = journaled(30, 20);
    let records = lived.records();
    let event = records.iter().position(|record| record.kind == Kind::Factor).expect("there are factors");
    let without = |index: usize| [&records[..index], &records[index + 1..]].concat();
    let twice = |index: usize| [&records[..=index], &records[index..]].concat();
    let decided =
        records.iter().position(|record| record.kind == Kind::Decided).expect("there are decisions");
    for (what, history, at) in [
        ("an event is missing", without(event), event),
        ("an event comes twice", twice(event), event + 1),
        ("no configuration", records[1..].to_vec(), 0),
        ("a start without a mission that waits for it", twice(1), 2),
        ("a decision comes twice", twice(decided), decided + 1),
        ("a configuration in its midst", [&records[..event], &records[..]].concat(), event),
    ] {
        let (journal, _) = journal(&[history]);
        let error = recover(&journal, Limits::default()).map(drop).expect_err(what);
        let JournalError::Damaged { record, .. } = &error else { panic!("{what}: {error}") };
        assert_eq!(*record, Some(at as u64), "{what}: {error}");
    }
}

#[test]
fn a_mission_keeps_the_bounds_that_it_was_configured_in() {
    let (mut vehicle, mut records) = begun();
    for event in script("m").events {
        vehicle.offer(event, SENT_BYTES);
    }
    records.extend(unwritten(&mut vehicle));
    let (journal, _) = journal(&[records]);
    let tight = Limits { max_keyframes: 3, max_facets: 0, max_events: 5, ..Limits::default() };
    let mut recovered = recover(&journal, tight).expect("its own bounds count").mission;
    assert_eq!((recovered.state().keyframes, recovered.next_seq()), (24, script("m").seq()));
}

#[test]
fn nobody_keeps_a_history_unless_asked() {
    let mut vehicle = support::running();
    script("m").offer_all(&mut vehicle);
    assert_eq!(vehicle.take_unwritten(), vec![]);
    let status = mission(&mut vehicle).ingest_status();
    assert_eq!(status.durable_seq, status.next_seq);
    assert!(!bits(mission(&mut vehicle), &pool(1)).is_empty());
}
