//! Scene files: TOML, CSV, WAV, MCAP and `.hjif` in, a checked [`Scene`](crate::scene::Scene) out.

pub mod bounds;
pub mod contact;
pub mod csv_rows;
pub mod display;
pub mod fault;
pub mod line;
pub mod read;
pub mod recorded;
pub mod series;
pub mod table;
#[cfg(test)]
pub mod tests;

use std::fs::File;
use std::io;
use std::io::Read;
use std::path::Path;

use crate::scene::{Scene, SceneError};

/// The most that is read of what is no file, in bytes: a device may have no end.
const MOST: u64 = 64 << 20;

/// All that is in a file, or comes out of a pipe.
///
/// # Errors
/// If it can't be read, or does not end.
pub fn read_bytes(path: &Path) -> io::Result<Vec<u8>> {
    let file = File::open(path)?;
    let ends = file.metadata()?.is_file();
    let mut bytes = Vec::new();
    file.take(if ends { u64::MAX } else { MOST })
        .read_to_end(&mut bytes)?;
    if !ends && bytes.len() as u64 == MOST {
        let message = format!("is no file, and does not end within {} MB", MOST >> 20);
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, message));
    }
    Ok(bytes)
}

/// The same as text.
///
/// # Errors
/// If it can't be read, does not end, or is not UTF-8.
pub fn read_text(path: &Path) -> io::Result<String> {
    let not_text = |_| io::Error::new(io::ErrorKind::InvalidData, "is not UTF-8");
    String::from_utf8(read_bytes(path)?).map_err(not_text)
}

impl Scene {
    /// Reads and checks a scene and every file it names.
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        let text = read_text(path).map_err(|error| {
            let message = "give the name of a scene (TOML, UTF-8)";
            SceneError::of(
                path.display(),
                "",
                format!("cannot be read: {error}: {message}"),
            )
        })?;
        read::read(path, &text)
    }

    /// As [`Scene::load`], from text that is said to stand at `path`.
    pub fn parse(path: &Path, text: &str) -> Result<Self, SceneError> {
        read::read(path, text)
    }
}
