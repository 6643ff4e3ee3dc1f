//! Why a scene cannot be used, and what to do about it.

use std::path::Path;

/// What is wrong with a scene or with a file it names: `file:line: key: what is wrong: what to do`.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}{}: {}{message}", file, line.map(|line| format!(":{line}")).unwrap_or_default(), if key.is_empty() { String::new() } else { format!("{key}: ") })]
pub struct SceneError {
    /// The file at fault, as it was named.
    pub file: String,
    /// The line at fault, from 1 on; none if the file as a whole is.
    pub line: Option<usize>,
    /// The key at fault with its path (`surface.specimens[1].wavelength_mm`), or the CSV column; empty
    /// if it is none of them.
    pub key: String,
    /// What is wrong and what to do.
    pub message: String,
}

impl SceneError {
    /// A scene file that cannot be read at all.
    pub(crate) fn unreadable(path: &Path, error: &std::io::Error) -> Self {
        Self {
            file: path.display().to_string(),
            line: None,
            key: String::new(),
            message: format!("cannot be read: {error}: give the name of a scene (TOML, UTF-8)"),
        }
    }
}
