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

use std::path::Path;

use crate::scene::{Scene, SceneError};

impl Scene {
    /// Reads and checks a scene and every file it names.
    pub fn load(path: &Path) -> Result<Self, SceneError> {
        let text = std::fs::read_to_string(path).map_err(|error| {
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
