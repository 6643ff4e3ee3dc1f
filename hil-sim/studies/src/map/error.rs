//! Why a map cannot be made, and what to do about it.

use std::path::{Path, PathBuf};

use hil_sim_core::scene::SceneError;

/// What stands in the way of a map.
#[derive(Debug, thiserror::Error)]
pub enum MapError {
    /// No map has this name.
    #[error("{name}: no such map: give some of {known}, or none for all")]
    UnknownMap {
        /// What was asked for.
        name: String,
        /// The names there are.
        known: String,
    },
    /// A shard's text is not of the form i/n.
    #[error("{text}: no shard: give i/n with 1 ≤ i ≤ n ≤ 9999, such as 3/8 for the third of eight")]
    BadShard {
        /// What was given.
        text: String,
    },
    /// There is no such place on an axis.
    #[error("{text}: {map} has no such place along its axis \"{axis}\": give {places}")]
    NoSuchPlace {
        /// The map.
        map: &'static str,
        /// What was given.
        text: String,
        /// The axis.
        axis: String,
        /// What it takes.
        places: String,
    },
    /// A cell's scene is refused.
    #[error("map {map}")]
    Scene {
        /// The map.
        map: &'static str,
        /// The refusal; its file is the one that `--scene` prints.
        source: SceneError,
    },
    /// A file or folder cannot be used.
    #[error("{}: {doing}", path.display())]
    File {
        /// The file or folder.
        path: PathBuf,
        /// What was tried, and what to do.
        doing: &'static str,
        /// Why it failed.
        source: std::io::Error,
    },
    /// Another process writes the same file.
    #[error("{}: another hil-sim map writes it: wait for that one, or give another --out", path.display())]
    Busy {
        /// The file.
        path: PathBuf,
    },
    /// A CSV is not of this map, or not of this version.
    #[error("{}:{line}: {what}: delete the file or move it away, give another --out, or give --renew to measure anew what does not fit", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// Its line.
        line: usize,
        /// What does not fit.
        what: String,
    },
    /// Some cells are not there to be merged.
    #[error("{}: {missing} of {all} runs are missing ({shards}): run those first, or leave --merge out to run them here", path.display())]
    Incomplete {
        /// The file that was to be written.
        path: PathBuf,
        /// Runs (a cell with a method) that no file has.
        missing: usize,
        /// Runs of the map.
        all: usize,
        /// Whose they are.
        shards: String,
    },
}

impl MapError {
    /// Wraps an error of the file system.
    pub(super) fn file(
        path: &Path,
        doing: &'static str,
    ) -> impl FnOnce(std::io::Error) -> Self + use<> {
        let path = path.to_owned();
        move |source| Self::File {
            path,
            doing,
            source,
        }
    }
}
