//! Why a map cannot be made, and what to do about it.

use std::io;
use std::path::{Path, PathBuf};

use hil_sim_core::scene::SceneError;

/// What stands in the way of a map.
#[derive(Debug, thiserror::Error)]
pub enum MapError {
    /// No map has this name; there are these.
    #[error("{0}: no such map: give some of {1}, or none for all")]
    UnknownMap(String, String),
    /// A shard's text is not of the form i/n.
    #[error("{0}: no shard: give i/n with 1 ≤ i ≤ n ≤ 9999, such as 3/8 for the third of eight")]
    BadShard(String),
    #[error("{text}: {map} has no such place along its axis \"{axis}\": give {places}")]
    #[allow(missing_docs, reason = "the message says what they are")]
    NoSuchPlace {
        map: &'static str,
        text: String,
        axis: &'static str,
        places: String,
    },
    /// A cell's scene is refused. The refusal's file is the one that `--scene` prints.
    #[error("map {0}")]
    Scene(&'static str, #[source] SceneError),
    /// A file or folder cannot be used: what was tried, and what to do.
    #[error("{}: {}", .0.display(), .1)]
    File(PathBuf, &'static str, #[source] io::Error),
    /// Another process writes the same file.
    #[error("{}: another hil-sim map writes it: wait for that one, or give another --out", .0.display())]
    Busy(PathBuf),
    /// A line of a CSV is not of this map, or not of this version.
    #[error("{}:{}: {}: delete the file or move it away, give another --out, or give --renew to measure anew what does not fit", .0.display(), .1, .2)]
    Foreign(PathBuf, usize, String),
    #[error("{}: {missing} of {all} runs are missing ({shards}): run those first, or leave --merge out to run them here", path.display())]
    #[allow(missing_docs, reason = "the message says what they are")]
    Incomplete {
        path: PathBuf,
        missing: usize,
        all: usize,
        shards: String,
    },
}

/// What is said of a file that cannot be written.
pub(super) const NOT_WRITTEN: &str = "cannot be written: give another --out";

impl MapError {
    pub(super) fn file(path: &Path, doing: &'static str) -> impl FnOnce(io::Error) -> Self + use<> {
        let path = path.to_owned();
        move |source| Self::File(path, doing, source)
    }
}
