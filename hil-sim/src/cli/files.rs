//! Files that commands write.

use std::collections::BTreeSet;
use std::fs::{self, File, TryLockError};
use std::io::{self, BufWriter, ErrorKind, Read, Seek, Write};
#[cfg(unix)]
use std::os::fd::AsFd;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use anyhow::Context;
#[cfg(target_os = "linux")]
use signal_hook::{
    consts::{SIGINT, SIGTERM},
    iterator::Signals,
    low_level::emulate_default_handler,
};

use super::say::{keep_standard_output, say};

pub(super) fn create_folder(folder: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(folder).with_context(|| {
        format!(
            "{}: can't be made: give another with --out",
            folder.display()
        )
    })
}

/// What results are written as, and what a file of it begins with.
#[derive(Clone, Copy, Debug)]
pub(super) enum Format {
    JsonList,
    JsonObject,
    Html,
    Xml,
    /// With these words before the first comma.
    Csv(&'static str),
}

impl Format {
    /// Whether a file that begins so may hold results from before: nothing else is written over.
    fn is_of(self, head: &str) -> bool {
        // A scene may begin with a bracket as well.
        let two: String = head
            .split_whitespace()
            .collect::<String>()
            .chars()
            .take(2)
            .collect();
        match self {
            Self::JsonList => matches!(two.as_str(), "[{" | "[]"),
            Self::JsonObject => two == "{\"",
            Self::Html => head.starts_with("<!doctype html"),
            Self::Xml => head.starts_with("<?xml"),
            Self::Csv(first) => head.split(',').next() == Some(first),
        }
    }
}

/// Names that a program's own standard output has.
#[cfg(unix)]
const STANDARD_OUTPUTS: [&str; 3] = ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"];

/// A file for results, opened before there are any: an hour is not to be lost for a folder that is not there.
///
/// What is written goes to a draft beside it, named `FILE.part`, which takes the file's place at the end: until
/// then an earlier result is there. SIGINT and SIGTERM take the draft away. A device or a pipe is written
/// to at once. So is standard output, which takes one result; what else would be printed there goes to standard error.
pub(super) struct Results<'a> {
    pub path: &'a Path,
    file: BufWriter<File>,
    /// And the place that it takes.
    draft: Option<[PathBuf; 2]>,
}

impl<'a> Results<'a> {
    /// Makes a file where the user wants it: over results from before, but never over anything else, which
    /// `--json *.toml` would take for it.
    pub fn create(path: &'a Path, format: Format) -> anyhow::Result<Self> {
        let here = path.display();
        anyhow::ensure!(
            path.extension().is_none_or(|ending| ending != "toml"),
            "{here}: is a scene's name, and would be written over: give results a name of their own before the scenes"
        );
        anyhow::ensure!(
            path != Path::new("-"),
            "-: is no file's name here: give /dev/stdout for standard output, or ./- for a file"
        );
        let wrong = || format!("{here}: cannot be written: give a file in a folder that exists");
        #[cfg(unix)]
        if STANDARD_OUTPUTS.iter().any(|name| path == Path::new(name)) {
            anyhow::ensure!(
                keep_standard_output(),
                "{here}: standard output takes one result: give the other a file of its own"
            );
            // As it is: opened by its name, a file that it leads to would be begun anew.
            let out = io::stdout().as_fd().try_clone_to_owned();
            return Ok(Self {
                path,
                file: BufWriter::new(File::from(out.with_context(wrong)?)),
                draft: None,
            });
        }
        let there = match fs::metadata(path) {
            Ok(there) => Some(there),
            Err(error) if error.kind() == ErrorKind::NotFound => None,
            Err(error) => return Err(error).with_context(wrong),
        };
        anyhow::ensure!(
            there.is_some() || !path.is_symlink(),
            "{here}: is a link that leads nowhere: nothing was written; give another file, or take it away"
        );
        if there.as_ref().is_some_and(|there| !there.is_file()) {
            let file = File::options().write(true).open(path).with_context(wrong)?;
            let file = BufWriter::new(file);
            return Ok(Self {
                path,
                file,
                draft: None,
            });
        }
        // What a link leads to, not the link.
        let place = match there {
            Some(_) => fs::canonicalize(path).with_context(wrong)?,
            None => path.to_owned(),
        };
        if there.is_some() {
            let mut head = Vec::new();
            let file = File::options()
                .read(true)
                .write(true)
                .open(&place)
                .with_context(wrong)?;
            file.take(256).read_to_end(&mut head).with_context(wrong)?;
            anyhow::ensure!(
                head.is_empty() || format.is_of(&String::from_utf8_lossy(&head)),
                "{here}: is there, and no result from before: nothing was written; give another file, or take it away"
            );
        }
        let mut draft = place.clone().into_os_string();
        draft.push(".part");
        let draft = PathBuf::from(draft);
        #[cfg(target_os = "linux")]
        take_away_at_signals().with_context(wrong)?;
        let file = File::options()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&draft)
            .with_context(wrong)?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => anyhow::bail!(
                "{here}: is being written already: give each result a file of its own"
            ),
            Err(TryLockError::Error(error)) => return Err(error).with_context(wrong),
        }
        let mut head = Vec::new();
        (&file)
            .take(256)
            .read_to_end(&mut head)
            .with_context(wrong)?;
        anyhow::ensure!(
            head.is_empty() || format.is_of(&String::from_utf8_lossy(&head)),
            "{}: is there, and no draft of results: nothing was written; give another file, or take it away",
            draft.display()
        );
        drafts().insert(draft.clone());
        file.set_len(0).with_context(wrong)?;
        (&file).rewind().with_context(wrong)?;
        Ok(Self {
            path,
            file: BufWriter::new(file),
            draft: Some([draft, place]),
        })
    }

    /// The same where one is wanted.
    pub fn wanted(path: Option<&'a Path>, format: Format) -> anyhow::Result<Option<Self>> {
        path.map(|path| Self::create(path, format)).transpose()
    }

    /// All of it.
    pub fn write(mut self, text: &str) -> anyhow::Result<()> {
        self.part(|file| file.write_all(text.as_bytes()))?;
        self.end()
    }

    pub fn write_json(self, content: &impl serde::Serialize) -> anyhow::Result<()> {
        self.write(&(serde_json::to_string_pretty(content)? + "\n"))
    }

    /// A part of it.
    pub fn part(
        &mut self,
        write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
    ) -> anyhow::Result<()> {
        write(&mut self.file).map_err(|error| self.given_up(error))
    }

    /// A draft that could not be written would only take the room that is missing.
    fn given_up(&mut self, error: io::Error) -> anyhow::Error {
        if let Some([draft, _]) = self.draft.take()
            && drafts().remove(&draft)
        {
            let _ = fs::remove_file(draft);
        }
        anyhow::Error::new(error).context(unwritten(self.path))
    }

    /// Nothing more is to come: it takes its place.
    pub fn end(mut self) -> anyhow::Result<()> {
        self.part(BufWriter::flush)?;
        let Some([draft, place]) = self.draft.take() else {
            return Ok(());
        };
        let mut drafts = drafts();
        drafts.remove(&draft);
        fs::rename(&draft, place).with_context(|| {
            let (here, draft) = (self.path.display(), draft.display());
            format!("{here}: cannot be written over: the results are in {draft}")
        })
    }
}

impl Drop for Results<'_> {
    /// A draft stays if there is anything in it.
    fn drop(&mut self) {
        // What is not written shows in what is there.
        let _ = self.file.flush();
        if let Some([draft, _]) = &self.draft
            && drafts().remove(draft)
            && fs::metadata(draft).is_ok_and(|draft| draft.len() == 0)
        {
            let _ = fs::remove_file(draft);
        }
    }
}

/// What is said of a file that could not be written to its end.
fn unwritten(path: &Path) -> String {
    let path = path.display();
    format!("{path}: can't be written: make room there, or give a file elsewhere")
}

/// The drafts that are being written, each until it has taken its place or has been given up.
fn drafts() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    static DRAFTS: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());
    DRAFTS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Has SIGINT and SIGTERM take all drafts away before they end the program.
#[cfg(target_os = "linux")]
fn take_away_at_signals() -> io::Result<()> {
    static ARE_HEARD: Mutex<bool> = Mutex::new(false);
    let mut are_heard = ARE_HEARD.lock().unwrap_or_else(PoisonError::into_inner);
    if *are_heard {
        return Ok(());
    }
    // Not SIGHUP: who listens to it undoes what nohup has asked for.
    let mut signals = Signals::new([SIGINT, SIGTERM])?;
    std::thread::spawn(move || {
        for signal in signals.forever() {
            // Held to the end: none takes its place any more.
            let drafts = drafts();
            for draft in &*drafts {
                // There is nobody to tell.
                let _ = fs::remove_file(draft);
            }
            let _ = emulate_default_handler(signal);
        }
    });
    *are_heard = true;
    Ok(())
}

/// Writes a file of a folder that is there, and tells of it.
pub(super) fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    fs::write(path, text).with_context(|| unwritten(path))?;
    say!("{}", path.display());
    Ok(())
}

/// Writes files of a folder that is there.
pub(super) fn write_all<'a>(
    folder: &Path,
    files: impl IntoIterator<Item = (&'a str, String)>,
) -> anyhow::Result<()> {
    for (name, text) in files {
        let path = folder.join(name);
        fs::write(&path, text).with_context(|| unwritten(&path))?;
    }
    Ok(())
}
