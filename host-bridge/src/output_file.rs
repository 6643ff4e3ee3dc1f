//! A file that a command makes: never over one that is there, unless that is asked for.

use std::fs::{self, File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

/// Why a file is not made.
#[derive(Debug, thiserror::Error)]
pub enum OutputFileError {
    #[error("{0}: is there already: give another name, or --force to write over it")]
    Exists(PathBuf),
    #[error("{0}: is what is read: give another name")]
    IsInput(PathBuf),
    #[error("{0}: can't be written: {1}{advice}", advice = advice(.1))]
    NotWritten(PathBuf, #[source] io::Error),
}

/// What to do about a file that can't be made or written, to stand behind the system's reason.
pub fn advice(reason: &io::Error) -> &'static str {
    use io::ErrorKind;
    match reason.kind() {
        ErrorKind::NotFound => ": make its folder first",
        ErrorKind::NotADirectory => ": a file is in the way: give another place",
        ErrorKind::IsADirectory => ": give the name of a file",
        ErrorKind::InvalidFilename => ": give a shorter name",
        ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem => {
            ": give a place that you may write to"
        }
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => ": make room, or give another place",
        _ => "",
    }
}

impl OutputFileError {
    pub fn not_written(path: &Path, source: io::Error) -> Self {
        Self::NotWritten(path.to_owned(), source)
    }
}

/// Refuses a file that is there already, unless it is written over by `force`; and `input`, which is read for it,
/// even then; and a folder in any case. Fails with [`OutputFileError`].
pub fn refuse_taken(path: &Path, force: bool, input: &Path) -> Result<(), OutputFileError> {
    if let (Ok(place), Ok(input)) = (fs::canonicalize(path), fs::canonicalize(input))
        && place == input
    {
        return Err(OutputFileError::IsInput(path.to_owned()));
    }
    if path.is_dir() {
        let reason = io::ErrorKind::IsADirectory.into();
        return Err(OutputFileError::not_written(path, reason));
    }
    // A link is there even if it leads to nothing.
    if !force && fs::symlink_metadata(path).is_ok() {
        return Err(OutputFileError::Exists(path.to_owned()));
    }
    Ok(())
}

/// Makes the whole file by `make`, which is given its name, and takes it away again if that fails. One that is
/// there already stays until then. Fails with [`OutputFileError::NotWritten`].
pub fn made_by(
    path: &Path,
    make: impl FnOnce(&Path) -> io::Result<()>,
) -> Result<(), OutputFileError> {
    replaced_by(path, make).map_err(|source| OutputFileError::not_written(path, source))
}

/// The same for those who have words of their own for what fails: fails with the system's reason.
pub fn replaced_by(path: &Path, make: impl FnOnce(&Path) -> io::Result<()>) -> io::Result<()> {
    // A device or a pipe.
    if fs::metadata(path).is_ok_and(|there| !there.is_file()) {
        return make(path);
    }
    let place = leads_to(path);
    let (draft, file) = draft(&place, OpenOptions::new().write(true))?;
    drop(file);
    let made = make(&draft).and_then(|()| fs::rename(&draft, &place));
    made.inspect_err(|_| {
        let _ = fs::remove_file(&draft);
    })
}

/// What a name stands for, through links, also where they lead to nothing: not a link is replaced, but what it leads
/// to.
pub fn leads_to(path: &Path) -> PathBuf {
    /// As many as Linux follows.
    const MOST_LINKS: usize = 40;
    let mut place = path.to_owned();
    for _ in 0..MOST_LINKS {
        let Ok(next) = fs::read_link(&place) else {
            break;
        };
        place = place.parent().unwrap_or(Path::new("")).join(next);
    }
    place
}

/// Makes a file that is to take the place of `place`, beside it and under a name that nobody has: also not an earlier
/// program that was killed. Fails if it can't be made.
pub fn draft(place: &Path, options: &mut OpenOptions) -> io::Result<(PathBuf, File)> {
    options.create_new(true);
    let mut number = 0_u32;
    loop {
        let mut name = place.file_name().unwrap_or_default().to_owned();
        name.push(format!(".new-{}-{number}", std::process::id()));
        let draft = place.with_file_name(name);
        match options.open(&draft) {
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => number += 1,
            made => return made.map(|file| (draft, file)),
        }
    }
}

/// Writes the whole file, as [`made_by`]. Fails with [`OutputFileError::NotWritten`].
pub fn write(path: &Path, text: &str) -> Result<(), OutputFileError> {
    made_by(path, |path| fs::write(path, text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_there_stays_until_all_of_the_new_is() {
        let folder = std::env::temp_dir().join(format!("output-file-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let [old, link, new] = ["old", "link", "new"].map(|name| folder.join(name));
        write(&old, "old").unwrap();
        std::os::unix::fs::symlink("old", &link).unwrap();
        let half = |path: &Path| {
            fs::write(path, "ha")?;
            Err(io::ErrorKind::StorageFull.into())
        };
        for path in [&old, &link, &new] {
            let error = made_by(path, half).unwrap_err().to_string();
            assert!(error.starts_with(&format!("{}: can't be written", path.display())));
        }
        assert_eq!(fs::read_to_string(&old).unwrap(), "old");
        assert!(!new.exists());
        assert!(refuse_taken(&new, false, &old).is_ok());
        assert!(matches!(
            refuse_taken(&old, false, &new),
            Err(OutputFileError::Exists(_))
        ));
        assert!(refuse_taken(&old, true, &new).is_ok());
        for (path, input) in [(&old, &old), (&link, &old), (&old, &link)] {
            let refused = refuse_taken(path, true, input);
            assert!(matches!(refused, Err(OutputFileError::IsInput(_))));
        }
        write(&link, "new").unwrap();
        assert_eq!(fs::read_to_string(&old).unwrap(), "new");
        assert!(link.is_symlink());
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 2);
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_draft_takes_no_name_that_somebody_has() {
        let folder = std::env::temp_dir().join(format!("output-draft-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let out = folder.join("out");
        let process = std::process::id();
        let others = ["out.new".to_owned(), format!("out.new-{process}-0")];
        let others = others.map(|name| folder.join(name));
        for other in &others {
            fs::write(other, "another's").unwrap();
        }
        write(&out, "text").unwrap();
        assert_eq!(fs::read_to_string(&out).unwrap(), "text");
        for other in &others {
            assert_eq!(fs::read_to_string(other).unwrap(), "another's");
        }
        assert_eq!(fs::read_dir(&folder).unwrap().count(), 3);
        fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn a_link_to_nothing_is_there_and_stays_a_link() {
        let folder = std::env::temp_dir().join(format!("output-link-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        let [link, out, input] = ["link", "out", "input"].map(|name| folder.join(name));
        std::os::unix::fs::symlink("out", &link).unwrap();
        assert!(matches!(
            refuse_taken(&link, false, &input),
            Err(OutputFileError::Exists(_))
        ));
        assert!(refuse_taken(&link, true, &input).is_ok());
        write(&link, "text").unwrap();
        assert!(link.is_symlink());
        assert_eq!(fs::read_to_string(&out).unwrap(), "text");
        fs::remove_dir_all(folder).unwrap();
    }
}
