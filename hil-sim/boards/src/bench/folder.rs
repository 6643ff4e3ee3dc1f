//! The folder of a bench: its ports by stable names, and a file that tells where they are.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::{PortName, ServeError};
use crate::Firmwares;

/// Held by the one bench that a folder may have.
const LOCK: &str = "serve.lock";
/// What a host-bridge reads.
const BENCH: &str = "bench.toml";

/// A folder that is this bench's alone as long as this lives.
#[derive(Debug)]
pub struct Folder {
    path: PathBuf,
    lock: File,
}

#[derive(Serialize)]
struct BenchFile<'a> {
    sensor: BoardEntry<'a>,
    display: BoardEntry<'a>,
}

#[derive(Serialize)]
struct BoardEntry<'a> {
    port: PathBuf,
    rtt: PathBuf,
    elf: &'a Path,
}

impl Folder {
    /// Takes `path`, which is made if it is not there.
    ///
    /// # Errors
    /// If another bench has it, or it can't be written to.
    pub fn take(path: &Path) -> Result<Self, ServeError> {
        let refuse = ServeError::folder(path);
        let path = std::path::absolute(path).map_err(&refuse)?;
        fs::create_dir_all(&path).map_err(&refuse)?;
        let lock = OpenOptions::new()
            .create(true)
            .truncate(false)
            .write(true)
            .open(path.join(LOCK))
            .map_err(&refuse)?;
        match lock.try_lock() {
            Ok(()) => Ok(Self { path, lock }),
            Err(TryLockError::WouldBlock) => Err(ServeError::Taken { path }),
            Err(TryLockError::Error(source)) => Err(refuse(source)),
        }
    }

    /// Where a port is, or would be.
    pub fn port(&self, name: PortName) -> PathBuf {
        self.path.join(name.name())
    }

    /// Where the file is that tells of the ports.
    pub fn bench_file(&self) -> PathBuf {
        self.path.join(BENCH)
    }

    /// Writes it, whole or not at all.
    ///
    /// # Errors
    /// If it can't be written.
    pub fn describe(&self, firmwares: &Firmwares) -> Result<(), ServeError> {
        let path = self.bench_file();
        let refuse = ServeError::folder(&path);
        let absolute = |elf: &Path| std::path::absolute(elf).map_err(&refuse);
        let (sensor_elf, display_elf) = (
            absolute(&firmwares.sensor.path)?,
            absolute(&firmwares.display.path)?,
        );
        let file = BenchFile {
            sensor: BoardEntry {
                port: self.port(PortName::SensorConsole),
                rtt: self.port(PortName::SensorRtt),
                elf: &sensor_elf,
            },
            display: BoardEntry {
                port: self.port(PortName::DisplayConsole),
                rtt: self.port(PortName::DisplayRtt),
                elf: &display_elf,
            },
        };
        let text = toml::to_string(&file).map_err(|error| refuse(io::Error::other(error)))?;
        let draft = self.path.join("bench.toml.new");
        fs::write(&draft, text).map_err(&refuse)?;
        fs::rename(&draft, &path).map_err(refuse)
    }

    /// Lets `name` lead to `target`, whatever it led to before.
    ///
    /// # Errors
    /// If something else than a link is there, or the folder can't be written to.
    pub fn link(&self, name: PortName, target: &Path) -> Result<(), ServeError> {
        let path = self.port(name);
        let refuse = ServeError::folder(&path);
        if fs::symlink_metadata(&path).is_ok_and(|there| !there.is_symlink()) {
            return Err(refuse(io::ErrorKind::AlreadyExists.into()));
        }
        let draft = path.with_extension("new");
        let _ = fs::remove_file(&draft);
        symlink(target, &draft).map_err(&refuse)?;
        fs::rename(&draft, &path).map_err(refuse)
    }

    /// Takes the link away, if it is there.
    pub fn unlink(&self, name: PortName) {
        let path = self.port(name);
        if fs::symlink_metadata(&path).is_ok_and(|there| there.is_symlink()) {
            let _ = fs::remove_file(path);
        }
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        for name in PortName::ALL {
            self.unlink(name);
        }
        let _ = fs::remove_file(self.bench_file());
        // Closing it alone leaves it to a program that is just being started, and so has all files of this one.
        let _ = self.lock.unlock();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_is_free_again_while_a_program_just_started_still_has_its_lock() {
        let path = std::env::temp_dir().join(format!("bench-folder-{}", std::process::id()));
        let folder = Folder::take(&path).unwrap();
        let inherited = folder.lock.try_clone().unwrap();
        assert!(matches!(Folder::take(&path), Err(ServeError::Taken { .. })));
        drop(folder);
        let again = Folder::take(&path);
        assert!(again.is_ok(), "{again:?}");
        drop(inherited);
        fs::remove_dir_all(&path).unwrap();
    }
}
