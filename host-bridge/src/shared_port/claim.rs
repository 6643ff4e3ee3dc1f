//! Who owns a port: a lock in a folder of the user's own, which the system gives up when its holder ends.

use std::fs::{self, DirBuilder, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Read};
use std::os::unix::fs::{DirBuilderExt, FileExt, FileTypeExt, MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use nix::sys::signal::{Signal, kill};
use nix::unistd::{Pid, getuid};

/// Locks that this program has.
static HELD: AtomicUsize = AtomicUsize::new(0);

/// Whether other programs hear a board through this one, or would.
pub fn is_needed() -> bool {
    HELD.load(Ordering::Relaxed) > 0
}

/// A port, whatever name it goes by.
pub struct Device {
    folder: io::Result<PathBuf>,
    name: String,
}

/// Ownership of a port. Dropping the last copy of it gives it up.
pub struct Claim(Arc<Lock>);

/// A file that is locked. Closing it would leave it so for as long as a program that is just being started has it, too:
/// a child has all files of its parent until its own program is loaded.
struct Lock(File);

impl Drop for Lock {
    fn drop(&mut self) {
        HELD.fetch_sub(1, Ordering::Relaxed);
        // If it can't be given up, it goes with the file, a little later.
        let _ = self.0.unlock();
    }
}

impl Claim {
    pub fn again(&self) -> Self {
        Self(Arc::clone(&self.0))
    }

    /// Has `words` stand where its holder is told. Fails if they can't be written.
    pub fn tell(&self, words: &str) -> io::Result<()> {
        let Lock(file) = &*self.0;
        file.write_all_at(words.as_bytes(), 0)?;
        file.set_len(words.len() as u64)
    }
}

impl Device {
    /// One that no folder can be found for.
    #[cfg(test)]
    pub fn without_folder() -> Self {
        Self {
            folder: Err(ErrorKind::PermissionDenied.into()),
            name: String::new(),
        }
    }

    /// The port at `path`; none if there is nothing, or no character device.
    pub fn of(path: &Path) -> Option<Self> {
        let metadata = fs::metadata(path).ok()?;
        let number = metadata.rdev();
        metadata.file_type().is_char_device().then(|| {
            let name = format!("port-{}-{}", libc::major(number), libc::minor(number));
            Self::in_folder(name)
        })
    }

    /// What is called `name`. All that a bench's name may have is told apart.
    pub fn named(name: &str) -> Self {
        let plain = |letter: char| match letter {
            'a'..='z' | 'A'..='Z' | '0'..='9' | '.' | '_' => letter,
            _ => '-',
        };
        Self::in_folder(name.chars().map(plain).collect())
    }

    fn in_folder(name: String) -> Self {
        let folder = folder_with(&searched(), &candidates(), &name);
        Self { folder, name }
    }

    /// Claims the port; `None` if another program has it. Fails if there is no folder to do so in.
    pub fn claim(&self) -> io::Result<Option<Claim>> {
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .mode(0o600)
            .open(self.file("lock")?)?;
        match file.try_lock() {
            Ok(()) => {
                HELD.fetch_add(1, Ordering::Relaxed);
                let claim = Claim(Arc::new(Lock(file)));
                // For people and messages: who it is. A full disk is no reason not to have the port.
                let _ = claim.tell(&own_name());
                Ok(Some(claim))
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

    /// Lets the program that has the port go on, if it is halted: others hear the board through it, and say Stop. Whether it
    /// was. What else can't be done about it shows by its silence.
    pub fn wake_holder(&self) -> bool {
        let Ok(lock) = self.file("lock") else {
            return false;
        };
        let number = process_of(&self.holder()).filter(|&number| is_halted(number));
        // Its number may be another's by now.
        let holder = number.filter(|&number| has_open(number, &lock));
        holder.is_some_and(|number| kill(Pid::from_raw(number), Signal::SIGCONT).is_ok())
    }

    /// Where the owner is heard by others.
    pub fn socket(&self) -> PathBuf {
        self.file("socket").unwrap_or_default()
    }

    fn file(&self, extension: &str) -> io::Result<PathBuf> {
        match &self.folder {
            Ok(folder) => Ok(folder.join(format!("{}.{extension}", self.name))),
            Err(error) => Err(io::Error::new(error.kind(), error.to_string())),
        }
    }
}

/// What stands in each lock that is held and whose name begins with `prefix`, by their names' order.
pub fn held(prefix: &str) -> Vec<String> {
    let folders = searched()
        .into_iter()
        .filter(|folder| is_own(folder).is_ok());
    let mut paths: Vec<PathBuf> = folders
        .filter_map(|folder| fs::read_dir(folder).ok())
        .flatten()
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            name.starts_with(prefix) && name.ends_with(".lock")
        })
        .collect();
    paths.sort();
    paths.dedup();
    let words = |path: PathBuf| {
        let mut file = File::open(path).ok()?;
        if !is_held(&file) {
            return None;
        }
        let mut words = String::new();
        file.read_to_string(&mut words).ok()?;
        Some(words)
    };
    paths.into_iter().filter_map(words).collect()
}

/// Whether somebody holds the lock. Tried as a shared one, so that two who look at once don't take each other for its holder.
fn is_held(lock: &File) -> bool {
    let is_held = matches!(lock.try_lock_shared(), Err(TryLockError::WouldBlock));
    if !is_held {
        let _ = lock.unlock();
    }
    is_held
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

/// The process in a holder's words.
fn process_of(holder: &str) -> Option<i32> {
    let (_, number) = holder.rsplit_once("(process ")?;
    number.strip_suffix(')')?.parse().ok()
}

/// Whether a process has been halted by a signal, as by Ctrl-Z, and not by a debugger.
fn is_halted(process: i32) -> bool {
    let facts = fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
    // Behind the name in brackets, which may hold anything.
    let state = facts.rsplit_once(')').map(|(_, behind)| behind);
    state.is_some_and(|behind| behind.trim_start().starts_with('T'))
}

fn has_open(process: i32, path: &Path) -> bool {
    let files = fs::read_dir(format!("/proc/{process}/fd"));
    let mut files = files.into_iter().flatten().flatten();
    files.any(|file| fs::read_link(file.path()).is_ok_and(|target| target == path))
}

/// The user's folders for what lives no longer than his programs, the best first: where the system has one for that, or else
/// where temporary files go.
fn candidates() -> Vec<PathBuf> {
    let temporary = format!("ridgelink-{}", getuid().as_raw());
    let of_session = std::env::var_os("XDG_RUNTIME_DIR").filter(|folder| !folder.is_empty());
    let of_session = of_session.map(|folder| Path::new(&folder).join("ridgelink"));
    let others = [std::env::temp_dir(), PathBuf::from("/tmp")];
    let others = others.map(|folder| folder.join(&temporary));
    of_session.into_iter().chain(others).collect()
}

/// Where another program of this user may have its locks: a service is not told of the same folder as a session, whose own
/// goes when he leaves.
fn searched() -> Vec<PathBuf> {
    let of_user = format!("/run/user/{}/ridgelink", getuid().as_raw());
    let mut folders = candidates();
    folders.push(of_user.into());
    folders
}

/// The one in which the lock called `name` is held, by a program that has found another one than this would; else the first
/// that can be used. Fails as [`first_usable`] does.
fn folder_with(searched: &[PathBuf], usable: &[PathBuf], name: &str) -> io::Result<PathBuf> {
    let holds = |folder: &&PathBuf| {
        let is_own = is_own(folder).is_ok();
        let lock = is_own.then(|| File::open(folder.join(format!("{name}.lock"))));
        lock.and_then(Result::ok).is_some_and(|file| is_held(&file))
    };
    let first = first_usable(usable);
    let others = searched
        .iter()
        .filter(|other| first.as_ref().ok() != Some(other));
    match others.into_iter().find(holds) {
        Some(folder) => Ok(folder.clone()),
        None => first,
    }
}

/// The first of these folders that is there, or can be made, and is this user's alone. Fails with what is wrong with
/// the last one.
fn first_usable(folders: &[PathBuf]) -> io::Result<PathBuf> {
    let mut wrong = io::Error::from(ErrorKind::NotFound);
    for folder in folders {
        match own(folder) {
            Ok(()) => return Ok(folder.clone()),
            Err(error) => {
                let words = format!("{}: {error}", folder.display());
                wrong = io::Error::new(error.kind(), words);
            }
        }
    }
    Err(wrong)
}

/// Makes a folder if there is none, and fails unless it is this user's alone.
fn own(folder: &Path) -> io::Result<()> {
    match DirBuilder::new().mode(0o700).create(folder) {
        Err(error) if error.kind() != ErrorKind::AlreadyExists => Err(error),
        _ => is_own(folder),
    }
}

/// Fails unless the folder is there and this user's alone.
fn is_own(folder: &Path) -> io::Result<()> {
    let metadata = fs::symlink_metadata(folder)?;
    if metadata.is_dir() && metadata.uid() == getuid().as_raw() && metadata.mode() & 0o077 == 0 {
        Ok(())
    } else {
        let words = "must be a folder of this user's that nobody else may enter";
        Err(io::Error::new(ErrorKind::PermissionDenied, words))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_that_cannot_be_used_is_passed_over() {
        let good = std::env::temp_dir().join(format!("claim-folder-{}", std::process::id()));
        let bad = [
            "/proc/ridgelink",
            "/nonexistent/ridgelink",
            "/dev/null",
            "/",
        ]
        .map(PathBuf::from);
        let folders = [&bad[..], std::slice::from_ref(&good)].concat();
        assert_eq!(first_usable(&folders).expect("the last one"), good);
        fs::remove_dir(good).expect("it was made");
        let words = first_usable(&bad)
            .expect_err("none can be used")
            .to_string();
        assert!(words.starts_with("/: must be a folder"), "{words}");
    }

    /// A service that found another folder than a session does.
    #[test]
    fn a_port_is_claimed_where_another_program_has_claimed_it() {
        let [session, service] = ["session", "service"].map(|of| {
            let name = format!("claim-{of}-{}", std::process::id());
            std::env::temp_dir().join(name)
        });
        let folders = [session.clone(), service.clone()];
        let device = |folders: &[PathBuf]| Device {
            folder: folder_with(folders, folders, "port-1-2"),
            name: "port-1-2".to_owned(),
        };
        let claim = device(&folders[1..])
            .claim()
            .expect("a folder")
            .expect("nobody else");
        let late = device(&folders);
        assert!(late.claim().expect("a folder").is_none(), "it has it");
        assert!(late.socket().starts_with(&service));
        drop(claim);
        let first = device(&folders);
        assert!(first.claim().expect("a folder").is_some());
        assert!(first.socket().starts_with(&session), "nobody has it there");
        for folder in folders {
            fs::remove_dir_all(folder).expect("it was made");
        }
    }

    #[test]
    fn benches_whose_names_differ_in_a_sign_share_no_port() {
        let sockets = ["lab_1", "lab-1", "lab.1", "lab1"].map(|name| {
            [
                "relay:NAME.sensor",
                "relay:NAME.display",
                "hand NAME sensor",
            ]
            .map(|port| Device::named(&port.replace("NAME", name)).socket())
        });
        let mut sockets = sockets.concat();
        sockets.sort();
        let all = sockets.len();
        sockets.dedup();
        assert_eq!(sockets.len(), all, "{sockets:?}");
    }

    #[test]
    fn what_was_given_up_is_free_while_a_program_just_started_still_has_the_file() {
        let port = Device::named(&format!("claim-test-{}", std::process::id()));
        let claim = port.claim().expect("a folder").expect("nobody else");
        // As a child has it from its birth until its own program is loaded.
        let inherited = claim.0.0.try_clone().expect("another handle");
        let again = claim.again();
        drop(claim);
        assert!(port.claim().expect("a folder").is_none(), "a copy is left");
        drop(again);
        assert!(port.claim().expect("a folder").is_some());
        drop(inherited);
    }
}
