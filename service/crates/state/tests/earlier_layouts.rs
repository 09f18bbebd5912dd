//! Journals that earlier layouts wrote: taken up, continued, replayed and salvaged as any other; layouts that
//! nobody knows are refused. The journal of `data/` has those of the first generation.

mod support;

use pdn_schemas::codec::history::Generation;
use pdn_schemas::record::{Kind, Reopened};
use pdn_schemas::registry::kind_layout_hash;
use pdn_schemas::reply::Phase;
use pdn_state::journal::Header;
use pdn_state::journal::salvage::Salvage;
use pdn_state::recovery::{recover, recover_from};
use pdn_state::replay::{Verdict, replay};
use pdn_state::{Absence, Entry, Journal, JournalError, Limits, Operation, Vehicle, WhatIf};
use redb::{Builder, ReadableDatabase, ReadableTable, TableDefinition};
use support::history::unwritten;
use support::storage::Disk;
use support::{SENT_BYTES, pool};

const JOURNAL: &[u8] = include_bytes!("data/mission.redb");
const HEADER: TableDefinition<&str, &str> = TableDefinition::new("header");
const LAYOUTS: TableDefinition<&str, u64> = TableDefinition::new("layouts");
const RECORDS: TableDefinition<u64, &[u8]> = TableDefinition::new("records");

/// Where a frame says by which layouts it was written.
const LAYOUTS_AT: std::ops::Range<usize> = 32..36;

/// The tables of a journal, taken apart.
#[derive(Clone)]
struct Tables {
    header: Vec<(String, String)>,
    layouts: Vec<(String, u64)>,
    frames: Vec<Vec<u8>>,
}

fn earlier() -> Tables {
    tables(&Disk::steady(JOURNAL.to_vec()))
}

fn tables(disk: &Disk) -> Tables {
    let file = Builder::new().create_with_backend(disk.clone()).expect("a file of redb");
    let read = file.begin_read().expect("readable");
    let header = read.open_table(HEADER).expect("there");
    let layouts = read.open_table(LAYOUTS).expect("there");
    let records = read.open_table(RECORDS).expect("there");
    Tables {
        header: header
            .iter()
            .unwrap()
            .map(Result::unwrap)
            .map(|(k, v)| (k.value().into(), v.value().into()))
            .collect(),
        layouts: layouts
            .iter()
            .unwrap()
            .map(Result::unwrap)
            .map(|(k, v)| (k.value().into(), v.value()))
            .collect(),
        frames: records.iter().unwrap().map(Result::unwrap).map(|(_, v)| v.value().to_vec()).collect(),
    }
}

impl Tables {
    /// A new file of these tables.
    fn disk(&self) -> Disk {
        let disk = Disk::steady(Vec::new());
        let file = Builder::new().create_with_backend(disk.clone()).expect("room");
        let write = file.begin_write().expect("room");
        {
            let mut header = write.open_table(HEADER).unwrap();
            self.header.iter().for_each(|(k, v)| drop(header.insert(k.as_str(), v.as_str()).unwrap()));
            let mut layouts = write.open_table(LAYOUTS).unwrap();
            self.layouts.iter().for_each(|(k, v)| drop(layouts.insert(k.as_str(), v).unwrap()));
            let mut records = write.open_table(RECORDS).unwrap();
            for (number, frame) in (0_u64..).zip(&self.frames) {
                records.insert(number, frame.as_slice()).unwrap();
            }
        }
        write.commit().expect("room");
        drop(file);
        disk
    }

    /// Its first records.
    fn cut(&self, frames: usize) -> Tables {
        Tables { frames: self.frames[..frames].to_vec(), ..self.clone() }
    }
}

/// A frame with other bytes in one place, whole again.
fn changed(frame: &[u8], at: std::ops::Range<usize>, bytes: &[u8]) -> Vec<u8> {
    let mut changed = frame[..frame.len() - 4].to_vec();
    changed[at].copy_from_slice(bytes);
    let crc = crc32fast::hash(&changed);
    changed.extend(crc.to_le_bytes());
    changed
}

fn open(disk: &Disk) -> Journal {
    Journal::open(disk.clone()).expect("a journal of an earlier version")
}

/// The mission taken up as a daemon would.
fn taken_up(journal: &Journal) -> Vehicle {
    let recovered = recover(journal, Limits::default()).expect("a whole journal");
    assert_eq!(recovered.differs, None);
    let mut vehicle = Vehicle::kept(&recovered.vehicle, Limits::default());
    vehicle.set_absent("mission", 0, Absence::Reading);
    vehicle.take_up(recovered.mission, 77).expect("it can be noted");
    vehicle
}

fn state(journal: &Journal) -> pdn_schemas::MissionState {
    recover(journal, Limits::default()).expect("a whole journal").mission.state()
}

#[test]
fn the_fixture_is_of_an_earlier_generation() {
    let (earliest, configured) = (&Generation::all()[0], Kind::Configured);
    let found = earlier().layouts.iter().find(|(name, _)| name == configured.schema()).map(|(_, hash)| *hash);
    assert_eq!(found, earliest.hash(configured.schema()));
    assert_ne!(found, Some(kind_layout_hash(configured)));
}

/// At whatever record the daemon of before ended, the one of now goes on, and the journal of both is one.
#[test]
fn it_is_taken_up_continued_closed_and_opened_again() {
    let all = earlier();
    let events: Vec<Entry> = {
        let journal = open(&all.disk());
        let records = journal.records().expect("whole").map(|read| read.expect("whole").1);
        records.map(|record| Entry::read(&record).expect("a record")).collect()
    };
    let layouts = all.frames[0][LAYOUTS_AT].to_vec();
    for cut in [1, 2, 40, 200, 400] {
        let disk = all.cut(cut).disk();
        let mut journal = open(&disk);
        assert_eq!((journal.len(), journal.taken_over()), (cut as u64, 0));
        let mut vehicle = taken_up(&journal);
        if vehicle.mission(None).expect("taken up").phase() != Phase::Running {
            let operation = if cut < 3 { Operation::Start } else { Operation::Resume };
            let _ = vehicle.command(None, operation, "on with it", 78);
        }
        let mut taken = 0;
        for entry in &events[cut..] {
            let Entry::Event(event) = entry else { continue };
            taken += u64::from(!vehicle.offer(event.clone(), SENT_BYTES).repeat);
        }
        assert!(taken > 10, "{taken} events after {cut}");
        journal.append(&unwritten(&mut vehicle)).expect("room");
        let lived = vehicle.mission(None).expect("taken up").state();
        drop(journal);

        let journal = open(&disk);
        let mut again = state(&journal);
        assert_eq!((again.next_seq, again.keyframes), (lived.next_seq, 64), "{cut}");
        assert_eq!(again.config.planner.max_cluster_radius_m, Some(f64::MAX));
        again.health.clone_from(&lived.health);
        assert_eq!(again, lived);
        let report = replay(&journal, Limits::default(), &pool(1), WhatIf::default(), &mut |_| ());
        assert!(report.expect("whole").decisions.iter().all(|replayed| replayed.verdict == Verdict::Same));
        drop(journal);
        // The old frames stay as they were, the new ones have the present layouts.
        let frames = tables(&disk).frames;
        assert!(frames[..cut] == all.frames[..cut]);
        let present: Vec<&[u8]> = frames[cut..].iter().map(|frame| &frame[LAYOUTS_AT]).collect();
        assert!(present.windows(2).all(|pair| pair[0] == pair[1]) && present[0] != layouts);
    }
}

/// What a crash of the earlier daemon left written but not committed is taken over.
#[test]
fn uncommitted_frames_of_an_earlier_version_are_taken_over() {
    let all = earlier();
    let (whole, before) = (all.frames.len(), all.cut(all.frames.len() - 3).disk().seen());
    let write = |disk: Disk| -> Result<(), redb::Error> {
        let file = Builder::new().create_with_backend(disk)?;
        let write = file.begin_write()?;
        {
            let mut records = write.open_table(RECORDS)?;
            for number in whole - 3..whole {
                records.insert(number as u64, all.frames[number].as_slice())?;
            }
        }
        Ok(write.commit()?)
    };
    let records = |journal: &Journal| -> Vec<_> {
        journal.records().expect("whole").map(|read| read.expect("whole").1).collect()
    };
    let expected = records(&open(&all.disk()));
    let mut taken_over = Vec::new();
    for power_off_at in 0..40 {
        let disk = Disk::new(before.clone(), power_off_at);
        let _ = write(disk.clone()); // the power is lost
        let journal = open(&Disk::steady(disk.left(1)));
        assert!(records(&journal) == expected[..journal.len() as usize], "off at {power_off_at}");
        taken_over.push(journal.taken_over());
    }
    assert!(taken_over.contains(&3), "{taken_over:?}");
}

#[test]
fn what_is_whole_of_a_damaged_one_is_saved_in_the_present_layouts() {
    let mut bytes = JOURNAL.to_vec();
    bytes[..4096].fill(0); // redb's own header
    let damaged = Disk::steady(bytes);
    assert!(Journal::open(damaged.clone()).is_err());
    let salvage = Salvage::find(&damaged).expect("records are left");
    assert_eq!(salvage.records as usize, earlier().frames.len());
    let saved = Disk::steady(Vec::new());
    let header = Header::new(9, &salvage.vehicle, &salvage.mission);
    let first = salvage.first(&damaged).expect("readable");
    let mut journal = Journal::create(saved.clone(), header, &[first]).expect("room");
    salvage.write(&damaged, &mut journal).expect("room");
    drop(journal);
    assert_eq!(state(&open(&saved)), state(&open(&earlier().disk())));
    assert_eq!(
        tables(&saved).layouts.iter().find(|(name, _)| name == "Configured").map(|(_, hash)| *hash),
        Some(kind_layout_hash(Kind::Configured))
    );
}

#[test]
fn layouts_that_nobody_knows_are_refused_and_named() {
    let mut tables = earlier();
    let configured = tables.layouts.iter_mut().find(|(name, _)| name == "Configured").expect("there");
    configured.1 ^= 1;
    let found = configured.1;
    match Journal::open(tables.disk()) {
        Err(JournalError::Layout { schema, found: told, software, .. }) => {
            assert_eq!((schema.as_str(), told, software.as_str()), ("Configured", found, "pdnd 0.1.0"));
        }
        other => panic!("{other:?}"),
    }
    // Layouts of two generations, mixed: no version has ever written these.
    let mut mixed = earlier();
    for (name, hash) in &mut mixed.layouts {
        if name == "Problem" {
            *hash = 7;
        }
    }
    assert!(matches!(Journal::open(mixed.disk()), Err(JournalError::Layout { .. })));
}

#[test]
fn a_frame_of_unknown_layouts_or_that_is_none_of_its_own_is_refused_at_its_record() {
    let with_last = |at: std::ops::Range<usize>, bytes: &[u8]| {
        let mut tables = earlier().cut(1);
        tables.frames[0] = changed(&tables.frames[0], at, bytes);
        tables.disk()
    };
    let refused = |disk: Disk| {
        let journal = Journal::open(disk)?;
        recover(&journal, Limits::default()).map(drop)
    };
    let unknown = refused(with_last(LAYOUTS_AT, &[1, 2, 3, 4])).expect_err("nobody knows these");
    assert!(matches!(&unknown, JournalError::Layout { found: 0x0403_0201, .. }), "{unknown}");
    assert!(unknown.to_string().contains("04030201"), "{unknown}");
    let kind = refused(with_last(24..28, &99_u32.to_le_bytes())).expect_err("there is no such kind");
    assert!(matches!(&kind, JournalError::Damaged { record: Some(0), .. }), "{kind}");
    // A length of a text that lies.
    let body = refused(with_last(40..48, &u64::MAX.to_le_bytes())).expect_err("no payload of then");
    assert!(matches!(&body, JournalError::Damaged { record: Some(0), .. }), "{body}");
    assert!(body.to_string().contains("as an earlier version wrote it"), "{body}");
}

/// Frames of both generations in one journal, in any order that openings can bring.
#[test]
fn whatever_kind_is_appended_the_next_opening_reads_it() {
    let disk = earlier().disk();
    for opening in 0..3 {
        let mut journal = open(&disk);
        let entry = Entry::Reopened(Reopened { at_ns: opening, software: "a test".into() });
        journal.append(&[entry.record().expect("small")]).expect("room");
    }
    let journal = open(&disk);
    assert_eq!(journal.len() as usize, earlier().frames.len() + 3);
    assert_eq!(state(&journal).next_seq, 451);
}

/// What an earlier version had solved for is not relied on.
#[test]
fn a_checkpoint_of_other_layouts_is_passed_over() {
    let disk = earlier().cut(300).disk();
    let journal = open(&disk);
    let checkpoint = taken_up(&journal).mission(None).expect("taken up").checkpoint().expect("a group");
    let bytes = checkpoint.to_bytes(&journal).expect("readable");
    let used = recover_from(&journal, Some(&bytes), Limits::default()).expect("whole");
    assert_eq!(used.passed_over, None);
    let place = bytes.windows(13).position(|part| part == b"with layouts ").expect("it says which") + 13;
    let digit = if bytes[place] == b'0' { b'1' } else { b'0' };
    let mut other = [&bytes[..place], &[digit], &bytes[place + 1..bytes.len() - 4]].concat();
    other.extend(crc32fast::hash(&other).to_le_bytes());
    let passed = recover_from(&journal, Some(&other), Limits::default()).expect("whole");
    let why = passed.passed_over.expect("passed over").to_string();
    assert!(why.contains("pdnd 0.1.0 with layouts"), "{why}");
}
