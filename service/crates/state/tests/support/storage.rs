//! Storage that forgets what was not synced, and loses power at a chosen moment.

use redb::StorageBackend;
use std::io;
use std::sync::{Arc, Mutex};

/// A disk with a write cache. Clones are the same disk.
#[derive(Clone, Debug)]
pub struct Disk(Arc<Mutex<State>>);

#[derive(Debug)]
struct State {
    /// What a sync has brought to the platter.
    durable: Vec<u8>,
    /// What a reader sees.
    seen: Vec<u8>,
    /// What has been asked for since the last sync.
    unsynced: Vec<Change>,
    steps: u64,
    power_off_at: u64,
    capacity: u64,
}

#[derive(Clone, Debug)]
enum Change {
    Length(usize),
    Bytes(usize, Vec<u8>),
}

impl Disk {
    /// A disk with this content, which loses power at step `power_off_at`: that write or sync, counted from
    /// 0, and all later ones fail.
    pub fn new(content: Vec<u8>, power_off_at: u64) -> Disk {
        let seen = content.clone();
        let (unsynced, capacity) = (Vec::new(), u64::MAX);
        Disk(Arc::new(Mutex::new(State {
            durable: content,
            seen,
            unsynced,
            steps: 0,
            power_off_at,
            capacity,
        })))
    }

    /// A disk that never loses power.
    pub fn steady(content: Vec<u8>) -> Disk {
        Disk::new(content, u64::MAX)
    }

    /// A disk that has room for so many bytes.
    pub fn small(content: Vec<u8>, capacity: u64) -> Disk {
        let disk = Disk::steady(content);
        disk.with(|state| state.capacity = capacity);
        disk
    }

    /// Gives the disk more room.
    pub fn grow(&self, capacity: u64) {
        self.with(|state| state.capacity = capacity);
    }

    /// Writes and syncs so far.
    pub fn steps(&self) -> u64 {
        self.with(|state| state.steps)
    }

    /// What a reader sees while there is power.
    pub fn seen(&self) -> Vec<u8> {
        self.with(|state| state.seen.clone())
    }

    /// What is left after the power was lost. `luck` decides which of the changes that were not synced have
    /// reached the platter, in what order, and which of them only in part: 0 none, 1 all.
    pub fn left(&self, luck: u64) -> Vec<u8> {
        self.with(|state| {
            let mut content = state.durable.clone();
            let mut draw = Draw(luck);
            let mut survivors: Vec<Change> = match luck {
                0 => Vec::new(),
                1 => state.unsynced.clone(),
                _ => state.unsynced.iter().filter(|_| draw.below(2) == 0).cloned().collect(),
            };
            if luck > 1 {
                for change in &mut survivors {
                    if let (Change::Bytes(_, bytes), 0) = (change, draw.below(3)) {
                        bytes.truncate(draw.below(bytes.len() as u64 + 1) as usize); // a torn write
                    }
                }
            }
            survivors.into_iter().for_each(|change| change.apply(&mut content));
            content
        })
    }

    fn with<T>(&self, act: impl FnOnce(&mut State) -> T) -> T {
        act(&mut self.0.lock().expect("no panic within"))
    }

    fn step<T>(&self, act: impl FnOnce(&mut State) -> io::Result<T>) -> io::Result<T> {
        self.with(|state| {
            let powered = state.steps < state.power_off_at;
            state.steps += u64::from(powered);
            if powered { act(state) } else { Err(io::Error::other("the power is off")) }
        })
    }
}

impl Change {
    fn apply(self, content: &mut Vec<u8>) {
        match self {
            Change::Length(length) => content.resize(length, 0),
            Change::Bytes(offset, bytes) => {
                let end = offset + bytes.len();
                if content.len() < end {
                    content.resize(end, 0);
                }
                content[offset..end].copy_from_slice(&bytes);
            }
        }
    }
}

impl State {
    fn change(&mut self, change: Change) -> io::Result<()> {
        let end = match &change {
            Change::Length(length) => *length,
            Change::Bytes(offset, bytes) => offset + bytes.len(),
        };
        if end as u64 > self.capacity {
            return Err(io::ErrorKind::StorageFull.into());
        }
        change.clone().apply(&mut self.seen);
        self.unsynced.push(change);
        Ok(())
    }
}

impl StorageBackend for Disk {
    fn len(&self) -> io::Result<u64> {
        self.with(|state| Ok(state.seen.len() as u64))
    }

    fn read(&self, offset: u64, out: &mut [u8]) -> io::Result<()> {
        self.with(|state| {
            let offset = usize::try_from(offset).map_err(io::Error::other)?;
            let end = offset.checked_add(out.len()).filter(|end| *end <= state.seen.len());
            let end = end.ok_or(io::ErrorKind::UnexpectedEof)?;
            out.copy_from_slice(&state.seen[offset..end]);
            Ok(())
        })
    }

    fn set_len(&self, len: u64) -> io::Result<()> {
        self.step(|state| state.change(Change::Length(len as usize)))
    }

    fn sync_data(&self) -> io::Result<()> {
        self.step(|state| {
            state.durable.clone_from(&state.seen);
            state.unsynced.clear();
            Ok(())
        })
    }

    fn write(&self, offset: u64, data: &[u8]) -> io::Result<()> {
        self.step(|state| state.change(Change::Bytes(offset as usize, data.to_vec())))
    }
}

/// Numbers that are the same in every run.
pub struct Draw(pub u64);

impl Draw {
    pub fn below(&mut self, bound: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (mixed ^ (mixed >> 31)) % bound.max(1)
    }
}
