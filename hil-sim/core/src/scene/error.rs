//! Why a scene cannot be used, and what to do about it.

/// What is wrong with a scene or with a file it names: `file:line: key: what is wrong: what to do`.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{}{}: {}{}",
    shown(file),
    line.map(|line| format!(":{line}")).unwrap_or_default(),
    if key.is_empty() { String::new() } else { format!("{}: ", shown(key)) },
    shown(message)
)]
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

/// A text with its control characters escaped: what a scene holds must not rule a terminal.
fn shown(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for letter in text.chars() {
        if letter.is_control() {
            shown.extend(letter.escape_debug());
        } else {
            shown.push(letter);
        }
    }
    shown
}

impl SceneError {
    /// Of a file as a whole.
    pub(crate) fn of(
        file: impl ToString,
        key: impl Into<String>,
        message: impl Into<String>,
    ) -> Self {
        Self {
            file: file.to_string(),
            line: None,
            key: key.into(),
            message: message.into(),
        }
    }
}
