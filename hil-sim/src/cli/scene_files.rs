//! The scenes that a command names: files, and folders with all scenes in them.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use hil_sim_studies::map::Shard;

/// The files, in the order in which they are named; those of a folder in the order of their names, with those of the
/// folders in it that are no links. Only those of a shard, if one is given.
pub(super) fn scene_files(named: &[PathBuf], shard: Option<Shard>) -> anyhow::Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for path in named {
        if path.is_dir() {
            let before = files.len();
            collect(path, &mut files)?;
            if files.len() == before {
                bail!(
                    "{}: no scene in this folder: give one with TOML files",
                    path.display()
                );
            }
        } else {
            files.push(path.clone());
        }
    }
    let mut index = 0;
    files.retain(|_| {
        index += 1;
        shard.is_none_or(|shard| shard.holds(index - 1))
    });
    Ok(files)
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> anyhow::Result<()> {
    let context = || format!("{}: cannot be read", folder.display());
    let mut entries = fs::read_dir(folder)
        .with_context(context)?
        .map(|entry| entry.map(|entry| entry.path()))
        .collect::<Result<Vec<_>, _>>()
        .with_context(context)?;
    entries.sort();
    for path in entries {
        if path.is_dir() {
            // A link may lead back here.
            if !path.is_symlink() {
                collect(&path, files)?;
            }
        } else if path.extension().is_some_and(|ending| ending == "toml") && !is_golden(&path) {
            files.push(path);
        }
    }
    Ok(())
}

/// The file of golden hashes may lie among the scenes.
fn is_golden(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name == "golden.toml")
}
