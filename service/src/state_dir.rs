//! The directory of the journals: made, checked for writing and locked, so that two daemons never share one.

use rustix::fs::{FlockOperation, flock};
use std::fs::{File, create_dir_all};
use std::io;
use std::path::{Path, PathBuf};

/// The locked directory; the lock goes with the value, or with the process however it ends.
pub struct StateDir {
    _lock: Option<File>,
}

/// Why the directory cannot be used.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum StateDirError {
    #[error(
        "cannot use the state directory {}: {cause}; name one that this user may write with --state-dir",
        .path.display()
    )]
    Unusable { path: PathBuf, cause: io::Error },
    #[error(
        "the state directory {} is in use by another pdnd; stop it or name another with --state-dir",
        .path.display()
    )]
    InUse { path: PathBuf },
}

impl StateDir {
    /// Makes and locks the directory; an empty path means that there is none.
    pub fn open(path: &Path) -> Result<StateDir, StateDirError> {
        if path.as_os_str().is_empty() {
            return Ok(StateDir { _lock: None });
        }
        let unusable = |cause| StateDirError::Unusable { path: path.to_owned(), cause };
        create_dir_all(path).map_err(unusable)?;
        let lock = File::options().create(true).append(true).open(path.join("lock")).map_err(unusable)?;
        match flock(&lock, FlockOperation::NonBlockingLockExclusive) {
            Ok(()) => Ok(StateDir { _lock: Some(lock) }),
            Err(error) if error == rustix::io::Errno::WOULDBLOCK => {
                Err(StateDirError::InUse { path: path.to_owned() })
            }
            Err(error) => Err(unusable(error.into())),
        }
    }
}
