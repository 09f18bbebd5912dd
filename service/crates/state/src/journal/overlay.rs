//! Storage that is looked at and never changed: what would be written to it stays in memory.
//!
//! The tables of a journal that was left by a crash are put in order when they are opened. Whoever only
//! reads, perhaps from a disk that is evidence, must leave no trace; and whoever goes on looks first.

use redb::StorageBackend;
use std::collections::BTreeMap;
use std::io;
use std::sync::{Arc, Mutex, PoisonError};

const BLOCK_BYTES: u64 = 4096;

/// A view of other storage.
#[derive(Debug)]
pub(crate) struct Overlay {
    below: Arc<dyn StorageBackend>,
    changes: Mutex<Changes>,
}

#[derive(Debug)]
struct Changes {
    /// Length of the view, and how much of it is what lies below.
    len: u64,
    from_below: u64,
    blocks: BTreeMap<u64, Vec<u8>>,
}

impl Overlay {
    /// A view of the storage as it is.
    pub(crate) fn new(below: Arc<dyn StorageBackend>) -> io::Result<Overlay> {
        let len = below.len()?;
        let changes = Changes { len, from_below: len, blocks: BTreeMap::new() };
        Ok(Overlay { below, changes: Mutex::new(changes) })
    }

    fn with<T>(&self, act: impl FnOnce(&dyn StorageBackend, &mut Changes) -> io::Result<T>) -> io::Result<T> {
        act(self.below.as_ref(), &mut self.changes.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl StorageBackend for Overlay {
    fn len(&self) -> io::Result<u64> {
        self.with(|_, changes| Ok(changes.len))
    }

    fn read(&self, offset: u64, out: &mut [u8]) -> io::Result<()> {
        self.with(|below, changes| {
            if offset + out.len() as u64 > changes.len {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            out.fill(0);
            let whole = changes.from_below.saturating_sub(offset).min(out.len() as u64);
            if whole > 0 {
                below.read(offset, &mut out[..whole as usize])?;
            }
            for (&block, bytes) in changes.blocks.range(offset / BLOCK_BYTES..) {
                let begin = block * BLOCK_BYTES;
                if begin >= offset + out.len() as u64 {
                    break;
                }
                let (from, to) = (begin.max(offset), (begin + BLOCK_BYTES).min(offset + out.len() as u64));
                out[(from - offset) as usize..(to - offset) as usize]
                    .copy_from_slice(&bytes[(from - begin) as usize..(to - begin) as usize]);
            }
            Ok(())
        })
    }

    fn set_len(&self, len: u64) -> io::Result<()> {
        self.with(|_, changes| {
            if len < changes.len {
                changes.from_below = changes.from_below.min(len);
                changes.blocks.split_off(&len.div_ceil(BLOCK_BYTES));
                if let Some(last) = changes.blocks.get_mut(&(len / BLOCK_BYTES)) {
                    last[(len % BLOCK_BYTES) as usize..].fill(0);
                }
            }
            changes.len = len;
            Ok(())
        })
    }

    fn sync_data(&self) -> io::Result<()> {
        Ok(())
    }

    fn write(&self, offset: u64, data: &[u8]) -> io::Result<()> {
        self.with(|below, changes| {
            let mut offset = offset;
            let mut data = data;
            while !data.is_empty() {
                let (block, within) = (offset / BLOCK_BYTES, (offset % BLOCK_BYTES) as usize);
                let length = data.len().min(BLOCK_BYTES as usize - within);
                if !changes.blocks.contains_key(&block) {
                    let bytes = original(below, changes.from_below, block)?;
                    changes.blocks.insert(block, bytes);
                }
                let bytes = changes.blocks.entry(block).or_default();
                bytes[within..within + length].copy_from_slice(&data[..length]);
                (offset, data) = (offset + length as u64, &data[length..]);
                changes.len = changes.len.max(offset);
            }
            Ok(())
        })
    }
}

fn original(below: &dyn StorageBackend, from_below: u64, block: u64) -> io::Result<Vec<u8>> {
    let begin = block * BLOCK_BYTES;
    let mut bytes = vec![0; BLOCK_BYTES as usize];
    let whole = from_below.saturating_sub(begin).min(BLOCK_BYTES) as usize;
    if whole > 0 {
        below.read(begin, &mut bytes[..whole])?;
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use redb::backends::InMemoryBackend;

    proptest! {
        #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

        /// Whatever is done, the view is as memory with the same content would be, and what lies below as it
        /// was.
        #[test]
        fn a_view_is_like_memory_and_leaves_what_is_below(
            length in 0_usize..12_000,
            steps in prop::collection::vec((0_u8..3, 0_u64..20_000, 1_usize..9_000), 1..20),
        ) {
            let content: Vec<u8> = (0..length).map(|index| (index % 251) as u8).collect();
            let [below, memory] = [(), ()].map(|()| {
                let memory = InMemoryBackend::new();
                memory.set_len(length as u64).expect("memory grows");
                memory.write(0, &content).expect("memory is written");
                memory
            });
            let below = Arc::new(below);
            let view = Overlay::new(below.clone()).expect("a length");
            for (step, (kind, offset, size)) in steps.into_iter().enumerate() {
                let bytes = vec![step as u8 + 1; size];
                for storage in [&view as &dyn StorageBackend, &memory] {
                    match kind {
                        0 => storage.set_len(offset).expect("a length"),
                        _ => {
                            let needed = (offset + size as u64).max(storage.len().expect("a length"));
                            storage.set_len(needed).expect("a length");
                            storage.write(offset, &bytes).expect("room");
                        }
                    }
                }
                let len = memory.len().expect("a length");
                prop_assert_eq!(view.len().expect("a length"), len);
                let (mut seen, mut expected) = (vec![0; len as usize], vec![0; len as usize]);
                view.read(0, &mut seen).expect("whole");
                memory.read(0, &mut expected).expect("whole");
                prop_assert!(seen == expected);
            }
            let mut left = vec![0; length];
            below.read(0, &mut left).expect("whole");
            prop_assert!(left == content && below.len().expect("a length") == length as u64);
        }
    }
}
