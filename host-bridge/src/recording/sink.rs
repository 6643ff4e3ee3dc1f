//! A file on a disk that may fill up, fail or go away, and what of it is safe.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Seek, SeekFrom, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use nix::fcntl::{FcntlArg, OFlag, fcntl};

use crate::output_file::{draft, leads_to};
use crate::recording::RecordingError;

/// A file that is being written.
pub struct Sink {
    /// Its name, as it was given.
    path: PathBuf,
    /// Where that leads, and where it is once it is kept.
    place: PathBuf,
    /// What it is called as long as another file is there.
    draft: Option<PathBuf>,
    /// It was made here, and nothing of it need stay.
    fresh: bool,
    file: File,
    safe_bytes: u64,
    /// Nothing more may be written: a write has failed, or the file has been cut.
    full: Arc<AtomicBool>,
}

/// What writes to it: nothing more once a write has failed, so that what is safe stays as it is.
pub struct SinkWriter {
    file: File,
    /// How far it has come: a pipe can't tell.
    at: u64,
    full: Arc<AtomicBool>,
}

impl Sink {
    /// Makes a file. With `force` it takes the place of one that is there at [`Sink::keep`], of what a link leads to
    /// and not of the link, and writes to a device or a pipe that is there at once. Dropping it before takes it away
    /// again. Fails if there is one already, or it can't be made.
    pub fn create(path: &Path, force: bool) -> Result<Self, RecordingError> {
        // Nothing takes the place of a folder, whatever is asked for.
        if path.is_dir() {
            let reason = io::ErrorKind::IsADirectory.into();
            return Err(RecordingError::not_made(path, reason));
        }
        let place = if force {
            leads_to(path)
        } else {
            path.to_owned()
        };
        let there = fs::metadata(&place).ok().filter(|_| force);
        let is_file = there.as_ref().is_some_and(fs::Metadata::is_file);
        // A pipe that nobody reads is refused, and not waited for.
        let mut options = OpenOptions::new();
        options.write(true).custom_flags(libc::O_NONBLOCK);
        let made = if is_file {
            draft(&place, &mut options).map(|(draft, file)| (Some(draft), file))
        } else {
            options.create_new(there.is_none());
            options.open(&place).map(|file| (None, file))
        };
        let not_made = |source| RecordingError::not_made(path, source);
        let (draft, file) = made.map_err(not_made)?;
        let sink = Self {
            path: path.to_owned(),
            place,
            fresh: there.is_none() || is_file,
            draft,
            file,
            safe_bytes: 0,
            full: Arc::new(AtomicBool::new(false)),
        };
        fcntl(&sink.file, FcntlArg::F_SETFL(OFlag::empty()))
            .map_err(|error| not_made(error.into()))?;
        sink.sync_folder();
        Ok(sink)
    }

    /// A name should outlast a loss of power as bytes do; not every file system can promise it.
    fn sync_folder(&self) {
        let folder = self
            .place
            .parent()
            .filter(|folder| folder.as_os_str() != "");
        if let Ok(folder) = File::open(folder.unwrap_or(Path::new("."))) {
            let _ = folder.sync_all();
        }
    }

    /// The file stays, under its own name. Fails if it can't get that name.
    pub fn keep(&mut self) -> Result<(), RecordingError> {
        if let Some(draft) = &self.draft {
            fs::rename(draft, &self.place)
                .map_err(|source| RecordingError::not_made(&self.path, source))?;
            self.draft = None;
            self.sync_folder();
        }
        self.fresh = false;
        Ok(())
    }

    /// What writes to it. Fails if the system has no more handles.
    pub fn writer(&self) -> Result<SinkWriter, RecordingError> {
        let file = self.file.try_clone();
        Ok(SinkWriter {
            file: file.map_err(|source| RecordingError::not_made(&self.path, source))?,
            at: 0,
            full: Arc::clone(&self.full),
        })
    }

    /// Makes what has been written safe against a loss of power. Fails if the system can't, or the file was
    /// removed: what is written to a file without a name is lost.
    pub fn sync(&mut self) -> Result<(), RecordingError> {
        match self.file.sync_data() {
            // A pipe or a device: there is nothing to be synced.
            Err(error) if error.kind() == io::ErrorKind::InvalidInput => {}
            synced => synced.map_err(|source| self.failed(source))?,
        }
        let metadata = self.file.metadata();
        let metadata = metadata.map_err(|source| self.failed(source))?;
        if metadata.nlink() == 0 {
            return Err(RecordingError::Removed(self.path.clone()));
        }
        self.safe_bytes = metadata.len();
        Ok(())
    }

    pub const fn safe_bytes(&self) -> u64 {
        self.safe_bytes
    }

    /// Takes away what is not safe, and lets nothing more be written. A file of which nothing is safe and that
    /// was not kept goes when the sink does.
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

impl Drop for Sink {
    fn drop(&mut self) {
        if self.fresh {
            let _ = fs::remove_file(self.draft.as_deref().unwrap_or(&self.place));
        }
    }
}

impl Write for SinkWriter {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.full.load(Ordering::Relaxed) {
            return Err(io::Error::other("an earlier write has failed"));
        }
        let written = self.file.write(bytes);
        match &written {
            Ok(count) => self.at += *count as u64,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(_) => self.full.store(true, Ordering::Relaxed),
        }
        written
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Seek for SinkWriter {
    /// Where it stands, and nowhere else: what is in the file is never touched again.
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        match to {
            SeekFrom::Current(0) => Ok(self.at),
            _ => Err(io::ErrorKind::Unsupported.into()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_takes_the_place_of_the_one_that_is_meant_and_of_no_other() {
        let folder = std::env::temp_dir().join(format!("sink-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let [old, other, link, dangling, nothing] =
            ["old", "old.new", "link", "dangling", "nothing"].map(|name| folder.join(name));
        fs::write(&old, "old").unwrap();
        fs::write(&other, "another's").unwrap();
        std::os::unix::fs::symlink("old", &link).unwrap();
        std::os::unix::fs::symlink("nothing", &dangling).unwrap();
        let write = |path: &Path, text: &str| {
            let mut sink = Sink::create(path, true).unwrap();
            sink.writer().unwrap().write_all(text.as_bytes()).unwrap();
            sink.keep().unwrap();
        };
        drop(Sink::create(&old, true).unwrap());
        drop(Sink::create(&dangling, true).unwrap());
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 4);
        assert_eq!(fs::read_to_string(&old).unwrap(), "old");
        write(&old, "1");
        assert_eq!(fs::read_to_string(&other).unwrap(), "another's");
        write(&link, "2");
        assert_eq!(fs::read_to_string(&old).unwrap(), "2");
        for path in [&link, &dangling] {
            let refused = Sink::create(path, false).map(drop);
            assert!(matches!(refused, Err(RecordingError::Exists(_))));
        }
        write(&dangling, "3");
        assert_eq!(fs::read_to_string(&nothing).unwrap(), "3");
        assert!(link.is_symlink() && dangling.is_symlink());
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 5);
        fs::remove_dir_all(folder).unwrap();
    }
}
