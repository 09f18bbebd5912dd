//! A mission that comes back from a checkpoint is the one that comes back from the whole journal, bit for
//! bit.

#![allow(clippy::disallowed_methods, reason = "the time of a restart is measured")]

mod support;

use pdn_schemas::event::FactorKind;
use pdn_schemas::problem::Code;
use pdn_state::checkpoint::{Checkpoint, Unusable};
use pdn_state::journal::Header;
use pdn_state::recovery::{Recovered, recover, recover_from};
use pdn_state::{Absence, Journal, Limits, Operation, Record, Vehicle};
use std::time::Instant;
use support::history::{begun, journaled, running_bits, unwritten};
use support::storage::Disk;
use support::{SENT_BYTES, Script, diagonal, level, mission, noise, place};

fn journal(records: &[Record]) -> Journal {
    Journal::create(Disk::steady(Vec::new()), Header::new(7, "v", "m"), records).expect("room")
}

/// A mission in which events are refused in every way that there is: at once, once what they waited for has
/// come, and with the group that cannot be solved for.
fn troubled() -> Script {
    let mut script = Script::new("m");
    for id in 0..24 {
        script.keyframe(id, (id == 0).then(|| level(place(0))));
        if id % 5 == 3 {
            script.camera(id, id + 1); // unknown yet: refused at once
            script.keyframe(id - 1, None); // repeated, and ends no group
            script.keyframe(100 + id, Some(level(place(id)))); // on the spot of `id`
            script.camera(id, 100 + id); // waits, and is too short once both are tied
            script.depth(100 + id);
        }
        if id % 7 == 4 {
            let covariance = diagonal([1e-30; 6]);
            let relative = level([0.5, 0.0, 0.0]);
            script.factor(FactorKind::Odometry { from: id - 1, to: id, relative, covariance }); // singular
        }
        if id > 0 {
            script.odometry(id - 1, id);
        }
        script.depth(id);
        if id % 5 == 4 {
            let covariance = support::odometry_covariance();
            let relative = level([0.0; 3]);
            // Ties it late.
            script.factor(FactorKind::Odometry { from: id - 1, to: 99 + id, relative, covariance });
        }
        script.attitude(id);
        script.link(id, id + 50, true); // of an unknown keyframe
        if id > 8 {
            script.link(id - 8, id, id % 2 == 0);
        }
    }
    script
}

/// The mission event by event: its records, and its checkpoints with the number of records when each was
/// taken.
fn lived(script: &Script) -> (Vec<Record>, Vec<(usize, Checkpoint)>, Vec<Code>) {
    let (mut vehicle, mut records) = begun();
    vehicle.command(None, Operation::Start, "", 2).expect("configured");
    records.extend(unwritten(&mut vehicle));
    let (mut checkpoints, mut refused) = (Vec::new(), Vec::new());
    for (index, event) in script.events.iter().enumerate() {
        refused.extend(
            vehicle.offer(event.clone(), SENT_BYTES).refused.iter().map(|refusal| refusal.error.code()),
        );
        records.extend(unwritten(&mut vehicle));
        if index % 5 == 4 {
            drop(mission(&mut vehicle).state()); // looks ahead
        }
        checkpoints.extend(mission(&mut vehicle).checkpoint().map(|checkpoint| (records.len(), checkpoint)));
    }
    (records, checkpoints, refused)
}

fn bits(recovered: Recovered) -> Vec<u8> {
    assert_eq!(recovered.differs, None);
    let mut vehicle = Vehicle::kept("v", Limits::default());
    vehicle.set_absent("m", 0, Absence::Reading);
    vehicle.take_up(recovered.mission, 77).expect("it can be noted");
    let mut bits = running_bits(&mut vehicle);
    bits.extend(mission(&mut vehicle).ingest_status().rejected.to_le_bytes());
    bits
}

#[test]
fn the_troubled_mission_has_every_trouble() {
    let (_, _, refused) = lived(&troubled());
    for code in [Code::UnknownKeyframe, Code::RepeatedId, Code::DegenerateBaseline, Code::Singular] {
        assert!(refused.contains(&code), "{code:?} in {refused:?}");
    }
}

#[test]
fn every_checkpoint_gives_the_mission_of_the_whole_journal() {
    for script in [support::script("m"), troubled()] {
        let (records, checkpoints, refused) = lived(&script);
        let whole = journal(&records);
        let recovered = recover(&whole, Limits::default()).expect("a whole journal");
        assert_eq!(recovered.mission.ingest_status().rejected, refused.len() as u64);
        let expected = bits(recovered);
        assert!(checkpoints.len() > 20);
        for (_, checkpoint) in checkpoints {
            let bytes = checkpoint.to_bytes(&whole).expect("it is in the journal");
            let recovered = recover_from(&whole, Some(&bytes), Limits::default()).expect("a whole journal");
            assert_eq!(recovered.passed_over, None);
            // The mission has the same checkpoints as the one that was lived.
            let again = recovered.mission.checkpoint().map(|checkpoint| checkpoint.to_bytes(&whole));
            assert!(again.is_some());
            assert!(bits(recovered) == expected, "from record {}", checkpoint.record);
        }
    }
}

#[test]
fn a_checkpoint_serves_a_journal_that_ends_with_it() {
    let (records, checkpoints, _) = lived(&troubled());
    for (length, checkpoint) in checkpoints {
        let cut = journal(&records[..length]);
        let bytes = checkpoint.to_bytes(&cut).expect("it is in the journal");
        let recovered = recover_from(&cut, Some(&bytes), Limits::default()).expect("a whole journal");
        assert_eq!((recovered.passed_over.clone(), recovered.mission.checkpoint()), (None, Some(checkpoint)));
        assert!(bits(recovered) == bits(recover(&cut, Limits::default()).expect("whole")));
    }
}

#[test]
fn a_checkpoint_that_is_of_no_use_is_passed_over_and_told() {
    let records = journaled(usize::MAX, 7).records();
    let (of_script, checkpoints, _) = lived(&support::script("m"));
    let (whole, other) = (journal(&of_script), journal(&records));
    let last = &checkpoints[checkpoints.len() - 1].1;
    let bytes = last.to_bytes(&whole).expect("it is in the journal");
    let from = |journal: &Journal, bytes: &[u8]| {
        let recovered = recover_from(journal, Some(bytes), Limits::default()).expect("a whole journal");
        let reason = recovered.passed_over.clone();
        assert!(bits(recovered) == bits(recover(journal, Limits::default()).expect("whole")));
        reason
    };
    assert_eq!(from(&other, &bytes), Some(Unusable::OtherJournal));
    for at in (0..bytes.len()).step_by(bytes.len() / 50) {
        let mut flipped = bytes.clone();
        flipped[at] ^= 1 << (at % 8);
        assert_eq!(from(&whole, &flipped), Some(Unusable::Damaged));
        assert_eq!(from(&whole, &bytes[..at]), Some(Unusable::Damaged));
    }
    // One of a later moment than the journal knows: its last records were lost.
    let shorter = journal(&of_script[..last.record as usize - 1]);
    assert_eq!(from(&shorter, &bytes), Some(Unusable::OtherJournal));
}

/// Lines of 40 m, 0.7 m apart, a keyframe each 0.5 m, with registrations across at the ends, where the
/// texture is.
fn survey(keyframes: u64) -> Script {
    const PER_LINE: u64 = 80;
    let place = |id: u64| {
        let (line, at) = (id / PER_LINE, id % PER_LINE);
        let at = if line % 2 == 0 { at } else { PER_LINE - 1 - at };
        [0.5 * at as f64, 0.7 * line as f64, 8.5]
    };
    let between = |from: u64, to: u64, sigma_m: f64| {
        let apart =
            |axis: usize| place(to)[axis] - place(from)[axis] + sigma_m * noise(10 * to + axis as u64);
        [apart(0), apart(1), apart(2)]
    };
    let mut script = Script::new("m");
    for id in 0..keyframes {
        script.keyframe(id, (id == 0).then(|| level(place(0))));
        if let Some(before) = id.checked_sub(1) {
            let (relative, covariance) = (level(between(before, id, 0.006)), support::odometry_covariance());
            script.factor(FactorKind::Odometry { from: before, to: id, relative, covariance });
        }
        script.depth(id);
        script.attitude(id);
        let line = id / PER_LINE;
        if line > 0 && id % PER_LINE % 20 < 8 {
            let across = 2 * line * PER_LINE - 1 - id; // beside it on the line before
            script.link(across, id, id % 3 != 0);
            if id % 3 != 0 {
                let [north, east, _] = between(across, id, 0.004);
                let mut covariance = [0.0; 25];
                for (axis, sigma_deg) in [1.0_f64, 1.0, 0.1, 0.1, 0.1].into_iter().enumerate() {
                    covariance[6 * axis] = sigma_deg.to_radians().powi(2);
                }
                let length_m = north.hypot(east);
                let direction = [east / length_m, -north / length_m, 0.0];
                let rotation = [0.0, 0.0, 0.0, 1.0];
                script.factor(FactorKind::Camera { from: across, to: id, direction, rotation, covariance });
            }
        }
    }
    script
}

/// A restart from the last checkpoint solves for no more than came after it, so it takes a small part of the time
/// in which the mission was lived: a 26th was measured with 1,500 keyframes, a 41st with the 20,000 of
/// `PDN_TORTURE`. The bounds are five times that, and load of the machine is on both sides; a restart without its
/// checkpoint takes as long as living.
#[test]
fn a_long_mission_restarts_in_a_small_part_of_its_time() {
    let (keyframes, part) = if std::env::var_os("PDN_TORTURE").is_some() { (20_000, 8) } else { (1_500, 5) };
    let script = survey(keyframes);
    let (mut vehicle, first) = begun();
    vehicle.command(None, Operation::Start, "", 2).expect("configured");
    let path = std::env::temp_dir().join(format!("pdn-restart-{}.journal", std::process::id()));
    let mut journal =
        pdn_state::journal::files::create_at(&path, Header::new(7, "v", "m"), &first).expect("room");
    let start = Instant::now();
    // A daemon's last checkpoint is up to a 256th of the records old.
    let old = script.events.len() / 256;
    let (before, after) = script.events.split_at(script.events.len() - old);
    for events in before.chunks(512) {
        let refused: Vec<_> =
            events.iter().flat_map(|event| vehicle.offer(event.clone(), SENT_BYTES).refused).collect();
        assert_eq!(refused, []);
        journal.append(&unwritten(&mut vehicle)).expect("room");
    }
    let lived = start.elapsed();
    let checkpoint = mission(&mut vehicle).checkpoint().expect("a group is open");
    let bytes = checkpoint.to_bytes(&journal).expect("it is in the journal");
    after.iter().for_each(|event| assert_eq!(vehicle.offer(event.clone(), SENT_BYTES).refused, []));
    journal.append(&unwritten(&mut vehicle)).expect("room");
    let last = mission(&mut vehicle).checkpoint().expect("a group is open");
    drop(journal);

    let start = Instant::now();
    let journal = pdn_state::journal::files::open(&path).expect("a whole journal");
    let recovered = recover_from(&journal, Some(&bytes), Limits::default()).expect("a whole journal");
    let restarted = start.elapsed();
    std::fs::remove_file(&path).expect("it was made");
    assert_eq!((recovered.differs, recovered.passed_over), (None, None));
    assert_eq!(recovered.mission.checkpoint(), Some(last));
    assert!(restarted * part < lived, "restarted in {restarted:?} what was lived in {lived:?}");
}
