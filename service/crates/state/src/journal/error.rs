//! What can become of a journal, each outcome by its name.

use pdn_schemas::problem::Code;
use std::io;

/// Why a journal cannot be read or written.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum JournalError {
    /// There is no such file.
    #[error("there is no such file")]
    Missing,
    /// The user may not.
    #[error("this user may not read or write it: {cause}; give the user access")]
    Denied {
        /// What the system says.
        cause: String,
    },
    /// The disk is full, or a quota is reached.
    #[error("the disk is full: {cause}; make room")]
    Full {
        /// What the system says.
        cause: String,
    },
    /// The file system is mounted for reading only.
    #[error("the file system can only be read: {cause}; mount it for writing")]
    ReadOnly {
        /// What the system says.
        cause: String,
    },
    /// Another failure of the disk.
    #[error("the disk fails: {cause}")]
    Disk {
        /// What the system says.
        cause: String,
    },
    /// Another process has it open.
    #[error("another process has it open; stop that one, or read a copy of the file")]
    InUse,
    /// The file is something else.
    #[error("this is no journal of pdnd: {what}")]
    Foreign {
        /// What it is not.
        what: String,
    },
    /// The file has another format.
    #[error(
        "it has format {found} and this version reads format {expected}; read it with {software}, which \
         wrote it"
    )]
    Format {
        /// The file's.
        found: String,
        /// Ours.
        expected: u32,
        /// What wrote it.
        software: String,
    },
    /// A message or record in it has another layout.
    #[error(
        "{schema} has another layout in it ({found:016x}, here {expected:016x}); read it with {software}, \
         which wrote it"
    )]
    Layout {
        /// The message or record.
        schema: String,
        /// The hash in the file.
        found: u64,
        /// Ours.
        expected: u64,
        /// What wrote it.
        software: String,
    },
    /// What is in it is not what was written.
    #[error("it is damaged{}: {what}", place(.record))]
    Damaged {
        /// The first record that is not whole; unknown where the file as such does not hold together.
        record: Option<u64>,
        /// What shows it.
        what: String,
    },
}

impl JournalError {
    /// The stable code of the contract.
    pub fn code(&self) -> Code {
        match self {
            JournalError::Full { .. } | JournalError::ReadOnly { .. } | JournalError::Disk { .. } => {
                Code::NotDurable
            }
            JournalError::Damaged { .. } => Code::JournalDamaged,
            JournalError::Missing
            | JournalError::Denied { .. }
            | JournalError::InUse
            | JournalError::Foreign { .. }
            | JournalError::Format { .. }
            | JournalError::Layout { .. } => Code::JournalUnreadable,
        }
    }

    pub(crate) fn damaged(record: u64, what: impl Into<String>) -> JournalError {
        JournalError::Damaged { record: Some(record), what: what.into() }
    }
}

impl From<io::Error> for JournalError {
    fn from(error: io::Error) -> JournalError {
        let cause = error.to_string();
        match error.kind() {
            io::ErrorKind::NotFound => JournalError::Missing,
            io::ErrorKind::PermissionDenied => JournalError::Denied { cause },
            io::ErrorKind::StorageFull
            | io::ErrorKind::QuotaExceeded
            | io::ErrorKind::FileTooLarge
            | io::ErrorKind::WriteZero => JournalError::Full { cause },
            io::ErrorKind::ReadOnlyFilesystem => JournalError::ReadOnly { cause },
            io::ErrorKind::InvalidData => JournalError::Foreign { what: cause },
            io::ErrorKind::UnexpectedEof => {
                JournalError::Damaged { record: None, what: format!("the file ends too early: {cause}") }
            }
            _ => JournalError::Disk { cause },
        }
    }
}

impl From<redb::StorageError> for JournalError {
    fn from(error: redb::StorageError) -> JournalError {
        match error {
            redb::StorageError::Io(error) => error.into(),
            redb::StorageError::Corrupted(what) => JournalError::Damaged { record: None, what },
            other => JournalError::Disk { cause: other.to_string() },
        }
    }
}

impl From<redb::DatabaseError> for JournalError {
    fn from(error: redb::DatabaseError) -> JournalError {
        match error {
            redb::DatabaseError::Storage(error) => error.into(),
            redb::DatabaseError::DatabaseAlreadyOpen => JournalError::InUse,
            other => JournalError::Foreign { what: other.to_string() },
        }
    }
}

impl From<redb::TransactionError> for JournalError {
    fn from(error: redb::TransactionError) -> JournalError {
        match error {
            redb::TransactionError::Storage(error) => error.into(),
            other => JournalError::Disk { cause: other.to_string() },
        }
    }
}

impl From<redb::TableError> for JournalError {
    fn from(error: redb::TableError) -> JournalError {
        match error {
            redb::TableError::Storage(error) => error.into(),
            redb::TableError::TableDoesNotExist(table) => {
                JournalError::Foreign { what: format!("it has no table \"{table}\"") }
            }
            other => JournalError::Foreign { what: other.to_string() },
        }
    }
}

impl From<redb::CommitError> for JournalError {
    fn from(error: redb::CommitError) -> JournalError {
        match error {
            redb::CommitError::Storage(error) => error.into(),
            other => JournalError::Disk { cause: other.to_string() },
        }
    }
}

fn place(record: &Option<u64>) -> String {
    record.map_or_else(String::new, |record| format!(" at record {record}"))
}
