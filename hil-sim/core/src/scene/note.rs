//! What a scene's author should know of a scene that runs all the same.

/// What is out of date in a scene: `file:line: key: what is so`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// The scene, as it was named.
    pub file: String,
    /// The line, from 1 on.
    pub line: Option<usize>,
    /// The key with its path, as in `estimator.method`.
    pub key: String,
    /// What is so, and what to do.
    pub message: String,
}

impl std::fmt::Display for Note {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(&self.file)?;
        if let Some(line) = self.line {
            write!(formatter, ":{line}")?;
        }
        write!(formatter, ": {}: {}", self.key, self.message)
    }
}
