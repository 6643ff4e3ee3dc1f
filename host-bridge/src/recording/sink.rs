//! A file on a disk that may fill up, fail or go away, and what of it is safe.

use std::fs::{File, OpenOptions};
use std::io::{self, Seek, SeekFrom, Write};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::error::RecordingError;

/// A file that is being written.
pub struct Sink {
    path: PathBuf,
    file: File,
    safe_bytes: u64,
    /// Nothing more may be written: a write has failed, or the file has been cut.
    full: Arc<AtomicBool>,
}

/// What writes to it: nothing more once a write has failed, so that what is safe stays as it is.
pub struct SinkWriter {
    file: File,
    full: Arc<AtomicBool>,
}

impl Sink {
    /// Makes a file; `force` writes over one that is there.
    ///
    /// # Errors
    /// If there is one already, or it can't be made.
    pub fn create(path: &Path, force: bool) -> Result<Self, RecordingError> {
        let mut options = OpenOptions::new();
        if force {
            options.write(true).create(true).truncate(true);
        } else {
            options.write(true).create_new(true);
        }
        let file = options
            .open(path)
            .map_err(|source| RecordingError::not_made(path, source))?;
        // Its name should outlast a loss of power as its bytes do; not every file system can promise it.
        let folder = path.parent().filter(|folder| folder.as_os_str() != "");
        if let Ok(folder) = File::open(folder.unwrap_or(Path::new("."))) {
            let _ = folder.sync_all();
        }
        Ok(Self {
            path: path.to_owned(),
            file,
            safe_bytes: 0,
            full: Arc::new(AtomicBool::new(false)),
        })
    }

    /// What writes to it.
    ///
    /// # Errors
    /// If the system has no more handles.
    pub fn writer(&self) -> Result<SinkWriter, RecordingError> {
        let file = self.file.try_clone();
        Ok(SinkWriter {
            file: file.map_err(|source| RecordingError::not_made(&self.path, source))?,
            full: Arc::clone(&self.full),
        })
    }

    /// Makes what has been written safe against a loss of power.
    ///
    /// # Errors
    /// If the system can't, or the file was removed: what is written to a file without a name is lost.
    pub fn sync(&mut self) -> Result<(), RecordingError> {
        match self.file.sync_data() {
            // A pipe or a device: there is nothing to be synced.
            Err(error) if error.kind() == io::ErrorKind::InvalidInput => {}
            synced => synced.map_err(|source| self.failed(source))?,
        }
        let metadata = self.file.metadata();
        let metadata = metadata.map_err(|source| self.failed(source))?;
        if metadata.nlink() == 0 {
            return Err(RecordingError::Removed {
                path: self.path.clone(),
            });
        }
        self.safe_bytes = metadata.len();
        Ok(())
    }

    /// Bytes that are safe.
    pub const fn safe_bytes(&self) -> u64 {
        self.safe_bytes
    }

    /// Takes away what is not safe, and lets nothing more be written.
    pub fn cut(&self) {
        self.full.store(true, Ordering::Relaxed);
        // A device has no length.
        let _ = self.file.set_len(self.safe_bytes);
        let _ = self.file.sync_data();
    }

    /// The error of a write that failed.
    pub fn failed(&self, source: io::Error) -> RecordingError {
        RecordingError::NotWritten {
            path: self.path.clone(),
            safe_bytes: self.safe_bytes,
            source,
        }
    }
}

impl Write for SinkWriter {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.full.load(Ordering::Relaxed) {
            return Err(io::Error::other("an earlier write has failed"));
        }
        let written = self.file.write(bytes);
        if let Err(error) = &written
            && error.kind() != io::ErrorKind::Interrupted
        {
            self.full.store(true, Ordering::Relaxed);
        }
        written
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for SinkWriter {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.file.seek(to)
    }
}
