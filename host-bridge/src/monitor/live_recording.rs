//! A recording that is made while watching.

use std::path::{Path, PathBuf};

use crate::recording::{PART, Recorder, RecordingError, Settings, part_path};

/// A recording under way.
pub struct LiveRecording {
    /// Its file.
    pub path: PathBuf,
    /// Since when, in µs of [`crate::host_clock::now_us`].
    pub since_us: u64,
    /// What writes it.
    pub recorder: Recorder,
}

impl LiveRecording {
    /// Begins one in `folder`, under the first name of `monitor-1.mcap`, `monitor-2.mcap` and so on that is free.
    /// Fails if it can't be written there.
    pub fn begin(folder: &Path, since_us: u64) -> Result<Self, RecordingError> {
        let named = |number: u32| folder.join(format!("monitor-{number}.mcap"));
        let is_free = |path: &PathBuf| !path.exists() && !part_path(path, 2).exists();
        let path = (1..=u32::MAX)
            .map(named)
            .find(is_free)
            .unwrap_or_else(|| named(0));
        let recorder = Recorder::start(Settings {
            mcap: Some(path.clone()),
            csv: None,
            force: false,
            part: Some(PART),
        })?;
        Ok(Self {
            path,
            since_us,
            recorder,
        })
    }
}
