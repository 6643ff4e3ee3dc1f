//! Why a recording can't be written, or goes no further.

use std::io;
use std::path::{Path, PathBuf};

/// What went wrong with a recording that is being written.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// There is such a file or folder already.
    #[error("{0}: is there already: give another name, or --force to write over it")]
    Exists(PathBuf),
    /// The file or folder can't be made.
    #[error("{0}: can't be made: {1}")]
    NotMade(PathBuf, #[source] io::Error),
    /// The file does not take what is to be written.
    #[error("{path}: can't be written any further: {source}; {safe_bytes} bytes of it are safe")]
    NotWritten {
        /// The file.
        path: PathBuf,
        /// What is on the disk and readable.
        safe_bytes: u64,
        /// The system's reason.
        source: io::Error,
    },
    /// The file was removed while it was being written.
    #[error("{0}: was removed while it was being written")]
    Removed(PathBuf),
    /// Neither a file nor a folder was named.
    #[error("there is nowhere to record to: give a file, FILE.mcap, or --csv FOLDER")]
    Nowhere,
    /// The thread that writes has come to grief; it has said so on standard error.
    #[error("the recording stopped by an error of this program")]
    Died,
}

impl RecordingError {
    pub(super) fn not_made(path: &Path, source: io::Error) -> Self {
        let path = path.to_owned();
        if source.kind() == io::ErrorKind::AlreadyExists {
            Self::Exists(path)
        } else {
            Self::NotMade(path, source)
        }
    }
}
