//! Files that commands write.

use std::fs::{self, File};
use std::io::Write;
use std::path::Path;

use anyhow::Context;

use super::say::say;

pub(super) fn create_folder(folder: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(folder).with_context(|| {
        format!(
            "{}: can't be made: give another with --out",
            folder.display()
        )
    })
}

/// A file for results, opened before there are any: an hour is not to be lost for a folder that is not there.
pub(super) struct Results<'a> {
    pub path: &'a Path,
    pub file: File,
}

impl<'a> Results<'a> {
    /// Makes a file where the user wants it: never over a scene, which `--json *.toml` would take for it.
    pub fn create(path: &'a Path) -> anyhow::Result<Self> {
        anyhow::ensure!(
            path.extension().is_none_or(|ending| ending != "toml"),
            "{}: is a scene's name, and would be written over: give results a name of their own before the scenes",
            path.display()
        );
        let file = File::create(path).with_context(|| {
            format!(
                "{}: cannot be written: give a file in a folder that exists",
                path.display()
            )
        })?;
        Ok(Self { path, file })
    }

    /// The same where one is wanted.
    pub fn wanted(path: Option<&'a Path>) -> anyhow::Result<Option<Self>> {
        path.map(Self::create).transpose()
    }

    pub fn write(mut self, text: &str) -> anyhow::Result<()> {
        let written = self.file.write_all(text.as_bytes());
        written.with_context(|| self.path.display().to_string())
    }

    pub fn write_json(self, content: &impl serde::Serialize) -> anyhow::Result<()> {
        self.write(&(serde_json::to_string_pretty(content)? + "\n"))
    }
}

/// Writes a file of a folder that is there, and tells of it.
pub(super) fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    fs::write(path, text).with_context(|| format!("{}: can't be written", path.display()))?;
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
        fs::write(&path, text).with_context(|| path.display().to_string())?;
    }
    Ok(())
}
