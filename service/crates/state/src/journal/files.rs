//! Which file is whose: `<root>/<vehicle>/<ordinal>-<mission>.redb`, each made whole under another name
//! first.

use crate::history::Record;
use crate::journal::error::JournalError;
use crate::journal::overlay::Overlay;
use crate::journal::salvage::Salvage;
use crate::journal::{Header, Journal};
use pdn_schemas::ids::{MissionId, VehicleId};
use redb::StorageBackend;
use redb::backends::FileBackend;
use rustix::fs::{FlockOperation, flock};
use rustix::io::Errno;
use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// How a journal's name ends.
pub const EXTENSION: &str = "redb";

/// How the name of one that is being made ends; it holds nothing that was ever answered.
const UNFINISHED: &str = "new";

/// How the name of a journal's checkpoint ends.
const CHECKPOINT: &str = "checkpoint";

/// A journal that is kept.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct JournalFile {
    /// Number of the mission among those of its vehicle.
    pub ordinal: u64,
    /// Id of the mission.
    pub mission: String,
    /// The file.
    pub path: PathBuf,
}

impl JournalFile {
    fn named(directory: &Path, name: &str) -> Option<JournalFile> {
        let (ordinal, mission) = name.strip_suffix(EXTENSION)?.strip_suffix('.')?.split_once('-')?;
        let mission = MissionId::new(mission).ok()?.to_string();
        Some(JournalFile { ordinal: ordinal.parse().ok()?, mission, path: directory.join(name) })
    }
}

/// The journals of all vehicles.
#[derive(Clone, Debug)]
pub struct Journals {
    root: PathBuf,
}

impl Journals {
    /// Those below this directory.
    pub fn new(root: impl Into<PathBuf>) -> Journals {
        Journals { root: root.into() }
    }

    /// The vehicles that have any, in the order of their ids. What has no vehicle's name is none.
    ///
    /// # Errors
    /// What the disk says.
    pub fn vehicles(&self) -> Result<Vec<VehicleId>, JournalError> {
        let mut names = names(&self.root)?;
        names.retain(|name| self.root.join(name).is_dir());
        Ok(names.into_iter().filter_map(|name| VehicleId::new(name).ok()).collect())
    }

    /// The missions of a vehicle that have one, in the order in which they were configured.
    ///
    /// # Errors
    /// What the disk says.
    pub fn missions(&self, vehicle: &str) -> Result<Vec<JournalFile>, JournalError> {
        let directory = self.root.join(vehicle);
        let mut found: Vec<JournalFile> = Vec::new();
        for name in names(&directory)? {
            found.extend(JournalFile::named(&directory, &name));
        }
        found.sort_by(|one, other| (one.ordinal, &one.mission).cmp(&(other.ordinal, &other.mission)));
        Ok(found)
    }

    /// Removes what an earlier process had begun to make for a vehicle when it ended. Nobody may be making
    /// any: a daemon does it once, at its start, when it has the directory to itself.
    ///
    /// # Errors
    /// What the disk says.
    pub fn remove_unfinished(&self, vehicle: &str) -> Result<(), JournalError> {
        let directory = self.root.join(vehicle);
        for path in names(&directory)?.into_iter().map(|name| directory.join(name)) {
            if path.extension().is_some_and(|extension| extension == UNFINISHED) {
                fs::remove_file(&path)?;
            }
        }
        Ok(())
    }

    /// The file of a mission's journal.
    pub fn path(&self, vehicle: &str, ordinal: u64, mission: &str) -> PathBuf {
        self.root.join(vehicle).join(format!("{ordinal:06}-{mission}.{EXTENSION}"))
    }

    /// Makes a journal. It has its name only once it is whole, and that is durable when this returns.
    ///
    /// # Errors
    /// What the disk says; there is no journal then.
    pub fn create(&self, header: Header, ordinal: u64, records: &[Record]) -> Result<Journal, JournalError> {
        let path = self.path(&header.vehicle, ordinal, &header.mission);
        let directory = self.root.join(&header.vehicle);
        if !directory.is_dir() {
            fs::create_dir_all(&directory)?;
            sync_directory(&self.root)?;
        }
        create_at(&path, header, records)
    }
}

/// Makes a journal under a name that is free.
///
/// # Errors
/// What the disk says, or that the name is taken.
pub fn create_at(path: &Path, header: Header, records: &[Record]) -> Result<Journal, JournalError> {
    if path.exists() {
        return Err(JournalError::Disk { cause: format!("{} exists already", path.display()) });
    }
    let unfinished = path.with_extension(UNFINISHED);
    let made = (|| {
        let file = File::options().read(true).write(true).create(true).truncate(true).open(&unfinished)?;
        let journal = Journal::create(FileBackend::new(file)?, header, records)?;
        fs::rename(&unfinished, path)?;
        sync_directory(path.parent().unwrap_or(Path::new(".")))?;
        Ok(journal)
    })();
    if made.is_err() {
        // It may not even have been made; what counts is why.
        let _ = fs::remove_file(&unfinished);
    }
    made
}

/// Opens a journal to go on with it.
///
/// # Errors
/// As [`Journal::open`].
pub fn open(path: &Path) -> Result<Journal, JournalError> {
    let file = File::options().read(true).write(true).open(path)?;
    demand_content(&file)?;
    lock(&file, FlockOperation::NonBlockingLockExclusive)?;
    Journal::open(FileBackend::new(file)?)
}

/// Opens a journal to read it; the file is left as it is, and need not be writable.
///
/// # Errors
/// As [`Journal::open`]; [`JournalError::InUse`] while a daemon has it open.
pub fn view(path: &Path) -> Result<Journal, JournalError> {
    let file = File::open(path)?;
    demand_content(&file)?;
    lock(&file, FlockOperation::NonBlockingLockShared)?;
    Journal::open(Overlay::new(Arc::new(FileBackend::new(file)?))?)
}

/// The bytes of the checkpoint beside a journal; none if there is none, or it cannot be read.
pub fn checkpoint(journal: &Path) -> Option<Vec<u8>> {
    fs::read(journal.with_extension(CHECKPOINT)).ok()
}

/// Keeps a checkpoint beside a journal, in the place of the one before it.
///
/// # Errors
/// What the disk says; the one before it is still there then.
pub fn keep_checkpoint(journal: &Path, bytes: &[u8]) -> Result<(), JournalError> {
    let unfinished = journal.with_extension(UNFINISHED);
    let kept = (|| {
        let mut file = File::create(&unfinished)?;
        file.write_all(bytes)?;
        file.sync_all()?;
        fs::rename(&unfinished, journal.with_extension(CHECKPOINT))?;
        Ok(())
    })();
    if kept.is_err() {
        // It may not even have been made; what counts is why.
        let _ = fs::remove_file(&unfinished);
    }
    kept
}

/// Writes what is whole of a journal, up to its damage, to a new one; the file is left as it is.
///
/// # Errors
/// As [`Salvage::find`], [`JournalError::InUse`] while a daemon has it open, and what the disk says.
pub fn recover(path: &Path, to: &Path, identity: u64) -> Result<Salvage, JournalError> {
    let file = File::open(path)?;
    lock(&file, FlockOperation::NonBlockingLockShared)?;
    let storage = FileBackend::new(file)?;
    let salvage = Salvage::find(&storage)?;
    let header = Header::new(identity, &salvage.vehicle, &salvage.mission);
    let mut journal = create_at(to, header, &[salvage.first(&storage)?])?;
    salvage.write(&storage, &mut journal)?;
    Ok(salvage)
}

/// Locks the file as long as it is open.
fn lock(file: &File, how: FlockOperation) -> Result<(), JournalError> {
    match flock(file, how) {
        Ok(()) => Ok(()),
        Err(Errno::WOULDBLOCK) => Err(JournalError::InUse),
        Err(error) => Err(io::Error::from(error).into()),
    }
}

/// An empty file would be taken for a journal to be made.
fn demand_content(file: &File) -> Result<(), JournalError> {
    if FileBackend::new(file.try_clone()?)?.len()? == 0 {
        return Err(JournalError::Damaged { record: Some(0), what: "the file is empty".to_owned() });
    }
    Ok(())
}

fn sync_directory(path: &Path) -> io::Result<()> {
    File::open(path)?.sync_all()
}

/// The names in a directory, in order; none if there is no directory.
fn names(directory: &Path) -> Result<Vec<String>, JournalError> {
    let entries = match fs::read_dir(directory) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Vec::new()),
        entries => entries?,
    };
    let mut names = Vec::new();
    for entry in entries {
        names.extend(entry?.file_name().into_string().ok());
    }
    names.sort();
    Ok(names)
}
