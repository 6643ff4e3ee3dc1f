//! A file that a command makes: never over one that is there, unless that is asked for.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// Why a file is not made.
#[derive(Debug, thiserror::Error)]
pub enum OutputFileError {
    #[error("{0}: is there already: give another name, or --force to write over it")]
    Exists(PathBuf),
    #[error("{0}: is what is read: give another name")]
    IsInput(PathBuf),
    #[error("{0}: can't be written: {1}")]
    NotWritten(PathBuf, #[source] io::Error),
}

impl OutputFileError {
    pub fn not_written(path: &Path, source: io::Error) -> Self {
        Self::NotWritten(path.to_owned(), source)
    }
}

/// Refuses a file that is there already, unless it is written over by `force`; and `input`, which is read for it,
/// even then. Fails with [`OutputFileError::Exists`] or [`OutputFileError::IsInput`].
pub fn refuse_taken(path: &Path, force: bool, input: &Path) -> Result<(), OutputFileError> {
    let Ok(place) = fs::canonicalize(path) else {
        return Ok(());
    };
    if fs::canonicalize(input).is_ok_and(|input| input == place) {
        return Err(OutputFileError::IsInput(path.to_owned()));
    }
    if !force {
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
    // What a link leads to, not the link.
    let place = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let mut draft = place.clone().into_os_string();
    draft.push(".new");
    let made = make(Path::new(&draft)).and_then(|()| fs::rename(&draft, &place));
    made.inspect_err(|_| {
        let _ = fs::remove_file(&draft);
    })
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
}
