//! A file that a command makes: never over one that is there, unless that is asked for.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Why a file is not made.
#[derive(Debug, thiserror::Error)]
pub enum OutputFileError {
    #[error("{0}: is there already: give another name, or --force to write over it")]
    Exists(PathBuf),
    #[error("{0}: can't be written: {1}")]
    NotWritten(PathBuf, #[source] io::Error),
}

impl OutputFileError {
    pub fn not_written(path: &Path, source: io::Error) -> Self {
        Self::NotWritten(path.to_owned(), source)
    }
}

/// Refuses a file that is there already, unless it is written over by `force`. Fails with
/// [`OutputFileError::Exists`].
pub fn refuse_taken(path: &Path, force: bool) -> Result<(), OutputFileError> {
    if path.exists() && !force {
        return Err(OutputFileError::Exists(path.to_owned()));
    }
    Ok(())
}

/// Writes the whole file. Fails with [`OutputFileError::NotWritten`].
pub fn write(path: &Path, text: &str) -> Result<(), OutputFileError> {
    fs::write(path, text).map_err(|source| OutputFileError::not_written(path, source))
}
