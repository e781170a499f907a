//! What can go wrong, sorted by who must act.

use std::path::{Path, PathBuf};

/// Everything that this crate can fail with. Each message is one line: what was found, what was expected, and where.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The file is wrong: the user must mend or replace it.
    #[error("{}: {message}", path.display())]
    BadFile {
        /// The file.
        path: PathBuf,
        /// What was found and what was expected.
        message: String,
    },
    /// The operating system refused: permission, a vanished file, a full disk.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The file is sound, and we cannot read it yet.
    #[error("{}: {message}", path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// What is missing, and what to do instead.
        message: String,
    },
    /// An argument is out of its range.
    #[error("{0}")]
    BadArgument(String),
    /// The caller asked to stop (Ctrl-C).
    #[error("interrupted")]
    Interrupted,
}

/// A result with this crate's error.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// The file is wrong.
    pub fn bad_file(path: &Path, message: impl Into<String>) -> Self {
        Self::BadFile { path: path.to_owned(), message: message.into() }
    }

    /// The operating system refused. An early end of the data means that the file is cut short.
    pub fn io(path: &Path, source: std::io::Error) -> Self {
        if source.kind() == std::io::ErrorKind::UnexpectedEof {
            return Self::bad_file(path, "the file ends before its data does; it is cut short");
        }
        Self::Io { path: path.to_owned(), source }
    }

    /// The file is sound, and we cannot read it yet.
    pub fn unsupported(path: &Path, message: impl Into<String>) -> Self {
        Self::Unsupported { path: path.to_owned(), message: message.into() }
    }
}
