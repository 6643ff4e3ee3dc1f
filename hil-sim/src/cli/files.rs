//! Files that commands write.

use std::fs::File;
use std::path::Path;
use std::process::ExitCode;

use anyhow::Context;
use hil_sim_studies::study::Study;

use super::say::say;

pub(super) fn create_folder(folder: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| {
        format!(
            "{}: can't be made: give another with --out",
            folder.display()
        )
    })
}

/// Makes a file for results, where the user wants it: never over a scene, which `--json *.toml` would take for it.
pub(super) fn create(path: &Path) -> anyhow::Result<(File, &Path)> {
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
    Ok((file, path))
}

pub(super) fn write(path: &Path, text: &str) -> anyhow::Result<()> {
    std::fs::write(path, text).with_context(|| format!("{}: can't be written", path.display()))?;
    say!("{}", path.display());
    Ok(())
}

/// Prints a study's table and writes its files. Exit status 1 if it misses a goal.
pub(super) fn keep<S: Study + ?Sized>(study: &S, out: &Path) -> anyhow::Result<ExitCode> {
    if let Some(table) = study.table() {
        say!("{table}");
    }
    for (kind, text) in study.csvs()? {
        write(&out.join(format!("{}{kind}.csv", S::NAME)), &text)?;
    }
    write(&out.join(format!("{}.svg", S::NAME)), &study.picture())?;
    Ok(ExitCode::from(u8::from(!study.is_met())))
}
