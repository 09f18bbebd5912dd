//! What crashes, damage and disks do to a journal: what was acknowledged is there, and what is there is true,
//! or the damage has a name.
//!
//! `PDN_TORTURE=1` tries every place instead of some.

mod support;

use pdn_state::journal::salvage::Salvage;
use pdn_state::journal::{Header, MAX_GROUP_RECORDS};
use pdn_state::{Journal, JournalError, Record};
use redb::StorageBackend;
use support::history::journaled;
use support::storage::{Disk, Draw};

/// Whether to try everything.
fn torture() -> bool {
    std::env::var_os("PDN_TORTURE").is_some()
}

fn header() -> Header {
    Header::new(0x1234_5678_9abc_def0, "v", "m")
}

/// Writes the groups until the power is off; gives what was acknowledged.
fn write(disk: &Disk, groups: &[Vec<Record>]) -> u64 {
    let Ok(mut journal) = Journal::create(disk.clone(), header(), &groups[0]) else { return 0 };
    go_on(&mut journal, groups)
}

/// Adds what is not in the journal yet, group by group.
fn go_on(journal: &mut Journal, groups: &[Vec<Record>]) -> u64 {
    let mut first = 0;
    for group in groups {
        let begin = (journal.len() as usize).saturating_sub(first).min(group.len());
        if begin < group.len() && journal.append(&group[begin..]).is_err() {
            break;
        }
        first += group.len();
    }
    journal.len()
}

fn read(journal: &Journal) -> Result<Vec<Record>, JournalError> {
    journal.records()?.map(|read| read.map(|(_, record)| record)).collect()
}

/// Opens what is left and demands that it is the beginning of the history and has all that was acknowledged.
fn demand(left: Vec<u8>, history: &[Record], acknowledged: u64, what: &str) -> u64 {
    let journal = Journal::open(Disk::steady(left)).unwrap_or_else(|error| panic!("{what}: {error}"));
    let records = read(&journal).unwrap_or_else(|error| panic!("{what}: {error}"));
    assert!(records.len() as u64 >= acknowledged, "{what}: {} of {acknowledged}", records.len());
    assert!(records == history[..records.len()], "{what}: another history");
    records.len() as u64
}

#[test]
fn a_crash_at_any_write_or_sync_loses_nothing_acknowledged() {
    let lived = journaled(13, 9);
    let history = lived.records();
    let whole = Disk::steady(Vec::new());
    assert_eq!(write(&whole, &lived.groups), history.len() as u64);
    let every = if torture() { 1 } else { 5 };
    let lucks = if torture() { 12 } else { 4 };
    let (mut crashes, mut taken_over) = (0_u64, 0_u64);
    for power_off_at in (0..whole.steps()).step_by(every) {
        let disk = Disk::new(Vec::new(), power_off_at);
        let acknowledged = write(&disk, &lived.groups);
        // A journal that was never made whole has no name, so nobody opens it.
        for luck in (0..lucks).filter(|_| acknowledged > 0) {
            let what = format!("power off at step {power_off_at}, luck {luck}");
            let found = demand(disk.left(luck), &history, acknowledged, &what);
            (crashes, taken_over) = (crashes + 1, taken_over + found - acknowledged);
        }
    }
    assert!(taken_over > 0, "some of what was written but not acknowledged is whole and kept");
    println!("crashes at {} steps: {crashes} tried, {taken_over} unacknowledged records kept", whole.steps());
}

#[test]
fn a_crash_while_a_crash_is_repaired_loses_nothing_either() {
    let lived = journaled(13, 9);
    let history = lived.records();
    let steps = {
        let whole = Disk::steady(Vec::new());
        write(&whole, &lived.groups);
        whole.steps()
    };
    let every = if torture() { 7 } else { 61 };
    let mut crashes = 0;
    for power_off_at in (40..steps).step_by(every) {
        let first = Disk::new(Vec::new(), power_off_at);
        let acknowledged = write(&first, &lived.groups);
        for luck in 0..3 {
            let left = first.left(luck);
            for second_power_off_at in (0..60).step_by(if torture() { 1 } else { 4 }) {
                let second = Disk::new(left.clone(), second_power_off_at);
                let acknowledged = match Journal::open(second.clone()) {
                    Ok(mut journal) => go_on(&mut journal, &lived.groups),
                    Err(JournalError::Disk { .. }) => acknowledged,
                    Err(error) => panic!("{power_off_at} {luck} {second_power_off_at}: {error}"),
                };
                let what = format!("power off at {power_off_at}, then at {second_power_off_at}, luck {luck}");
                demand(second.left(luck + 1), &history, acknowledged, &what);
                crashes += 1;
            }
        }
    }
    println!("{crashes} double crashes tried");
}

/// A journal as a clean end leaves it, and as a crash after its last acknowledgement does.
fn images(groups: &[Vec<Record>]) -> [(&'static str, Vec<u8>); 2] {
    let disk = Disk::steady(Vec::new());
    let mut journal = Journal::create(disk.clone(), header(), &groups[0]).expect("room");
    go_on(&mut journal, groups);
    let crashed = disk.left(0);
    drop(journal);
    [("closed", disk.seen()), ("crashed", crashed)]
}

/// The whole history, or a damage with a name: nothing between, since all of it was acknowledged. What can be
/// saved is true in any case.
fn judge(image: Vec<u8>, history: &[Record], what: &str) -> bool {
    let disk = Disk::steady(image);
    if let Ok(salvage) = Salvage::find(&disk) {
        let mut saved = Journal::create(Disk::steady(Vec::new()), header(), &history[..1]).expect("room");
        salvage.write(&disk, &mut saved).unwrap_or_else(|error| panic!("{what}: {error}"));
        let records = read(&saved).unwrap_or_else(|error| panic!("{what}: {error}"));
        assert!(records == history[..records.len()], "{what}: another history was saved");
        assert_eq!(salvage.records, records.len() as u64);
    }
    match Journal::open(disk).and_then(|journal| read(&journal)) {
        Ok(records) => {
            assert_eq!(records.len(), history.len(), "{what}: acknowledged records are gone without a word");
            assert!(records == history, "{what}: another history");
            true
        }
        Err(error) => {
            let named = matches!(
                error,
                JournalError::Damaged { .. } | JournalError::Foreign { .. } | JournalError::Format { .. }
            );
            assert!(named, "{what}: {error:?}");
            false
        }
    }
}

#[test]
fn a_flipped_bit_is_harmless_or_has_a_name() {
    std::panic::set_hook(Box::new(|fault| {
        // The tables may stumble over damage, which is caught and told; what the test finds must be heard.
        if fault.location().is_some_and(|place| place.file().contains("crashes.rs")) {
            eprintln!("{fault}");
        }
    }));
    let lived = journaled(40, 30);
    let history = lived.records();
    for (end, image) in images(&lived.groups) {
        let bits = 8 * image.len() as u64;
        let sample = if torture() { 200_000 } else { 500 };
        let mut draw = Draw(5);
        // The root of everything is in the first 512 bytes.
        let header = (0..8 * 512).step_by(if torture() { 1 } else { 7 });
        let first_bytes = 8 * 9..8 * 10;
        let rest = (0..sample).map(|_| draw.below(bits));
        let (mut tried, mut harmless) = (0_u64, 0_u64);
        for bit in first_bytes.chain(header).chain(rest) {
            let mut flipped = image.clone();
            flipped[(bit / 8) as usize] ^= 1 << (bit % 8);
            harmless += u64::from(judge(flipped, &history, &format!("{end}, bit {bit}")));
            tried += 1;
        }
        assert!(harmless > 0 && harmless < tried, "{harmless} of {tried}");
        println!(
            "{end}: {tried} bits of {} bytes flipped, {harmless} harmless, the others named",
            image.len()
        );
    }
}

#[test]
fn a_file_cut_short_or_overwritten_is_harmless_or_has_a_name() {
    let lived = journaled(40, 30);
    let history = lived.records();
    for (end, image) in images(&lived.groups) {
        let every = if torture() { 97 } else { 4999 };
        for length in (0..image.len()).step_by(every).chain([1, 511, 512, 4095, 4096, image.len() - 1]) {
            judge(image[..length].to_vec(), &history, &format!("{end}, cut to {length} bytes"));
        }
        let mut draw = Draw(9);
        for _ in 0..if torture() { 3000 } else { 60 } {
            let (at, length) = (draw.below(image.len() as u64) as usize, 1 + draw.below(9000) as usize);
            let mut overwritten = image.clone();
            let to = (at + length).min(image.len());
            let garbage = draw.below(2) == 0;
            overwritten[at..to]
                .iter_mut()
                .for_each(|byte| *byte = if garbage { draw.below(256) as u8 } else { 0 });
            judge(overwritten, &history, &format!("{end}, {length} bytes at {at} overwritten"));
        }
        let longer = [&image[..], &[0xff; 10_000]].concat();
        judge(longer, &history, &format!("{end}, with 10 kB behind"));
    }
}

#[test]
fn what_is_whole_up_to_the_damage_can_be_saved() {
    let lived = journaled(40, 30);
    let history = lived.records();
    let [(_, image), _] = images(&lived.groups);
    // A record is found by its payload; every copy of it is damaged, and nothing else.
    for damaged in [1, history.len() / 2, history.len() - 1] {
        let payload = &history[damaged].payload;
        let mut broken = image.clone();
        for at in (0..image.len() - payload.len()).filter(|&at| image[at..].starts_with(payload)) {
            broken[at + payload.len() / 2] ^= 0x10;
        }
        let disk = Disk::steady(broken.clone());
        let salvage = Salvage::find(&disk).expect("its first record is whole");
        assert_eq!((salvage.records, salvage.vehicle.as_str()), (damaged as u64, "v"));
        assert_eq!(salvage.beyond, (history.len() - damaged - 1) as u64);
        let mut saved = Journal::create(Disk::steady(Vec::new()), header(), &history[..1]).expect("room");
        salvage.write(&disk, &mut saved).expect("room");
        assert!(read(&saved).expect("a new journal") == history[..damaged]);
        assert!(!judge(broken, &history, &format!("record {damaged} damaged")));
    }
    let lost_root = [&[0; 4096], &image[4096..]].concat();
    let salvage = Salvage::find(&Disk::steady(lost_root)).expect("every record is whole");
    assert_eq!(salvage.records, history.len() as u64);
}

#[test]
fn a_full_disk_is_told_and_room_mends_it() {
    let lived = journaled(13, 9);
    let history = lived.records();
    let needed = images(&lived.groups)[0].1.len() as u64;
    let mut full = 0;
    for capacity in (0..needed).step_by((needed / 40) as usize) {
        let disk = Disk::small(Vec::new(), capacity);
        let acknowledged = match Journal::create(disk.clone(), header(), &lived.groups[0]) {
            Ok(mut journal) => go_on(&mut journal, &lived.groups),
            Err(error) => {
                assert!(matches!(error, JournalError::Full { .. }), "{error:?}");
                continue;
            }
        };
        full += u64::from(acknowledged < history.len() as u64);
        disk.grow(u64::MAX);
        let mut journal = Journal::open(disk.clone()).expect("there is room");
        assert!(journal.len() >= acknowledged);
        assert!(read(&journal).expect("it is whole") == history[..journal.len() as usize]);
        assert_eq!(go_on(&mut journal, &lived.groups), history.len() as u64);
    }
    assert!(full > 10, "the disk was too small {full} times");
}

#[test]
fn another_format_or_layout_is_told_with_who_wrote_it() {
    let lived = journaled(40, 30);
    let [(_, image), _] = images(&lived.groups);
    let table = |name: &'static str| redb::TableDefinition::<&str, &str>::new(name);
    let changed = |change: &dyn Fn(&redb::WriteTransaction)| {
        let disk = Disk::steady(image.clone());
        let tables = redb::Builder::new().create_with_backend(disk.clone()).expect("its tables are whole");
        let group = tables.begin_write().expect("a disk");
        change(&group);
        group.commit().expect("a disk");
        drop(tables);
        Journal::open(disk).map(drop).expect_err("it is another's")
    };
    let format = changed(&|group| {
        let mut header = group.open_table(table("header")).expect("its header");
        header.insert("format", "2").expect("a disk");
        header.insert("software", "pdnd 9.0.0").expect("a disk");
    });
    assert!(matches!(&format, JournalError::Format { found, .. } if found == "2"), "{format:?}");
    assert!(format.to_string().contains("pdnd 9.0.0"), "{format}");
    let layout = changed(&|group| {
        let layouts = redb::TableDefinition::<&str, u64>::new("layouts");
        group.open_table(layouts).expect("its layouts").insert("Keyframe", 5).expect("a disk");
    });
    assert!(
        matches!(&layout, JournalError::Layout { schema, found: 5, .. } if schema == "Keyframe"),
        "{layout:?}"
    );
    let foreign = changed(&|group| assert!(group.delete_table(table("header")).expect("a disk")));
    assert!(matches!(&foreign, JournalError::Foreign { .. }), "{foreign:?}");
    let empty = Journal::open(Disk::steady(b"not a journal at all".repeat(500))).map(drop);
    assert!(matches!(empty, Err(JournalError::Foreign { .. })), "{empty:?}");
}

#[test]
fn a_group_may_be_as_large_as_its_bound() {
    let lived = journaled(usize::MAX, 1000);
    let record = lived.records().pop().expect("a record");
    let disk = Disk::steady(Vec::new());
    let mut journal = Journal::create(disk.clone(), header(), &lived.groups[0]).expect("room");
    journal.append(&vec![record; MAX_GROUP_RECORDS]).expect("room");
    assert_eq!(journal.len(), MAX_GROUP_RECORDS as u64 + lived.groups[0].len() as u64);
    let steps = disk.steps();
    drop(journal);
    // Opening writes little, whatever the size: the tables are checked, not copied.
    let journal = Journal::open(disk.clone()).expect("it is whole");
    assert!(disk.steps() - steps < 40 && disk.len().expect("a length") > 0, "{}", disk.steps() - steps);
    assert_eq!((journal.taken_over(), read(&journal).expect("whole").len() as u64), (0, journal.len()));
}
