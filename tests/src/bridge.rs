//! The `host-bridge` program, as its user starts it.

use std::env;
use std::ffi::OsStr;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant, SystemTime};

/// Between two looks at whether a program has ended.
const LOOK: Duration = Duration::from_millis(2);

/// Where cargo puts the program: next to the folder of the test that runs.
///
/// # Panics
/// If it has not been built, or a file that it is made of has changed since: the message says what to do.
pub fn path() -> PathBuf {
    let test = env::current_exe().expect("a test knows where it is");
    let program = test
        .parent()
        .and_then(Path::parent)
        .map(|built| built.join(format!("host-bridge{}", env::consts::EXE_SUFFIX)))
        .expect("cargo puts tests two folders below its target");
    if let Err(what) = check(&program) {
        panic!("{what}: run ./test, which builds it, or `cargo build --workspace --bins`");
    }
    program
}

/// Whether the program is there and as new as its sources, by the list that cargo writes beside it.
fn check(program: &Path) -> Result<(), String> {
    let changed = |path: &Path| fs::metadata(path).and_then(|facts| facts.modified());
    let Ok(built) = changed(program) else {
        return Err(format!("{}: is not built", program.display()));
    };
    let list = fs::read_to_string(program.with_extension("d")).unwrap_or_default();
    let newer = |source: &PathBuf| changed(source).is_ok_and(|at: SystemTime| at > built);
    match sources(&list).into_iter().find(newer) {
        Some(source) => Err(format!(
            "{}: is older than {}",
            program.display(),
            source.display()
        )),
        None => Ok(()),
    }
}

/// The files after the colon, where a space in a name has a backslash before it.
fn sources(list: &str) -> Vec<PathBuf> {
    let Some((_, names)) = list.trim_end().split_once(": ") else {
        return Vec::new();
    };
    names
        .replace("\\ ", "\0")
        .split(' ')
        .map(|name| PathBuf::from(name.replace('\0', " ")))
        .collect()
}

/// The program, to be started with whatever arguments a test gives it: without the bench file and the
/// settings of whoever runs the tests, and without input.
pub fn command() -> Command {
    let mut command = Command::new(path());
    command
        .env_remove("RIDGELINK_BENCH")
        .env_remove("HOME")
        .env_remove("XDG_CONFIG_HOME")
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// What a program left behind.
#[derive(Clone, Debug)]
pub struct Ended {
    /// How it ended.
    pub status: ExitStatus,
    /// What it printed.
    pub stdout: String,
    /// What it said beside that.
    pub stderr: String,
}

/// Runs the program with `arguments` until it ends.
///
/// # Panics
/// If it has not ended within `limit`: it is killed, and the message holds what it said.
pub fn run(arguments: impl IntoIterator<Item = impl AsRef<OsStr>>, limit: Duration) -> Ended {
    Running::start(command().args(arguments)).wait(limit)
}

/// A program that runs, and that is read so that it never waits for its reader. Dropping it kills it.
pub struct Running {
    /// The program.
    pub child: Child,
    stdout: Option<JoinHandle<String>>,
    stderr: Option<JoinHandle<String>>,
}

impl Running {
    /// Starts `command`. Only what it has piped and nobody has taken is read.
    ///
    /// # Panics
    /// If it can't be started.
    pub fn start(command: &mut Command) -> Self {
        let mut child = command.spawn().expect("the program can be started");
        let stdout = child.stdout.take().map(read);
        let stderr = child.stderr.take().map(read);
        Self {
            child,
            stdout,
            stderr,
        }
    }

    /// Whether it has ended by itself.
    pub fn has_ended(&mut self) -> bool {
        matches!(self.child.try_wait(), Ok(Some(_)))
    }

    /// Sends it a signal by name, such as INT: what Ctrl-C does.
    ///
    /// # Panics
    /// If there is no `kill`, or no such program any more.
    pub fn signal(&self, name: &str) {
        let sent = Command::new("kill")
            .args(["-s", name, &self.child.id().to_string()])
            .status();
        assert!(
            sent.is_ok_and(|status| status.success()),
            "no signal {name}"
        );
    }

    /// Waits for its end.
    ///
    /// # Panics
    /// If it has not ended within `limit`: it is killed, and the message holds what it said.
    pub fn wait(mut self, limit: Duration) -> Ended {
        let end = Instant::now() + limit;
        let status = loop {
            match self.child.try_wait().expect("a child can be waited for") {
                Some(status) => break Some(status),
                None if Instant::now() >= end => break None,
                None => thread::park_timeout(LOOK),
            }
        };
        if status.is_none() {
            let _ = self.child.kill();
        }
        let stdout = text(self.stdout.take());
        let stderr = text(self.stderr.take());
        let Some(status) = status else {
            panic!("not ended after {limit:?}; it said:\n{stdout}{stderr}");
        };
        Ended {
            status,
            stdout,
            stderr,
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn read(mut pipe: impl Read + Send + 'static) -> JoinHandle<String> {
    thread::spawn(move || {
        let mut bytes = Vec::new();
        // What came before an error is worth as much as the rest.
        let _ = pipe.read_to_end(&mut bytes);
        String::from_utf8_lossy(&bytes).into_owned()
    })
}

fn text(reader: Option<JoinHandle<String>>) -> String {
    reader
        .and_then(|reader| reader.join().ok())
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cargos_list_is_read_with_spaces_in_names() {
        assert_eq!(
            sources("/t/debug/host-bridge: /a/main.rs /with\\ space/lib.rs\n"),
            [
                PathBuf::from("/a/main.rs"),
                PathBuf::from("/with space/lib.rs")
            ]
        );
        assert!(sources("").is_empty());
    }
}
