//! Files that commands write.

use std::path::Path;

use anyhow::Context;

use super::say::say;

pub(super) fn create_folder(folder: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| {
        format!(
            "{}: can't be made: give another with --out",
            folder.display()
        )
    })
}

pub(super) fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    std::fs::write(path, text).with_context(|| format!("{}: can't be written", path.display()))?;
    say!("{}", path.display());
    Ok(())
}
