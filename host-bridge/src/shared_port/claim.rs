//! Who owns a port: a lock in a folder of the user's own, which the system gives up when its holder ends.

use std::fs::{self, DirBuilder, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::fs::{DirBuilderExt, FileTypeExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use nix::unistd::getuid;

/// A port, whatever name it goes by.
pub struct Device {
    folder: io::Result<PathBuf>,
    name: String,
}

/// Ownership of a port. Dropping the last copy of it gives it up.
pub struct Claim(Arc<File>);

impl Claim {
    /// The same claim once more.
    pub fn again(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl Device {
    /// The port at `path`; none if there is nothing, or no character device.
    pub fn of(path: &Path) -> Option<Self> {
        let metadata = fs::metadata(path).ok()?;
        let number = metadata.rdev();
        metadata.file_type().is_char_device().then(|| Self {
            folder: folder(),
            name: format!("port-{}-{}", libc::major(number), libc::minor(number)),
        })
    }

    /// What is called `name`, of which only letters, digits and `-` are told apart.
    pub fn named(name: &str) -> Self {
        let plain = |letter: char| {
            if letter.is_ascii_alphanumeric() {
                letter
            } else {
                '-'
            }
        };
        Self {
            folder: folder(),
            name: name.chars().map(plain).collect(),
        }
    }

    /// Claims the port; `None` if another program has it.
    ///
    /// # Errors
    /// If there is no folder to do so in.
    pub fn claim(&self) -> io::Result<Option<Claim>> {
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .mode(0o600)
            .open(self.file("lock")?)?;
        match file.try_lock() {
            Ok(()) => {
                // For people and messages: who it is.
                file.set_len(0)?;
                write!(file, "{}", own_name())?;
                Ok(Some(Claim(Arc::new(file))))
            }
            Err(TryLockError::WouldBlock) => Ok(None),
            Err(TryLockError::Error(error)) => Err(error),
        }
    }

    /// Who has the port, in words.
    pub fn holder(&self) -> String {
        let mut name = String::new();
        let read = self
            .file("lock")
            .and_then(File::open)
            .and_then(|file| file.take(200).read_to_string(&mut name));
        match read {
            Ok(1..) => name,
            _ => "another program".to_owned(),
        }
    }

    /// Where the owner is heard by others.
    pub fn socket(&self) -> PathBuf {
        self.file("socket").unwrap_or_default()
    }

    fn file(&self, extension: &str) -> io::Result<PathBuf> {
        match &self.folder {
            Ok(folder) => Ok(folder.join(&self.name).with_extension(extension)),
            Err(error) => Err(io::Error::new(error.kind(), error.to_string())),
        }
    }
}

/// This program and its number, e.g. `host-bridge record (process 4711)`.
fn own_name() -> String {
    let mut words = std::env::args_os();
    let program = words.next().map(PathBuf::from).unwrap_or_default();
    let program = program.file_name().unwrap_or_default().to_string_lossy();
    let command = words.next().unwrap_or_default();
    let process = std::process::id();
    format!(
        "{program} {} (process {process})",
        command.to_string_lossy()
    )
}

/// The user's folder for what lives no longer than his programs.
fn folder() -> io::Result<PathBuf> {
    let user = getuid().as_raw();
    let folder = match std::env::var_os("XDG_RUNTIME_DIR") {
        Some(folder) if Path::new(&folder).is_dir() => Path::new(&folder).join("ridgelink"),
        _ => std::env::temp_dir().join(format!("ridgelink-{user}")),
    };
    match DirBuilder::new().mode(0o700).create(&folder) {
        Err(error) if error.kind() != ErrorKind::AlreadyExists => return Err(error),
        _ => {}
    }
    let metadata = fs::symlink_metadata(&folder)?;
    if metadata.is_dir() && metadata.uid() == user && metadata.mode() & 0o077 == 0 {
        Ok(folder)
    } else {
        let words = format!(
            "{} must be a folder of this user's that nobody else may enter",
            folder.display()
        );
        Err(io::Error::new(ErrorKind::PermissionDenied, words))
    }
}
